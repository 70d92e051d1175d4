#include "harness/io/npy.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string_view>

#include "harness/io/json_input.h"

namespace nullmark {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "\x93NUMPY";

/// Headers are told to be short; real ones have a hundred bytes.
constexpr std::uint64_t kLongestHeader = 1 << 16;
constexpr std::size_t kMostDimensions = 8;

[[noreturn]] void refuse(const std::string& path, const std::string& what) { throw InputError(path + ": " + what); }

/// Reads the dictionary of a header, a Python literal: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }.
class HeaderReader {
 public:
  HeaderReader(std::string_view text, const std::string& path) : rest_(text), path_(path) {}

  NpyHeader read() {
    NpyHeader header;
    std::set<std::string> told;
    expect('{');
    while (!found('}')) {
      const std::string key = quoted();
      expect(':');
      if (!told.insert(key).second) malformed();
      if (key == "descr")
        header.bytes_per_number = number_type();
      else if (key == "fortran_order")
        c_order();
      else if (key == "shape")
        header.shape = shape();
      else
        malformed();
      if (found(',')) continue;
      expect('}');
      break;
    }
    skip_space();
    if (!rest_.empty() || told.size() != 3) malformed();
    return header;
  }

 private:
  [[noreturn]] void malformed() const {
    refuse(path_, "its header is no dictionary of 'descr', 'fortran_order' and 'shape'; write it with numpy.save");
  }

  void skip_space() {
    while (!rest_.empty() && (rest_[0] == ' ' || rest_[0] == '\n' || rest_[0] == '\t')) rest_.remove_prefix(1);
  }

  bool found(char wanted) {
    skip_space();
    if (rest_.empty() || rest_[0] != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }

  void expect(char wanted) {
    if (!found(wanted)) malformed();
  }

  bool word(std::string_view wanted) {
    skip_space();
    if (!rest_.starts_with(wanted)) return false;
    rest_.remove_prefix(wanted.size());
    return true;
  }

  std::string quoted() {
    skip_space();
    if (rest_.empty() || (rest_[0] != '\'' && rest_[0] != '"')) malformed();
    const std::size_t end = rest_.find(rest_[0], 1);
    if (end == std::string_view::npos) malformed();
    const std::string text(rest_.substr(1, end - 1));
    rest_.remove_prefix(end + 1);
    return text;
  }

  std::size_t number_type() {
    skip_space();
    // Types with named fields are lists.
    if (rest_.starts_with('[')) refuse(path_, "its numbers have fields; expected '<f4' or '<f8'");
    const std::string type = quoted();
    if (type == "<f4") return 4;
    if (type == "<f8") return 8;
    const bool printable = std::all_of(type.begin(), type.end(), [](char c) { return c >= ' ' && c <= '~'; });
    refuse(path_, fmt::format("found numbers of type '{}'; expected '<f4' or '<f8', as of numpy.float32 and numpy.float64",
                              printable ? type.substr(0, 20) : "?"));
  }

  void c_order() {
    if (word("False")) return;
    if (word("True")) refuse(path_, "its numbers are in Fortran's order; expected C order: save numpy.ascontiguousarray(...)");
    malformed();
  }

  std::uint64_t whole() {
    skip_space();
    constexpr std::size_t kMostDigits = 18;
    const std::size_t digits = std::min(rest_.find_first_not_of("0123456789"), rest_.size());
    if (digits == 0 || digits > kMostDigits) malformed();
    const std::uint64_t value = std::stoull(std::string(rest_.substr(0, digits)));
    rest_.remove_prefix(digits);
    return value;
  }

  std::vector<std::uint64_t> shape() {
    std::vector<std::uint64_t> shape;
    expect('(');
    while (!found(')')) {
      shape.push_back(whole());
      if (shape.size() > kMostDimensions) malformed();
      if (found(',')) continue;
      expect(')');
      break;
    }
    return shape;
  }

  std::string_view rest_;
  const std::string& path_;
};

/// The numbers of a shape; nothing where their bytes are too many for a file.
std::optional<std::uint64_t> product(const std::vector<std::uint64_t>& shape) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 56;
  std::uint64_t numbers = 1;
  for (const std::uint64_t n : shape)
    if (__builtin_mul_overflow(numbers, n, &numbers) || numbers > kMost) return std::nullopt;
  return numbers;
}

std::uint64_t size_of(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) refuse(path, "no such file");
  // A pipe would be waited for.
  if (status.type() != std::filesystem::file_type::regular) refuse(path, "is no file; expected an .npy file");
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) refuse(path, "cannot be read");
  return size;
}

}  // namespace

NpyHeader read_npy_header(const std::string& path) {
  const std::uint64_t size = size_of(path);
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse(path, "cannot be read");
  // Magic, version, and the length of the header in 2 or 4 bytes.
  char begin[12] = {};
  file.read(begin, sizeof begin);
  if (file.gcount() < 10 || std::string_view(begin, kMagic.size()) != kMagic)
    refuse(path, "is no .npy file; write it with numpy.save");
  const int version = static_cast<unsigned char>(begin[6]);
  if (version != 1 && version != 2) refuse(path, fmt::format("found version {} of .npy; expected 1 or 2", version));
  const std::uint64_t at = version == 1 ? 10 : 12;
  std::uint32_t length = 0;
  std::memcpy(&length, begin + 8, at - 8);
  if (length > kLongestHeader || at + length > size)
    refuse(path, fmt::format("its header has {} bytes; the file has {}", length, size));
  std::string text(length, '\0');
  file.clear();
  file.seekg(static_cast<std::streamoff>(at));
  if (!file.read(text.data(), static_cast<std::streamsize>(length))) refuse(path, "cannot be read");
  NpyHeader header = HeaderReader(text, path).read();
  header.begin = at + length;
  const auto numbers = product(header.shape);
  if (!numbers) refuse(path, fmt::format("found shape ({}); no file is that large", fmt::join(header.shape, ", ")));
  header.numbers = *numbers;
  const std::uint64_t expected = header.begin + header.numbers * header.bytes_per_number;
  if (size != expected)
    refuse(path, fmt::format("found {} bytes; its header says {}: the file is {}", size, expected,
                             size < expected ? "cut short; write it again" : "longer than its shape; write it again"));
  return header;
}

void read_npy(const std::string& path, const NpyHeader& header,
              const std::function<void(std::uint64_t first, std::span<const Real> numbers)>& take) {
  constexpr std::uint64_t kAtOnce = 1 << 16;
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(header.begin));
  std::vector<Real> numbers(kAtOnce);
  std::vector<float> singles(kAtOnce);
  const bool wide = header.bytes_per_number == sizeof(Real);
  for (std::uint64_t first = 0; first < header.numbers; first += kAtOnce) {
    const auto count = static_cast<std::size_t>(std::min(kAtOnce, header.numbers - first));
    char* const into = wide ? reinterpret_cast<char*>(numbers.data()) : reinterpret_cast<char*>(singles.data());
    if (!file.read(into, static_cast<std::streamsize>(count * header.bytes_per_number)))
      refuse(path, "cannot be read to its end; did it change?");
    if (!wide) std::copy_n(singles.begin(), count, numbers.begin());
    take(first, {numbers.data(), count});
  }
}

std::string npy_text(const std::vector<std::uint64_t>& shape, std::span<const Real> numbers) {
  std::string header = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}{}), }}", fmt::join(shape, ", "),
                                   shape.size() == 1 ? "," : "");
  // The numbers begin at a multiple of 64.
  constexpr std::size_t kBefore = 10, kAligned = 64;
  header.append(kAligned - (kBefore + header.size() + 1) % kAligned, ' ');
  header += '\n';
  std::string text(kMagic);
  text += {'\x01', '\0', static_cast<char>(header.size() & 0xff), static_cast<char>(header.size() >> 8)};
  text += header;
  text.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
  return text;
}

}  // namespace nullmark

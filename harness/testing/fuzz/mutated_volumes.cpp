// Reads many damaged copies of a volume the way the program does, and counts what becomes of them:
//   nullmark_mutated_volumes FILE.vdb GRID COUNT SEED [FOLDER for those that crash, hang or exhaust memory]
// Every one must end in a volume or in one line, within the limits; else the exit code is 1.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>

#include "media/base/parameters.h"
#include "media/volumes/vdb_reader.h"

namespace nullmark {
namespace {

using Random = std::mt19937_64;

/// Half of the time in the header, where sizes, types and offsets stand.
std::size_t place_in(const std::string& bytes, Random& random) {
  constexpr std::size_t kHeader = 2048;
  return random() % (random() % 2 ? std::min(kHeader, bytes.size()) : bytes.size());
}

std::string mutated(std::string bytes, Random& random) {
  switch (random() % 4) {
    case 0:  // truncated
      bytes.resize(place_in(bytes, random));
      break;
    case 1:  // bits flipped
      for (auto left = 1 + random() % 8; left > 0; --left) {
        char& byte = bytes[place_in(bytes, random)];
        byte = static_cast<char>(byte ^ (1 << random() % 8));
      }
      break;
    case 2: {  // sizes and counts blown up
      static constexpr std::uint64_t kLarge[] = {0xffffffffffffffff, 0x7fffffffffffffff, 0xffffffff,
                                                 0x7fffffff,         0x10000000,         0xffff};
      const std::uint64_t value = kLarge[random() % std::size(kLarge)];
      const std::size_t place = place_in(bytes, random), width = random() % 2 ? 4 : 8;
      std::copy_n(reinterpret_cast<const char*>(&value), std::min(width, bytes.size() - place),
                  bytes.begin() + static_cast<std::ptrdiff_t>(place));
      break;
    }
    default: {  // a stretch replaced by another, so that types and structures stand where others are expected
      const std::size_t from = place_in(bytes, random), to = place_in(bytes, random);
      const std::size_t length = std::min({std::size_t{1} + random() % 64, bytes.size() - from, bytes.size() - to});
      bytes.replace(to, length, std::string(bytes, from, length));
    }
  }
  return bytes;
}

std::string outcome(const std::string& message) {
  for (const char* words : {"crashed on it (signal 6", "crashed on it (signal 7", "crashed on it (signal 8",
                            "crashed on it (signal 11", "crashed on it", "without an end", "did not finish", "was killed",
                            "more memory", "does not hold together", "could not hand over", "not a readable OpenVDB file"})
    if (message.find(words) != std::string::npos) return words;
  return "refused with what is wrong with the grid";
}

int run(int argc, char** argv) {
  if (argc < 5) {
    fmt::print(stderr, "usage: nullmark_mutated_volumes FILE.vdb GRID COUNT SEED [FOLDER]\n");
    return 2;
  }
  std::ifstream in(argv[1], std::ios::binary);
  const std::string intact{std::istreambuf_iterator<char>(in), {}};
  const std::string file = fmt::format("{}/nullmark_mutated_{}.vdb", std::filesystem::temp_directory_path().string(), argv[4]);
  Random random(std::stoull(argv[4]));
  std::map<std::string, int> counts;
  double longest = 0;
  bool good = true;
  for (int n = std::stoi(argv[3]); n > 0; --n) {
    const std::string bytes = mutated(intact, random);
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
    const auto begin = std::chrono::steady_clock::now();
    std::string what = "a volume";
    try {
      read_vdb(file, argv[2]);
    } catch (const ParameterError& error) {
      const std::string message = error.what();
      what = outcome(message);
      good &= message.find('\n') == std::string::npos && message.find(file) == 0;
    }
    longest = std::max(longest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    const int number = ++counts[what];
    if (argc > 5 && what != "a volume" && what.rfind("refused", 0) != 0 && what.rfind("not a", 0) != 0)
      std::filesystem::copy_file(file, fmt::format("{}/{}, seed {}, {}.vdb", argv[5], what, argv[4], number));
  }
  std::filesystem::remove(file);
  for (const auto& [what, count] : counts) fmt::print("{:6d} {}\n", count, what);
  fmt::print("longest {:.2f} s; {}\n", longest, good ? "all clear" : "a message was not one line that begins with the file");
  return good ? 0 : 1;
}

}  // namespace
}  // namespace nullmark

int main(int argc, char** argv) { return nullmark::run(argc, argv); }

#include "harness/io/packing.h"

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/binary_from_base64.hpp>
#include <boost/archive/iterators/dataflow_exception.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <boost/iostreams/copy.hpp>
#include <boost/iostreams/device/array.hpp>
#include <boost/iostreams/device/back_inserter.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_stream.hpp>

namespace nullmark {

std::string base64(std::string_view bytes) {
  using namespace boost::archive::iterators;
  using Encoder = base64_from_binary<transform_width<std::string_view::const_iterator, 6, 8>>;
  std::string text(Encoder(bytes.begin()), Encoder(bytes.end()));
  text.append((3 - bytes.size() % 3) % 3, '=');
  return text;
}

std::string from_base64(std::string_view text) {
  using namespace boost::archive::iterators;
  using Decoder = transform_width<binary_from_base64<std::string_view::const_iterator>, 8, 6>;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  // An incomplete last byte is what the padding stood for.
  const std::size_t bytes = text.size() * 6 / 8;
  std::string result;
  for (Decoder at(text.begin()); result.size() < bytes; ++at) result += *at;
  return result;
}

std::string packed(const std::string& text) {
  namespace io = boost::iostreams;
  std::string bytes;
  io::filtering_ostream stream;
  stream.push(io::gzip_compressor(io::gzip::best_compression));
  stream.push(io::back_inserter(bytes));
  io::copy(io::array_source(text.data(), text.size()), stream);
  return base64(bytes);
}

std::optional<std::string> unpacked(std::string_view text, std::size_t most) {
  namespace io = boost::iostreams;
  try {
    const std::string bytes = from_base64(text);
    io::filtering_istream stream;
    stream.push(io::gzip_decompressor());
    stream.push(io::array_source(bytes.data(), bytes.size()));
    // Otherwise what is damaged would only look shorter.
    stream.exceptions(std::ios::badbit);
    std::string result, part(std::size_t{1} << 16, 0);
    while (stream.read(part.data(), static_cast<std::streamsize>(part.size())) || stream.gcount() > 0) {
      result.append(part, 0, static_cast<std::size_t>(stream.gcount()));
      if (result.size() > most) return std::nullopt;
    }
    return result;
  } catch (const io::gzip_error&) {
    return std::nullopt;
  } catch (const std::ios_base::failure&) {
    return std::nullopt;
  } catch (const boost::archive::iterators::dataflow_exception&) {
    return std::nullopt;
  }
}

}  // namespace nullmark

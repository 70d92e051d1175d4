#include "harness/report/packing.h"

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/binary_from_base64.hpp>
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

}  // namespace nullmark

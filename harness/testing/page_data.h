#pragma once

#include <boost/iostreams/copy.hpp>
#include <boost/iostreams/device/array.hpp>
#include <boost/iostreams/device/back_inserter.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#include <string>
#include <string_view>

#include "harness/io/packing.h"

namespace nullmark {

/// The data of a report's page, JSON, unpacked as page_boot.js does.
inline std::string data_of_page(std::string_view page) {
  namespace io = boost::iostreams;
  constexpr std::string_view kOpen = "<script type=\"text/plain\" id=\"data\">";
  const std::size_t begin = page.find(kOpen) + kOpen.size();
  const std::string bytes = from_base64(page.substr(begin, page.find("</script>", begin) - begin));
  std::string data;
  io::filtering_istream stream;
  stream.push(io::gzip_decompressor());
  stream.push(io::array_source(bytes.data(), bytes.size()));
  io::copy(stream, io::back_inserter(data));
  return data;
}

}  // namespace nullmark

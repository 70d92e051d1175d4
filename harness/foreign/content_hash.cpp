#include "harness/foreign/content_hash.h"

#include <fstream>
#include <iterator>

#include "harness/model/hash.h"

namespace nullmark {

std::uint64_t content_hash(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return 0;
  const std::string content{std::istreambuf_iterator<char>(file), {}};
  return fnv1a(content);
}

}  // namespace nullmark

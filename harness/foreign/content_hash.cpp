#include "harness/foreign/content_hash.h"

#include <fstream>
#include <vector>

#include "harness/model/hash.h"

namespace nullmark {

std::uint64_t content_hash(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return 0;
  std::uint64_t hash = fnv1a("");
  std::vector<char> part(std::size_t{1} << 16);
  while (file.read(part.data(), static_cast<std::streamsize>(part.size())) || file.gcount() > 0)
    hash = fnv1a({part.data(), static_cast<std::size_t>(file.gcount())}, hash);
  return hash;
}

}  // namespace nullmark

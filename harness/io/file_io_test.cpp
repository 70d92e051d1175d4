#include "harness/io/file_io.h"

#include <boost/iostreams/copy.hpp>
#include <boost/iostreams/filter/gzip.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#include <sstream>

#include "harness/io/json_input.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

std::string packed(const std::string& text) {
  std::istringstream plain(text);
  std::ostringstream result;
  boost::iostreams::filtering_istream stream;
  stream.push(boost::iostreams::gzip_compressor());
  stream.push(plain);
  boost::iostreams::copy(stream, result);
  return result.str();
}

class FileIo : public ProgramTest {};

TEST_F(FileIo, PackedFilesAreReadAsThePlainOnes) {
  std::string text;
  for (int i = 0; i < 1'000'000; ++i) text += static_cast<char>('a' + i % 7);
  write("a.gz", packed(text));
  EXPECT_EQ(read("a.gz"), text);
  write("empty.gz", packed(""));
  EXPECT_EQ(read("empty.gz"), "");
}

TEST_F(FileIo, DamagedPacksAreErrors) {
  const std::string whole = packed("results of some length, so that there is something to cut and to turn over");
  for (const std::size_t length : {std::size_t{2}, std::size_t{12}, whole.size() / 2, whole.size() - 1}) {
    write("cut.gz", whole.substr(0, length));
    EXPECT_THROW(read("cut.gz"), InputError) << length;
  }
  std::string turned = whole;
  turned[turned.size() / 2] ^= 1;
  write("turned.gz", turned);
  EXPECT_THROW(read("turned.gz"), InputError);
}

/// Devices that never end, and what is nothing but a loop of links.
TEST_F(FileIo, WhatIsNoFileIsToldInOneLine) {
  const auto error_of = [](const std::string& path) {
    try {
      read_file(path);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  EXPECT_EQ(error_of("/dev/zero"), "/dev/zero: does not end; expected a file");
  const std::string loop = (folder_ / "loop").string();
  std::filesystem::create_symlink("loop", loop);
  EXPECT_EQ(error_of(loop), loop + ": cannot be read: Too many levels of symbolic links; expected a file");
  try {
    expect_replaceable(loop);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), loop + ": cannot be written: Too many levels of symbolic links; give another path");
  }
}

TEST_F(FileIo, PacksThatGrowBeyondAllMemoryAreRefused) {
  write("bomb.gz", packed(std::string((std::size_t{1} << 30) + 1, ' ')));
  EXPECT_THROW(read("bomb.gz"), InputError);
}

}  // namespace
}  // namespace nullmark

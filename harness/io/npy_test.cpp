// Headers of .npy files are hostile: what is not exactly as it should be is refused in one line.

#include "harness/io/npy.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "harness/io/json_input.h"

namespace nullmark {
namespace {

class Npy : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = (std::filesystem::path(::testing::TempDir()) / fmt::format("npy_{}.npy", ::getpid())).string();
  }
  void TearDown() override { std::filesystem::remove(path_); }

  void write(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  /// A file of version 1 with this dictionary and so many bytes of numbers.
  void write(const std::string& dictionary, std::size_t bytes) const {
    std::string text = "\x93NUMPY";
    text += {'\x01', '\0', static_cast<char>(dictionary.size() & 0xff), static_cast<char>(dictionary.size() >> 8)};
    write(text + dictionary + std::string(bytes, '\0'));
  }

  std::string refusal() const {
    try {
      read_npy_header(path_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  void expect_refused(const char* words) const {
    const std::string why = refusal();
    EXPECT_NE(why.find(words), std::string::npos) << why;
    EXPECT_EQ(why.find('\n'), std::string::npos) << why;
    EXPECT_EQ(why.rfind(path_, 0), 0u) << why;
  }

  std::string path_;
};

TEST_F(Npy, WhatIsWrittenIsRead) {
  std::vector<Real> numbers;
  for (int i = 0; i < 200'000; ++i) numbers.push_back(i / 7.);
  write(npy_text({100, 2000}, numbers));
  const NpyHeader header = read_npy_header(path_);
  EXPECT_EQ(header.shape, (std::vector<std::uint64_t>{100, 2000}));
  EXPECT_EQ(header.begin % 64, 0u);
  std::vector<Real> again;
  read_npy(path_, header, [&](std::uint64_t first, std::span<const Real> some) {
    EXPECT_EQ(first, again.size());
    again.insert(again.end(), some.begin(), some.end());
  });
  EXPECT_EQ(again, numbers);
}

TEST_F(Npy, SinglesAndOtherSpellingsAreRead) {
  write("{'shape': (3,), 'fortran_order':False,\"descr\": '<f4'}\n", 12);
  EXPECT_EQ(refusal(), "accepted");
  EXPECT_EQ(read_npy_header(path_).bytes_per_number, 4u);
  std::string text = "\x93NUMPY";
  const std::string dictionary = "{'descr': '<f8', 'fortran_order': False, 'shape': (), }";
  text += {'\x02', '\0', static_cast<char>(dictionary.size()), '\0', '\0', '\0'};
  write(text + dictionary + std::string(8, '\0'));
  EXPECT_EQ(refusal(), "accepted");
  EXPECT_EQ(read_npy_header(path_).numbers, 1u);
}

TEST_F(Npy, OtherFilesAreRefused) {
  expect_refused("no such file");
  std::filesystem::create_directory(path_);
  expect_refused("is no file");
  std::filesystem::remove(path_);
  for (const char* text : {"", "\x93NUMPY", "P6 2 2 255", "{\"type\":\"samples\"}, and more of it"}) {
    write(text);
    expect_refused("is no .npy file");
  }
  write(std::string("\x93NUMPY\x03\0\0\0\0\0\0\0", 14));
  expect_refused("version 3");
}

TEST_F(Npy, HeadersThatLieAreRefused) {
  const auto shaped = [](const std::string& shape) {
    return "{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + ", }";
  };
  write(shaped("(2, 3)"), 47);
  expect_refused("cut short");
  write(shaped("(2, 3)"), 49);
  expect_refused("longer than its shape");
  write(shaped("(4294967296, 4294967296)"), 0);
  expect_refused("no file is that large");
  write(shaped("(99999999999999999999,)"), 0);
  expect_refused("is no dictionary");
  write(shaped("(-1, 3)"), 24);
  expect_refused("is no dictionary");
  write(shaped("(1, 1, 1, 1, 1, 1, 1, 1, 1)"), 8);
  expect_refused("is no dictionary");
  write("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }", 48);
  expect_refused("Fortran");
  for (const char* type : {"'>f8'", "'|O'", "'<i8'", "'<f2'", "'\x01\n'"}) {
    write(fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': (1,), }}", type), 8);
    expect_refused("expected '<f4' or '<f8'");
  }
  write("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,), }", 8);
  expect_refused("fields");
  for (const char* broken : {"", "{", "{'descr'", "{'descr': '<f8'", "{'descr': '<f8', }", "{'descr': '<f8', 'descr': '<f8', }",
                             "{'descr': '<f8', 'fortran_order': 0, 'shape': (1,), }",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), 'more': 1}",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1,)} __import__('os')"}) {
    write(broken, 8);
    expect_refused("is no dictionary");
  }
  write(std::string("\x93NUMPY\x01\0\xff\xff", 10) + "{}");
  expect_refused("its header has");
}

}  // namespace
}  // namespace nullmark

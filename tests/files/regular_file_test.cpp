// SPDX-License-Identifier: MIT
// Reading of files that options name.
#include "server/files/regular_file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/e2e/temporary_directory.h"

namespace clothstream::files {
namespace {

using testing::HasSubstr;

class RegularFile : public testing::Test {
 protected:
  std::string in(const std::string& name) const { return directory_.path() / name; }
  std::string file(const std::string& name, const std::string& content) const {
    std::ofstream(in(name), std::ios::binary) << content;
    return in(name);
  }
  static std::string errorOf(const std::string& path, std::uint64_t most = 10) {
    const auto content = readRegularFile(path, most);
    return content ? "read" : content.error().text;
  }

  e2e::TemporaryDirectory directory_;
};

TEST_F(RegularFile, IsReadUpToItsLimit) {
  for (const std::size_t size : {0, 1, 10})
    EXPECT_EQ(readRegularFile(file("small", std::string(size, 'x')), 10).value(), std::string(size, 'x'));
  EXPECT_THAT(errorOf(file("large", std::string(11, 'x'))), HasSubstr("at most 10 bytes"));
  EXPECT_TRUE(readRegularFile(in("large"), 10).error().isTooLarge);
  EXPECT_FALSE(readRegularFile(in("none"), 10).error().isTooLarge);
  const std::string pieces(300'000, 'y');
  EXPECT_EQ(readRegularFile(file("pieces", pieces), pieces.size()).value(), pieces);
}

TEST_F(RegularFile, MayBeReachedByASymbolicLink) {
  std::filesystem::create_symlink(file("target", "x"), in("link"));
  EXPECT_EQ(readRegularFile(in("link"), 10).value(), "x");
}

// Each of these would block, end never, or make no sense.
TEST_F(RegularFile, NothingElseIsRead) {
  EXPECT_THAT(errorOf(in("none")), HasSubstr("No such file"));
  EXPECT_THAT(errorOf(directory_.path()), HasSubstr("not a regular file"));
  ASSERT_EQ(::mkfifo(in("fifo").c_str(), S_IRUSR | S_IWUSR), 0);
  EXPECT_THAT(errorOf(in("fifo")), HasSubstr("not a regular file"));
  std::filesystem::create_symlink(in("fifo"), in("link"));
  EXPECT_THAT(errorOf(in("link")), HasSubstr("not a regular file"));
  for (const char* device : {"/dev/zero", "/dev/null", "/dev/tty"})
    EXPECT_NE(errorOf(device), "read") << device;
}

TEST_F(RegularFile, AFifoIsReadToItsEndWhereOneIsAllowed) {
  ASSERT_EQ(::mkfifo(in("fifo").c_str(), S_IRUSR | S_IWUSR), 0);
  for (const std::uint64_t most : {7, 3}) {
    const std::jthread writer([&] { std::ofstream(in("fifo")) << "content"; });
    const auto content = readFileOrFifo(in("fifo"), most);
    if (most == 7)
      EXPECT_EQ(content.value_or(""), "content");
    else
      EXPECT_TRUE(!content && content.error().isTooLarge);
  }
  EXPECT_EQ(readFileOrFifo(file("regular", "x"), 10).value_or(""), "x");
  EXPECT_FALSE(readFileOrFifo(directory_.path(), 10));
  EXPECT_FALSE(readFileOrFifo("/dev/zero", 10));
}

}  // namespace
}  // namespace clothstream::files

// SPDX-License-Identifier: MIT
// NewFile: the file exists completely or not at all.
#include "clients/files/new_file.h"

#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/e2e/temporary_directory.h"

namespace clothstream::files {
namespace {

using ::testing::HasSubstr;

std::string contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::ptrdiff_t filesIn(const std::filesystem::path& directory) {
  return std::distance(std::filesystem::directory_iterator(directory), {});
}

TEST(NewFile, ReplacesOldFileOnlyWhenFinished) {
  const e2e::TemporaryDirectory directory;
  const auto path = directory.path() / "file";
  std::ofstream(path) << "old";
  {
    auto file = NewFile::create(path);
    ASSERT_TRUE(file) << file.error();
    ASSERT_TRUE(file->write("new"));
    EXPECT_EQ(contentOf(path), "old");
    ASSERT_TRUE(file->finish());
    EXPECT_EQ(file->bytes(), 3u);
  }
  EXPECT_EQ(contentOf(path), "new");
  EXPECT_EQ(filesIn(directory.path()), 1);
}

TEST(NewFile, LeavesNoFileUnlessFinished) {
  const e2e::TemporaryDirectory directory;
  {
    auto file = NewFile::create(directory.path() / "file");
    ASSERT_TRUE(file) << file.error();
    NewFile moved = std::move(*file);
    ASSERT_TRUE(moved.write("new"));
    EXPECT_EQ(filesIn(directory.path()), 1);
  }
  EXPECT_EQ(filesIn(directory.path()), 0);
}

TEST(NewFile, DoesNotReplaceDirectoryOrDevice) {
  const e2e::TemporaryDirectory directory;
  for (const std::string& path : {directory.path().string(), std::string("/dev/null"),
                                  (directory.path() / "missing" / "file").string()}) {
    const auto file = NewFile::create(path);
    ASSERT_FALSE(file);
    EXPECT_THAT(file.error(), HasSubstr("cannot write " + path + ": "));
  }
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace clothstream::files

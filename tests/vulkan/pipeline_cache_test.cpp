// SPDX-License-Identifier: MIT
// The pipeline cache on disk: written, used again, and replaced if it is invalid.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "kernels/count_up.h"
#include "server/vulkan/kernel.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::vulkan {
namespace {

// File: magic (8 bytes), size and FNV-1a of the rest (8 bytes each), then Vulkan's header, whose UUID is
// at 16.
constexpr std::size_t kFileHeaderBytes = 24;
constexpr std::size_t kUuidOffset = kFileHeaderBytes + 16;

class PipelineCacheTest : public tests::GpuTest {
 protected:
  void SetUp() override {
    tests::GpuTest::SetUp();
    std::filesystem::remove_all(directory_.parent_path());
  }
  void TearDown() override { std::filesystem::remove_all(directory_.parent_path()); }

  // Opens a device with the cache, creates a kernel and closes the device. Returns the number of bytes that
  // the device took from the cache.
  std::size_t useCache() const {
    const Device device({.cacheDirectory = directory_});
    const Kernel kernel(device, kernels::count_up, 64);
    return device.pipelineCacheLoaded();
  }

  std::filesystem::path onlyFile() const {
    const std::vector<std::filesystem::directory_entry> entries{
        std::filesystem::directory_iterator(directory_), {}};
    EXPECT_EQ(entries.size(), 1u);
    return entries.empty() ? std::filesystem::path() : entries.front().path();
  }

  std::vector<char> read() const {
    std::ifstream file(onlyFile(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  void write(std::span<const char> bytes) const {
    std::ofstream(onlyFile(), std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  // The file is ignored, and valid again afterwards.
  void expectReplaced() const {
    EXPECT_EQ(useCache(), 0u);
    EXPECT_GT(useCache(), 0u);
  }

  const std::filesystem::path directory_ = std::filesystem::path(::testing::TempDir()) /
                                           ("clothstream_cache_" + std::to_string(getpid())) /
                                           "made if missing";
};

TEST_F(PipelineCacheTest, IsWrittenAndUsedAgain) {
  EXPECT_EQ(useCache(), 0u);
  const std::size_t kept = read().size();
  EXPECT_EQ(useCache(), kept - kFileHeaderBytes);
}

TEST_F(PipelineCacheTest, IsReplacedWhenDamaged) {
  useCache();
  const std::vector<char> good = read();
  for (std::size_t i = 0; i < good.size(); i += std::max<std::size_t>(good.size() / 8, 1)) {
    std::vector<char> damaged = good;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    write(damaged);
    expectReplaced();
  }
  for (const std::size_t length : {std::size_t{0}, std::size_t{5}, kFileHeaderBytes, good.size() - 1}) {
    write(std::span(good).first(length));
    expectReplaced();
  }
}

TEST_F(PipelineCacheTest, IsReplacedIfFromAnotherDriver) {
  useCache();
  std::vector<char> foreign = read();
  foreign[kUuidOffset] = static_cast<char>(foreign[kUuidOffset] ^ 1);
  std::uint64_t checksum = 0xcbf29ce484222325u;
  for (std::size_t i = kFileHeaderBytes; i < foreign.size(); ++i)
    checksum = (checksum ^ static_cast<std::uint8_t>(foreign[i])) * 0x100000001b3u;
  std::memcpy(foreign.data() + 16, &checksum, sizeof(checksum));
  write(foreign);
  expectReplaced();
}

TEST_F(PipelineCacheTest, IsOptionalIfItCannotBeWritten) {
  std::filesystem::create_directories(directory_.parent_path());
  std::ofstream(directory_) << "a file where the directory should be";
  EXPECT_EQ(useCache(), 0u);
  EXPECT_EQ(useCache(), 0u);
}

}  // namespace
}  // namespace clothstream::vulkan

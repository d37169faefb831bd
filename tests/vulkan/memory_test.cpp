// SPDX-License-Identifier: MIT
// Memory of buffers: shared by many without overlap, freed, refused where it ends. Descriptor sets likewise.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "kernels/count_up.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/handles.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::vulkan {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

using MemoryTest = tests::GpuTest;

constexpr std::size_t kMebibyte = std::size_t{1} << 20;
constexpr std::array kPurposes{BufferPurpose::state, BufferPurpose::texels, BufferPurpose::upload,
                               BufferPurpose::readback, BufferPurpose::indirect};
// Memory types that these purposes need at most.
constexpr std::uint32_t kMostTypes = 3;

// Buffers of 16 bytes to 4 KiB with all purposes.
std::vector<Buffer> smallBuffers(const Device& device, std::size_t count) {
  std::vector<Buffer> buffers;
  for (std::size_t i = 0; i < count; ++i)
    buffers.emplace_back(device, kPurposes[i % kPurposes.size()], 16 * (1 + i * 37 % 256));
  return buffers;
}

TEST_F(MemoryTest, ManyBuffersShareFewAllocations) {
  const Device device;
  const std::vector<Buffer> buffers = smallBuffers(device, 5000);
  std::uint64_t bytes = 0;
  for (const Buffer& buffer : buffers) bytes += buffer.bytes();
  EXPECT_GE(device.allocatedBytes(), bytes);
  EXPECT_GE(device.reservedBytes(), device.allocatedBytes());
  EXPECT_LE(device.allocations(), 3 * kMostTypes);
}

TEST_F(MemoryTest, BlocksDoubleTheMemory) {
  const Device device;
  std::vector<Buffer> buffers;
  for (int i = 0; i < 8; ++i) buffers.emplace_back(device, BufferPurpose::state, 7 * kMebibyte / 2);
  EXPECT_EQ(device.allocations(), 4u) << "4, 4, 8 and 16 MiB";
  EXPECT_EQ(device.reservedBytes(), 32 * kMebibyte);
}

TEST_F(MemoryTest, ALargeBufferHasItsOwnAllocation) {
  const Device device({.largestBlock = kMebibyte});
  const Buffer small(device, BufferPurpose::state, 16);
  EXPECT_EQ(device.reservedBytes(), kMebibyte);
  std::optional<Buffer> large(std::in_place, device, BufferPurpose::state, 3 * kMebibyte);
  EXPECT_EQ(device.allocations(), 2u);
  const Buffer other(device, BufferPurpose::state, 16);
  EXPECT_EQ(device.allocations(), 2u);
  large.reset();
  EXPECT_EQ(device.reservedBytes(), kMebibyte);
}

TEST_F(MemoryTest, MemoryComesBack) {
  const Device device;
  std::vector<Buffer> buffers = smallBuffers(device, 2000);
  buffers.emplace_back(device, BufferPurpose::state, 20 * kMebibyte);
  buffers.clear();
  EXPECT_EQ(device.allocatedBytes(), 0u);
  EXPECT_LE(device.allocations(), kMostTypes) << "one for each type stays";
  EXPECT_EQ(device.reservedBytes(), device.allocations() * 4 * kMebibyte);
  const std::uint32_t kept = device.allocations();
  buffers = smallBuffers(device, 100);
  EXPECT_EQ(device.allocations(), kept);
}

std::string runtimeErrorOf(const Device& device, std::size_t bytes) {
  try {
    const Buffer buffer(device, BufferPurpose::state, bytes);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST_F(MemoryTest, RefusesABlockBeyondTheLimit) {
  const Device few({.maxAllocations = 1});
  const Buffer first(few, BufferPurpose::state, 3 * kMebibyte);
  const std::uint64_t before = few.allocatedBytes();
  EXPECT_THAT(runtimeErrorOf(few, 3 * kMebibyte), HasSubstr("no room in the 1 allocations of memory"));
  EXPECT_EQ(few.allocations(), 1u);
  EXPECT_EQ(few.allocatedBytes(), before);
  EXPECT_EQ(runtimeErrorOf(few, kMebibyte / 2), "") << "the block has room";
}

TEST_F(MemoryTest, EmptyBlocksMakeRoom) {
  const Device few({.maxAllocations = 1});
  { const Buffer small(few, BufferPurpose::state, 16); }
  EXPECT_EQ(few.allocations(), 1u);
  const Buffer large(few, BufferPurpose::state, 5 * kMebibyte);
  EXPECT_EQ(few.allocations(), 1u);
}

// Buffers that the CPU writes, made and destroyed at random, each filled with another byte than most others.
void makeAndDestroy(Device& device, std::uint8_t firstByte, unsigned seed) {
  struct Filled {
    Buffer buffer;
    std::byte content;
  };
  constexpr std::size_t kMost = 100;
  std::mt19937 random(seed);
  std::vector<Filled> live;
  const auto expectContent = [](const Filled& filled) {
    const std::span<const std::byte> bytes = filled.buffer.mapped();
    EXPECT_TRUE(std::ranges::all_of(bytes, [&](std::byte byte) { return byte == filled.content; }));
  };
  for (std::uint32_t step = 0; step < 600; ++step) {
    if (live.size() == kMost || (!live.empty() && random() % 3 == 0)) {
      std::swap(live[random() % live.size()], live.back());
      expectContent(live.back());
      live.pop_back();
      continue;
    }
    Filled made{Buffer(device, BufferPurpose::upload, 1 + random() % 2000),
                static_cast<std::byte>(firstByte + step % kMost)};
    std::ranges::fill(made.buffer.mapped(), made.content);
    live.push_back(std::move(made));
  }
  for (const Filled& filled : live) expectContent(filled);
}

TEST_F(MemoryTest, BuffersOfTheCpuDoNotOverlap) {
  std::thread other([] { makeAndDestroy(tests::device(), 100, 2); });
  makeAndDestroy(tests::device(), 0, 1);
  other.join();
}

TEST_F(MemoryTest, BuffersOfTheDeviceDoNotOverlap) {
  constexpr std::uint32_t kCount = 60, kWords = 70;
  std::vector<Buffer> buffers;
  for (std::uint32_t i = 0; i < kCount; ++i)
    buffers.emplace_back(tests::device(), i % 2 == 0 ? BufferPurpose::state : BufferPurpose::texels,
                         16 * (1 + i % 17));
  // Others take the places of every third one.
  for (std::uint32_t i = 0; i < kCount; i += 3) buffers[i] = Buffer();
  for (std::uint32_t i = 0; i < kCount; i += 3)
    buffers[i] = Buffer(tests::device(), BufferPurpose::indirect, 4 * kWords);
  const Buffer readback(tests::device(), BufferPurpose::readback, kCount * 4 * kWords);
  tests::run([&](Recorder& recorder) {
    for (std::uint32_t i = 0; i < kCount; ++i) recorder.fill(buffers[i], i, buffers[i].bytes());
    recorder.barrier();
    for (std::uint32_t i = 0; i < kCount; ++i)
      recorder.copy(buffers[i], readback, buffers[i].bytes(), 0, std::size_t{i} * 4 * kWords);
  });
  for (std::uint32_t i = 0; i < kCount; ++i)
    EXPECT_THAT(readback.mapped<std::uint32_t>().subspan(i * kWords, buffers[i].bytes() / 4), Each(i));
}

TEST_F(MemoryTest, BuffersHaveDistinctAddresses) {
  const Device& device = tests::device();
  if (device.isSoftware()) {
    EXPECT_TRUE(device.hasAddresses());
  }
  const std::vector<Buffer> buffers = smallBuffers(device, 100);
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  for (const Buffer& buffer : buffers) {
    const std::uint64_t address = buffer.handles().address;
    ASSERT_EQ(address != 0, device.hasAddresses());
    EXPECT_EQ(address % 16, 0u);
    ranges.emplace_back(address, address + buffer.bytes());
  }
  if (!device.hasAddresses()) return;
  std::ranges::sort(ranges);
  for (std::size_t i = 1; i < ranges.size(); ++i) EXPECT_LE(ranges[i - 1].second, ranges[i].first);
}

TEST_F(MemoryTest, BindingsShareFewPools) {
  const Device device;
  const Kernel kernel(device, kernels::count_up, 64);
  const Buffer buffer(device, BufferPurpose::state, 256);
  const auto bind = [&](std::size_t count) {
    std::vector<Bindings> bindings;
    for (std::size_t i = 0; i < count; ++i)
      bindings.emplace_back(device, kernel, std::initializer_list<const Buffer*>{&buffer, &buffer});
    return bindings;
  };
  const auto pools = [&] { return device.handles().descriptorPools->count(); };
  std::vector<Bindings> bindings = bind(64);
  EXPECT_EQ(pools(), 1u);
  const std::vector<Bindings> more = bind(130);
  EXPECT_EQ(pools(), 3u) << "64, 128 and 256 sets";
  bindings.clear();
  bindings = bind(300);
  EXPECT_EQ(pools(), 3u) << "sets that were freed are used again";
}

}  // namespace
}  // namespace clothstream::vulkan

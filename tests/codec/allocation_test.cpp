// SPDX-License-Identifier: MIT
// Counts every allocation of the program. The linker redirects malloc, calloc and realloc to these functions
// (--wrap).
#include <atomic>
#include <cstdlib>
#include <new>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/motion.h"

namespace {
std::atomic<std::size_t> allocations = 0;
}

extern "C" {
void* __real_malloc(std::size_t);
void* __real_calloc(std::size_t, std::size_t);
void* __real_realloc(void*, std::size_t);
void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* memory, std::size_t size) {
  ++allocations;
  return __real_realloc(memory, size);
}
}

void* operator new(std::size_t size) {
  void* memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace clothstream::codec {
namespace {

void expectAllocationOnlyAtConstruction(const StreamLayout& layout, const EncoderOptions& options = {}) {
  const std::vector<MotionFrame> frames{sampleMotion(layout, 1, 0.1f), sampleMotion(layout, 2, 0.1f),
                                        scatter(layout, 1, 30.0f), sampleMotion(layout, 3, 0.1f)};
  const std::size_t before = allocations;
  const auto encoder = Encoder::make(layout, options);
  const auto decoder = Decoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  ASSERT_GT(allocations, before + 10);  // shows that allocations are counted

  const std::size_t constructed = allocations;
  bool decoded = true;
  float sum = 0;
  for (std::uint64_t tick = 1; tick <= 40; ++tick) {
    const MotionFrame& frame = frames[tick % frames.size()];
    const PacketKind kind = tick % 10 == 0 ? PacketKind::key : PacketKind::predicted;
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, frame.normals, packet);
    decoded = decoded && decoder->decode(std::span(packet).first(bytes)) == DecodeResult::ok;
    sum += decoder->normals()[0];
  }
  EXPECT_EQ(allocations, constructed);
  EXPECT_TRUE(decoded);
  EXPECT_NE(sum, 0.0f);
}

TEST(Allocation, HappensOnlyAtConstruction) {
  expectAllocationOnlyAtConstruction(mixedLayout(NormalMode::none));
}

TEST(Allocation, HappensOnlyAtConstructionWithNormals) {
  expectAllocationOnlyAtConstruction(mixedLayout(NormalMode::octahedral));
}

TEST(Allocation, HappensOnlyAtConstructionWithAWeightLag) {
  expectAllocationOnlyAtConstruction(mixedLayout(NormalMode::none), {.weightLag = 3});
}

}  // namespace
}  // namespace clothstream::codec

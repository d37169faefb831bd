// SPDX-License-Identifier: MIT
// Limit of WebSocket frames.
#include "server/endpoint/web/frame_meter.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <gtest/gtest.h>

namespace clothstream::endpoint {
namespace {

using namespace std::chrono_literals;
using schedule::Clock;

constexpr int kMost = static_cast<int>(FrameMeter::kSmallFramesAtOnce);

// A masked frame; first byte 0x80 | opcode with FIN, opcode without it.
std::string frame(int first, std::size_t payload) {
  std::string bytes(1, static_cast<char>(first));
  const auto add = [&](std::uint64_t number, int size) {
    while (size-- > 0) bytes += static_cast<char>(number >> 8 * size & 0xff);
  };
  const std::size_t lengthBytes = payload < 126 ? 0 : payload < 0x10000 ? 2 : 8;
  add(0x80 | (lengthBytes == 0 ? payload : lengthBytes == 2 ? 126 : 127), 1);
  add(payload, static_cast<int>(lengthBytes));
  // Payload that looks like headers of empty frames.
  return bytes + "mask" + std::string(payload, '\x80');
}

bool add(FrameMeter& meter, const std::string& bytes, Clock::time_point now = {}) {
  return meter.add(std::as_bytes(std::span(bytes)), now);
}

TEST(FrameMeter, CountsEveryKindOfSmallFrame) {
  for (const int first : {0x82, 0x00, 0x02, 0x89, 0x8A, 0x88})
    for (const std::size_t payload : {0, 1, 125, 126, 1023}) {
      FrameMeter meter;
      for (int i = 0; i < kMost; ++i) ASSERT_TRUE(add(meter, frame(first, payload))) << i;
      EXPECT_FALSE(add(meter, frame(first, payload))) << first << " " << payload;
      EXPECT_TRUE(meter.exceeded());
    }
}

TEST(FrameMeter, CountsHeadersInPieces) {
  FrameMeter meter;
  std::string bytes;
  for (int i = 0; i < kMost / 4; ++i)
    bytes += frame(0x8A, 0) + frame(0x02, 130) + frame(0x82, i == 0 ? 70'000 : 2'000) + frame(0x89, 5) +
             frame(0x00, 0);
  for (std::size_t at = 0, piece = 1; at < bytes.size(); at += piece, piece = piece % 4097 + 1)
    ASSERT_TRUE(add(meter, bytes.substr(at, piece))) << at;
  EXPECT_FALSE(add(meter, frame(0x8A, 0)));
}

TEST(FrameMeter, LargeFramesAreFree) {
  FrameMeter meter;
  const std::string large = frame(0x82, FrameMeter::kSmallBytes);
  for (int i = 0; i < 2 * kMost; ++i) ASSERT_TRUE(add(meter, large));
}

TEST(FrameMeter, AllowsItsRateForEver) {
  FrameMeter meter;
  Clock::time_point now = Clock::time_point(1h);
  for (int second = 0; second < 10; ++second, now += 1s)
    for (int i = 0; i < static_cast<int>(FrameMeter::kSmallFramesPerSecond); ++i)
      ASSERT_TRUE(add(meter, frame(0x89, 0), now)) << second;
}

TEST(FrameMeter, TakesAnyLength) {
  FrameMeter meter;
  EXPECT_TRUE(add(meter, std::string("\x82\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFFmask", 14)));
  EXPECT_TRUE(add(meter, std::string(1'000'000, '\x80')));
}

}  // namespace
}  // namespace clothstream::endpoint

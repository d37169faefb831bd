// SPDX-License-Identifier: MIT
#include "server/endpoint/web/frame_meter.h"

#include <algorithm>

namespace clothstream::endpoint {
namespace {

// Second byte of a header: whether a mask follows, and the length or the number of its bytes.
constexpr std::uint8_t kMasked = 0x80, kLength = 0x7F, kTwoBytes = 126, kEightBytes = 127;
constexpr std::size_t kFirstBytes = 2, kMaskBytes = 4;

std::size_t lengthBytes(std::uint8_t length) {
  return length == kEightBytes ? 8 : length == kTwoBytes ? 2 : 0;
}

}  // namespace

std::size_t FrameMeter::headerBytes() const {
  if (headerRead_ < kFirstBytes) return kFirstBytes;
  return kFirstBytes + lengthBytes(header_[1] & kLength) + ((header_[1] & kMasked) != 0 ? kMaskBytes : 0);
}

std::uint64_t FrameMeter::payloadBytes() const {
  const std::uint8_t length = header_[1] & kLength;
  const std::size_t bytes = lengthBytes(length);
  if (bytes == 0) return length;
  std::uint64_t payload = 0;
  for (std::size_t i = 0; i < bytes; ++i) payload = payload << 8 | header_[kFirstBytes + i];
  return payload;
}

bool FrameMeter::add(std::span<const std::byte> bytes, schedule::Clock::time_point now) {
  while (!bytes.empty() && !exceeded_) {
    if (payloadLeft_ > 0) {
      const auto skipped = static_cast<std::size_t>(std::min<std::uint64_t>(payloadLeft_, bytes.size()));
      payloadLeft_ -= skipped;
      bytes = bytes.subspan(skipped);
      continue;
    }
    header_[headerRead_++] = std::to_integer<std::uint8_t>(bytes.front());
    bytes = bytes.subspan(1);
    if (headerRead_ < headerBytes()) continue;
    payloadLeft_ = payloadBytes();
    headerRead_ = 0;
    if (payloadLeft_ < kSmallBytes) exceeded_ = !frames_.take(now);
  }
  return !exceeded_;
}

}  // namespace clothstream::endpoint

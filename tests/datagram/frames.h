// SPDX-License-Identifier: MIT
// Frames with known bytes, and their datagrams.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "proto/datagram/frame_pieces.h"

namespace clothstream::datagram {

using Bytes = std::vector<std::byte>;

inline constexpr std::uint64_t kMs = 1'000;  // us

// Bytes that differ between frames and between places.
inline Bytes testMessage(std::size_t bytes, std::uint32_t frame = 0) {
  Bytes message(bytes);
  std::uint32_t state = frame;
  for (std::byte& byte : message) {
    state = state * 1'664'525 + 1'013'904'223;
    byte = static_cast<std::byte>(state >> 24);
  }
  return message;
}

inline std::shared_ptr<const FramePieces> testFrame(std::size_t bytes, unsigned parity,
                                                    std::uint32_t frame = 0) {
  return std::make_shared<const FramePieces>(std::make_shared<const Bytes>(testMessage(bytes, frame)),
                                             parity);
}

inline Bytes datagramOf(const FramePieces& frame, const PiecePrefix& prefix, unsigned index) {
  std::array<std::byte, kMaxDatagramBytes> out;
  const std::size_t bytes = frame.write(prefix, index, out);
  return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(bytes)};
}

inline bool equal(std::span<const std::byte> a, std::span<const std::byte> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace clothstream::datagram

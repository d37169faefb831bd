// SPDX-License-Identifier: MIT
// Datagram that asks for the missing pieces of a frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/datagram/datagram.h"

namespace clothstream::datagram {

struct PieceRequest {
  std::uint32_t frame = 0;
  // Pieces that have arrived; empty if the whole frame is missing.
  PieceSet present;
};

// Writes the datagram to `out`, which has at least kMaxDatagramBytes, and returns its length.
std::size_t writeRequest(const PieceRequest& request, std::span<std::byte> out);

// nullopt if the datagram has another kind, more bytes of the mask than 160 pieces need, or a last one that
// is 0.
[[nodiscard]] std::optional<PieceRequest> parseRequest(std::span<const std::byte> datagram);

}  // namespace clothstream::datagram

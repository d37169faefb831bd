// SPDX-License-Identifier: MIT
// What a client accepts from a server, so that a hostile one cannot use up its memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "clients/core/core.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::client {

// Ranges and defaults are those of cs_limits.
struct Limits {
  std::uint32_t vertices = codec::kDefaultMaxVertices, triangles = 2 * codec::kDefaultMaxVertices,
                cloths = codec::kMaxClothRanges, participants = 4096;
  std::uint64_t contentBytes = kMostContentBytes;

  static constexpr std::uint64_t kMostContentBytes = std::uint64_t{256} << 20;
  static constexpr std::uint32_t kMostTriangles = 2 * codec::kMaxVertices, kMostParticipants = 65'536;

  // Nothing if the version or a number is not allowed.
  static std::optional<Limits> from(const cs_limits& limits) {
    const auto isIn = [](std::uint64_t number, std::uint64_t most) { return number >= 1 && number <= most; };
    if (limits.version != CS_LIMITS_VERSION || !isIn(limits.max_vertices, codec::kMaxVertices) ||
        !isIn(limits.max_triangles, kMostTriangles) || !isIn(limits.max_cloths, codec::kMaxClothRanges) ||
        !isIn(limits.max_participants, kMostParticipants) ||
        !isIn(limits.max_content_bytes, kMostContentBytes))
      return std::nullopt;
    return Limits{.vertices = limits.max_vertices,
                  .triangles = limits.max_triangles,
                  .cloths = limits.max_cloths,
                  .participants = limits.max_participants,
                  .contentBytes = limits.max_content_bytes};
  }
  cs_limits toC() const {
    return {.version = CS_LIMITS_VERSION,
            .max_vertices = vertices,
            .max_triangles = triangles,
            .max_cloths = cloths,
            .max_participants = participants,
            .max_content_bytes = contentBytes};
  }
};

// Bytes of a participant's names. Servers of this project send at most 64.
inline constexpr std::size_t kMaxNameBytes = 1024;
inline constexpr std::size_t kMaxResumeTokenBytes = 64;

}  // namespace clothstream::client

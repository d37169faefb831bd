// SPDX-License-Identifier: MIT
// Residuals as planes of bytes: what is entropy-coded.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/codec/lattice/prediction.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

inline constexpr std::size_t kPositionChannels = 3;
inline constexpr std::size_t kNormalChannels = 2;
inline constexpr std::size_t kMaxPlanes = 4;

// The bytes of one plane of each sort: all x, all y, all z; all u, all v.
constexpr std::size_t positionPlaneBytes(std::size_t vertices) {
  return kPositionChannels * vertices;
}
constexpr std::size_t normalPlaneBytes(std::size_t vertices) {
  return kNormalChannels * vertices;
}

// Planes that the largest of the zigzag residuals needs; `bits` is all of them or-ed. 0 where all are zero.
constexpr std::size_t planeCount(std::uint32_t bits) {
  std::size_t planes = 0;
  for (; bits != 0; bits >>= 8) ++planes;
  return planes;
}

// One frame between prediction and entropy coding. Plane p holds bits 8p to 8p + 7 of the zigzag residuals of
// x, then of y, then of z; the normal plane holds the zigzag residuals of u, then of v, modulo 256.
struct FrameResiduals {
  PacketKind kind = PacketKind::key;
  std::uint64_t tick = 0;
  std::uint64_t referenceTick = 0;  // of a predicted frame
  Prediction positionPrediction = Prediction::planar;
  Prediction normalPrediction = Prediction::planar;
  std::size_t planeCount = 0;
  std::array<std::span<const std::byte>, kMaxPlanes> planes;  // the first planeCount of them
  std::span<const std::byte> normalPlane;                     // empty where the layout has no normals
};

// Splits `count` residuals into the planes from `offset` on; returns the bits that their zigzag forms use.
std::uint32_t splitPlanes(const std::int32_t* residuals, std::size_t count,
                          const std::array<std::byte*, kMaxPlanes>& planes, std::size_t offset);
void splitPlane(const std::int8_t* residuals, std::size_t count, std::byte* plane);

// The inverse, from the first `planeCount` planes.
void mergePlanes(const std::array<const std::byte*, kMaxPlanes>& planes, std::size_t planeCount,
                 std::size_t offset, std::size_t count, std::int32_t* residuals);
void mergePlane(const std::byte* plane, std::size_t count, std::int8_t* residuals);

}  // namespace clothstream::codec

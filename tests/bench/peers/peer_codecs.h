// SPDX-License-Identifier: MIT
// Other libraries' codecs for the positions of a frame, at the same largest error.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace clothstream::bench {

// A stream of frames of one grid, coded and decoded again.
class PeerCodec {
 public:
  virtual ~PeerCodec() = default;
  virtual const char* name() const = 0;
  virtual std::vector<std::byte> encode(std::span<const float> positions) = 0;
  virtual void decode(std::span<const std::byte> packet, std::span<float> positions) = 0;
};

// step: distance of the lattice, m; it holds all positions from origin (3 floats) to origin + 2^bits steps.
struct PeerLattice {
  float origin[3];
  float step;
  int bits;
};

std::unique_ptr<PeerCodec> dracoMesh(std::uint32_t rows, std::uint32_t columns, const PeerLattice& lattice);
// Differences to the frame before, in vertex codec version 0, alone or with zstd behind it.
std::unique_ptr<PeerCodec> meshoptimizerDelta(std::uint32_t vertices, const PeerLattice& lattice, bool zstd);

}  // namespace clothstream::bench

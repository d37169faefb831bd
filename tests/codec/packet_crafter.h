// SPDX-License-Identifier: MIT
// Packets that follow the format but that no encoder chooses, for the corners of decoders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "proto/codec/frame_role.h"
#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// Predicted frames. They have weights of every size, and all residuals are 0. Coordinates may become too
// large: a decoder then refuses the packet.
class PacketCrafter {
 public:
  explicit PacketCrafter(const StreamLayout& layout);

  // The packet depends on the seed and on the weights that the kept packets left. Before the first kept
  // packet these are the weights after a key frame.
  std::vector<std::byte> craft(const FrameRole& role, std::uint32_t seed);
  // Keeps the weights of the last packet, which a decoder has taken.
  void keep() { kept_ = made_; }

  // Faults that make a packet wrong.
  enum class Fault : std::uint8_t { none, weightBeyondTheLimit, gammaNumberOf31Bits };
  // A packet with this fault only.
  std::vector<std::byte> craftWrong(const FrameRole& role, Fault fault);

 private:
  void writeWeights(hierarchical::BitWriter& out);
  std::uint32_t below(std::uint32_t bound) { return static_cast<std::uint32_t>(random_() % bound); }

  StreamLayout layout_;
  hierarchical::Hierarchy hierarchy_;
  hierarchical::Weights kept_, made_;
  std::mt19937 random_;
  Fault fault_ = Fault::none;
};

// The packet with another boundary between two of its sections, which a decoder refuses: the last bytes of a
// section become the first ones of the next section.
std::vector<std::byte> withBoundaryMoved(std::span<const std::byte> packet, std::size_t section,
                                         std::uint32_t bytes);

// A packet of a stream of one vertex, with a larger residual along the normal: its number beyond the symbols,
// which there must be, grows by `by`.
std::vector<std::byte> withNumberRaised(std::span<const std::byte> packet, std::uint32_t by);

}  // namespace clothstream::codec

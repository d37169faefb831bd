// SPDX-License-Identifier: MIT
// Packets of codec 2 without what the finest levels take.
#include "proto/codec/coarse_packet.h"

#include <array>
#include <cassert>
#include <cstring>
#include <optional>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/packet_header.h"

namespace clothstream::codec {
namespace {

// Of one range of cloths, kSections sections and kMaxReferences references: a varint takes ten bytes at most.
constexpr std::size_t kLargestHeader = 256;

}  // namespace

std::size_t makeCoarsePacket(std::span<const std::byte> packet, std::span<std::byte> out) {
  using namespace hierarchical;
  const std::optional<ParsedPacket> whole = parsePacket(packet);
  if (!whole || whole->header.codec != kCodecHierarchical) return 0;
  PacketHeader header = whole->header;
  if (header.sectionCount != kSections || header.rangeCount != 1) return 0;
  const std::size_t first =
      header.sectionBytes[kWeightChanges] + std::size_t{header.sectionBytes[kCoarseSymbols]};
  const std::byte* bits = whole->body.data() + first + header.sectionBytes[kFineSymbols];
  header.sectionBytes[kFineSymbols] = header.sectionBytes[kFineBits] = 0;
  // It is not longer than it was: nothing is written over that is still to be read.
  std::array<std::byte, kLargestHeader> small;
  assert(headerBound(header) <= small.size());
  const std::size_t headerBytes = writeHeader(header, small);
  std::memcpy(out.data(), small.data(), headerBytes);
  std::byte* to = out.data() + headerBytes;
  std::memmove(to, whole->body.data(), first);
  std::memmove(to + first, bits, header.sectionBytes[kCoarseBits]);
  return static_cast<std::size_t>(to - out.data()) + first + header.sectionBytes[kCoarseBits];
}

}  // namespace clothstream::codec

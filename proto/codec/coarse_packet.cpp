// SPDX-License-Identifier: MIT
// Packets of codec 2 without what the finest levels take.
#include "proto/codec/coarse_packet.h"

#include <cstring>
#include <optional>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/packet_header.h"

namespace clothstream::codec {

std::size_t makeCoarsePacket(std::span<const std::byte> packet, std::span<std::byte> out) {
  using namespace hierarchical;
  const std::optional<ParsedPacket> whole = parsePacket(packet);
  if (!whole || whole->header.codec != kCodecHierarchical || whole->header.sectionCount != kSections)
    return 0;
  PacketHeader header = whole->header;
  const std::size_t first =
      header.sectionBytes[kWeightChanges] + std::size_t{header.sectionBytes[kCoarseSymbols]};
  const std::byte* bits = whole->body.data() + first + header.sectionBytes[kFineSymbols];
  header.sectionBytes[kFineSymbols] = header.sectionBytes[kFineBits] = 0;
  // Not longer than it was: nothing is written over that is still to be read.
  std::byte* to = out.data() + writeHeader(header, out);
  std::memmove(to, whole->body.data(), first);
  std::memmove(to + first, bits, header.sectionBytes[kCoarseBits]);
  return static_cast<std::size_t>(to - out.data()) + first + header.sectionBytes[kCoarseBits];
}

}  // namespace clothstream::codec

// SPDX-License-Identifier: MIT
// Coarse packets: removes the data of the two finest levels.
#include "proto/codec/coarse_packet.h"

#include <array>
#include <cassert>
#include <cstring>
#include <optional>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/packet_header.h"

namespace clothstream::codec {
namespace {

// Header with one range of cloths, kSections sections and kMaxReferences references. A varint takes at most
// ten bytes.
constexpr std::size_t kLargestHeader = 256;

// Sections of a packet that hold data of fine vertices.
constexpr std::array<std::uint8_t, 2> kFineSections{hierarchical::kFineSymbols, hierarchical::kFineBits};

}  // namespace

std::size_t makeCoarsePacket(std::span<const std::byte> packet, std::span<std::byte> out) {
  const std::optional<ParsedPacket> whole = parsePacket(packet);
  if (!whole || whole->header.rangeCount != 1) return 0;
  if (!isCodec(whole->header.codec) || whole->header.sectionCount != hierarchical::kSections) return 0;
  PacketHeader header = whole->header;
  for (const std::uint8_t section : kFineSections) header.sectionBytes[section] = 0;
  // The coarse packet is no longer than the whole one, so nothing is overwritten before it is read.
  std::array<std::byte, kLargestHeader> small;
  assert(headerBound(header) <= small.size());
  const std::size_t headerBytes = writeHeader(header, small);
  std::memcpy(out.data(), small.data(), headerBytes);
  std::byte* to = out.data() + headerBytes;
  const std::byte* from = whole->body.data();
  for (std::size_t section = 0; section < header.sectionCount; ++section) {
    std::memmove(to, from, header.sectionBytes[section]);
    to += header.sectionBytes[section];
    from += whole->header.sectionBytes[section];
  }
  return static_cast<std::size_t>(to - out.data());
}

}  // namespace clothstream::codec

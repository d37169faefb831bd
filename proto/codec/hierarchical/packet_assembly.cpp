// SPDX-License-Identifier: MIT
// Assembles a packet from sections that are written in order.
#include "proto/codec/hierarchical/packet_assembly.h"

#include <algorithm>

namespace clothstream::codec::hierarchical {

PacketAssembly::PacketAssembly(const StreamLayout& layout) {
  header_.codec = layout.codec;
  header_.epoch = layout.epoch;
  header_.rangeCount = 1;
  header_.ranges[0] = {0, static_cast<std::uint32_t>(layout.cloths.size())};
}

std::size_t PacketAssembly::headerBound() const {
  PacketHeader largest = header_;
  largest.kind = PacketKind::predicted;
  largest.referenceCount = 1;
  largest.sectionCount = kMaxSections;
  return codec::headerBound(largest);
}

std::byte* PacketAssembly::begin(const FrameRole& role, std::span<std::byte> out) {
  header_.kind = role.kind;
  header_.quality = role.quality;
  header_.tick = role.tick;
  header_.referenceCount = role.kind == PacketKind::key ? 0 : 1;
  header_.references[0] = role.referenceTick;
  header_.sectionCount = 0;
  // The header's length depends on the sections' sizes. Sections are written after its bound and moved up at
  // the end.
  out_ = out;
  body_ = out.data() + headerBound();
  end_ = body_;
  return body_;
}

void PacketAssembly::endSection(const std::byte* end) {
  header_.sectionBytes[header_.sectionCount++] = static_cast<std::uint32_t>(end - end_);
  end_ = end;
}

std::size_t PacketAssembly::finish() {
  const std::size_t headerBytes = writeHeader(header_, out_);
  std::copy(static_cast<const std::byte*>(body_), end_, out_.data() + headerBytes);
  return headerBytes + static_cast<std::size_t>(end_ - body_);
}

}  // namespace clothstream::codec::hierarchical

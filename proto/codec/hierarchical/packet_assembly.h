// SPDX-License-Identifier: MIT
// Assembles a packet from sections that are written in order, and the header before them.
#pragma once

#include <cstddef>
#include <span>

#include "proto/codec/frame_role.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

// begin() returns the address of the first section. endSection() is called after each section, finish() after
// the last.
class PacketAssembly {
 public:
  explicit PacketAssembly(const StreamLayout& layout);

  // Bytes that begin() reserves for the header.
  std::size_t headerBound() const;

  std::byte* begin(const FrameRole& role, std::span<std::byte> out);
  void endSection(const std::byte* end);
  // Size of the packet, from the start of `out`.
  std::size_t finish();

 private:
  PacketHeader header_;
  std::span<std::byte> out_;
  std::byte* body_ = nullptr;
  const std::byte* end_ = nullptr;  // end of the last section
};

}  // namespace clothstream::codec::hierarchical

// SPDX-License-Identifier: MIT
// A packet of sections that are written one after the other, and the header before them.
#pragma once

#include <cstddef>
#include <span>

#include "proto/codec/frame_role.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

// begin(), then what the sections hold is written to where it says; endSection() after each of them, finish()
// after the last.
class PacketAssembly {
 public:
  explicit PacketAssembly(const StreamLayout& layout);

  // Bytes that begin() leaves for the header.
  std::size_t headerBound() const;

  std::byte* begin(const FrameRole& role, std::span<std::byte> out);
  void endSection(const std::byte* end);
  // Bytes of the packet, from the start of `out`.
  std::size_t finish();

 private:
  PacketHeader header_;
  std::span<std::byte> out_;
  std::byte* body_ = nullptr;
  const std::byte* end_ = nullptr;  // of the last section
};

}  // namespace clothstream::codec::hierarchical

// SPDX-License-Identifier: MIT
// Place of a frame in its stream: what the packet header says about the frame and its reference.
#pragma once

#include <cstdint>

#include "proto/codec/packet_header.h"

namespace clothstream::codec {

struct FrameRole {
  std::uint64_t tick = 0;
  PacketKind kind = PacketKind::key;
  std::uint64_t referenceTick = 0;  // of a predicted frame
  std::uint8_t quality = 0;         // of this frame and of its reference
};

}  // namespace clothstream::codec

// SPDX-License-Identifier: MIT
// The golden packets of tests/golden: bytes, and what every build of the decoder must make of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

struct GoldenPacket {
  std::string file;
  std::vector<std::byte> bytes;
  std::uint64_t tick = 0;
  PacketKind kind = PacketKind::key;
  std::uint64_t reconstructionHash = 0;
  std::uint64_t positionsHash = 0;  // hashFloats of the decoded positions
};

struct GoldenStream {
  std::string name;
  StreamLayout layout;
  std::vector<GoldenPacket> packets;  // in order; the first is a key frame
};

// Reads tests/golden/streams.json and the packets it names; the working directory is the project's root.
std::vector<GoldenStream> readGoldenStreams();
void writeGoldenStreams(const std::vector<GoldenStream>& streams);

// FNV-1a of 64 bits over the little-endian bytes of the floats.
std::uint64_t hashFloats(std::span<const float> values);

}  // namespace clothstream::codec

// SPDX-License-Identifier: MIT
// Golden packets of tests/golden: bytes, and the results that every build of every decoder must give.
#pragma once

#include <array>
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
  std::uint64_t positionsHash = 0;        // hashFloats() of the decoded positions, in metres
  std::uint64_t coarsePositionsHash = 0;  // the same for a decoder of coarse vertices and the coarse packet
};

// Decoded unit normal with coordinates rounded to multiples of 1 / kNormalSteps.
struct GoldenNormal {
  std::uint32_t vertex = 0;
  std::array<double, 3> xyz{};
};
inline constexpr double kNormalSteps = 1e6;

// A packet with one fault. A decoder that holds all packets of the stream refuses it and stays as it
// is.
struct GoldenRefusal {
  std::string file;
  std::vector<std::byte> bytes;
};

struct GoldenStream {
  std::string name;
  StreamLayout layout;
  std::vector<GoldenPacket> packets;  // in order of decoding; the first is a key frame
  std::vector<GoldenRefusal> refused = {};
  std::vector<GoldenNormal> normals;  // normals of some vertices after the last packet
};

// Reads tests/golden/streams.json and its packets. The working directory is the project's root.
std::vector<GoldenStream> readGoldenStreams();
void writeGoldenStreams(const std::vector<GoldenStream>& streams);

// Rounded normals of at most kGoldenNormals evenly spread vertices.
inline constexpr std::size_t kGoldenNormals = 6;
std::vector<GoldenNormal> sampleNormals(std::span<const float> normals);

// 64-bit FNV-1a of the floats' little-endian bytes.
std::uint64_t hashFloats(std::span<const float> values);

}  // namespace clothstream::codec

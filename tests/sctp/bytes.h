// SPDX-License-Identifier: MIT
// Bytes of packets in tests.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

#include "proto/sctp/chunks.h"

namespace clothstream::sctp {

using Bytes = std::vector<std::byte>;

inline Bytes bytesOf(std::initializer_list<unsigned> values) {
  Bytes bytes;
  for (const unsigned value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

inline std::span<const std::byte> bytesOf(std::string_view text) {
  return std::as_bytes(std::span(text));
}

inline Bytes join(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// A packet with one chunk.
inline Bytes packetOf(std::uint32_t tag, ChunkType type, std::uint8_t flags,
                      std::span<const std::byte> value) {
  PacketWriter writer;
  writer.start(tag);
  std::ranges::copy(value, writer.add(type, flags, value.size()).begin());
  const auto packet = writer.finish(false);
  return {packet.begin(), packet.end()};
}

inline Bytes packetOf(std::uint32_t tag, const Data& data) {
  Bytes value(dataBytes(data));
  writeData(value, data);
  return packetOf(tag, ChunkType::data, dataFlags(data), value);
}

inline Bytes packetOf(std::uint32_t tag, ChunkType type, const Init& init) {
  Bytes value(initBytes(init));
  writeInit(value, init);
  return packetOf(tag, type, 0, value);
}

// A packet with a SACK.
inline Bytes sackPacket(std::uint32_t tag, std::uint32_t cumulative, std::uint32_t window,
                        std::span<const GapBlock> gaps = {}) {
  Bytes value(sackBytes(gaps));
  writeSack(value, cumulative, window, gaps);
  return packetOf(tag, ChunkType::sack, 0, value);
}

// The chunks of a packet, which must stay as long as they are used.
inline std::vector<Chunk> chunksOf(std::span<const std::byte> packet) {
  std::vector<Chunk> chunks;
  const auto parsed = parsePacket(packet);
  if (!parsed) return chunks;
  std::span<const std::byte> rest = parsed->chunks;
  while (const auto chunk = takeChunk(rest)) chunks.push_back(*chunk);
  return chunks;
}

}  // namespace clothstream::sctp

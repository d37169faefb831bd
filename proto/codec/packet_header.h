// SPDX-License-Identifier: MIT
// Header of every packet. FRAME_FORMAT.md defines the bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

enum class PacketKind : std::uint8_t { key = 0, predicted = 1 };

inline constexpr std::uint8_t kPacketVersion = 1;
inline constexpr std::size_t kMaxReferences = 4;
inline constexpr std::size_t kMaxClothRanges = 256;
inline constexpr std::size_t kMaxSections = 8;

// Consecutive cloths of the stream layout that this packet covers.
struct ClothRange {
  std::uint32_t first = 0, count = 0;
};

struct PacketHeader {
  std::uint8_t version = kPacketVersion;
  std::uint8_t codec = kCodecHierarchical;
  std::uint32_t epoch = 0;
  PacketKind kind = PacketKind::key;
  std::uint8_t quality = 0;
  std::uint64_t tick = 0;
  std::uint8_t referenceCount = 0;  // 0 for a key frame
  std::array<std::uint64_t, kMaxReferences> references{};
  std::uint16_t rangeCount = 0;
  std::array<ClothRange, kMaxClothRanges> ranges{};
  std::uint8_t sectionCount = 0;
  std::array<std::uint32_t, kMaxSections> sectionBytes{};
};

struct ParsedPacket {
  PacketHeader header;
  // All bytes after the header: exactly the sections, in order.
  std::span<const std::byte> body;
};

// nullopt if the bytes are not a packet of this version, or if the sections do not fill it exactly.
[[nodiscard]] std::optional<ParsedPacket> parsePacket(std::span<const std::byte> bytes);

// Upper bound of the bytes that writeHeader() writes.
std::size_t headerBound(const PacketHeader& header);

// Writes to `out`, which has at least headerBound() bytes, and returns the number of bytes written.
std::size_t writeHeader(const PacketHeader& header, std::span<std::byte> out);

}  // namespace clothstream::codec

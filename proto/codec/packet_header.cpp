// SPDX-License-Identifier: MIT
// Header of every packet.
#include "proto/codec/packet_header.h"

#include <cassert>
#include <limits>

namespace clothstream::codec {
namespace {

constexpr std::size_t kMaxVarintBytes = 10;

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  bool byte(std::uint8_t& out) {
    if (at_ == bytes_.size()) return false;
    out = static_cast<std::uint8_t>(bytes_[at_++]);
    return true;
  }

  // LEB128 in its shortest form only, so that a header has exactly one encoding.
  bool varint(std::uint64_t& out) {
    out = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      std::uint8_t next;
      if (!byte(next)) return false;
      const std::uint64_t bits = next & 0x7fu;
      if (shift == 63 && bits > 1) return false;
      out |= bits << shift;
      if ((next & 0x80u) == 0) return next != 0 || shift == 0;
    }
    return false;
  }

  bool varint(std::uint32_t& out) {
    std::uint64_t wide;
    if (!varint(wide) || wide > std::numeric_limits<std::uint32_t>::max()) return false;
    out = static_cast<std::uint32_t>(wide);
    return true;
  }

  std::span<const std::byte> rest() const { return bytes_.subspan(at_); }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

class Writer {
 public:
  explicit Writer(std::span<std::byte> out) : out_(out) {}

  void byte(std::uint8_t value) { out_[at_++] = std::byte{value}; }

  void varint(std::uint64_t value) {
    while (value >= 0x80) {
      byte(static_cast<std::uint8_t>(value | 0x80u));
      value >>= 7;
    }
    byte(static_cast<std::uint8_t>(value));
  }

  std::size_t written() const { return at_; }

 private:
  std::span<std::byte> out_;
  std::size_t at_ = 0;
};

// A reference is the distance back from the packet's tick, so headers of long streams stay short.
bool readReferences(Reader& reader, PacketHeader& header) {
  if (!reader.byte(header.referenceCount) || header.referenceCount > kMaxReferences) return false;
  if ((header.referenceCount == 0) != (header.kind == PacketKind::key)) return false;
  for (std::size_t i = 0; i < header.referenceCount; ++i) {
    std::uint64_t distance;
    if (!reader.varint(distance) || distance == 0 || distance > header.tick) return false;
    header.references[i] = header.tick - distance;
  }
  return true;
}

// The start of a range counts from the end of the previous range, so ranges ascend and never overlap.
bool readRanges(Reader& reader, PacketHeader& header) {
  std::uint32_t count;
  if (!reader.varint(count) || count == 0 || count > kMaxClothRanges) return false;
  header.rangeCount = static_cast<std::uint16_t>(count);
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < header.rangeCount; ++i) {
    std::uint32_t gap, cloths;
    if (!reader.varint(gap) || !reader.varint(cloths) || cloths == 0) return false;
    const std::uint64_t first = end + gap;
    end = first + cloths;
    if (end > std::numeric_limits<std::uint32_t>::max()) return false;
    header.ranges[i] = {static_cast<std::uint32_t>(first), cloths};
  }
  return true;
}

bool readSections(Reader& reader, PacketHeader& header) {
  if (!reader.byte(header.sectionCount) || header.sectionCount > kMaxSections) return false;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < header.sectionCount; ++i) {
    if (!reader.varint(header.sectionBytes[i])) return false;
    sum += header.sectionBytes[i];
  }
  return sum == reader.rest().size();
}

}  // namespace

std::optional<ParsedPacket> parsePacket(std::span<const std::byte> bytes) {
  std::optional<ParsedPacket> packet(std::in_place);
  PacketHeader& header = packet->header;
  Reader reader(bytes);
  std::uint8_t kind, reserved;
  if (!reader.byte(header.version) || header.version != kPacketVersion) return std::nullopt;
  if (!reader.byte(header.codec)) return std::nullopt;
  if (!reader.byte(kind) || kind > static_cast<std::uint8_t>(PacketKind::predicted)) return std::nullopt;
  header.kind = static_cast<PacketKind>(kind);
  if (!reader.byte(header.quality)) return std::nullopt;
  if (!reader.byte(reserved) || reserved != 0) return std::nullopt;
  if (!reader.varint(header.epoch) || !reader.varint(header.tick)) return std::nullopt;
  if (!readReferences(reader, header) || !readRanges(reader, header) || !readSections(reader, header)) {
    return std::nullopt;
  }
  packet->body = reader.rest();
  return packet;
}

std::size_t headerBound(const PacketHeader& header) {
  const std::size_t varints = 2u + header.referenceCount + 1u + 2u * header.rangeCount + header.sectionCount;
  return 7 + varints * kMaxVarintBytes;
}

std::size_t writeHeader(const PacketHeader& header, std::span<std::byte> out) {
  assert(out.size() >= headerBound(header));
  assert(header.referenceCount <= kMaxReferences && header.sectionCount <= kMaxSections);
  assert((header.referenceCount == 0) == (header.kind == PacketKind::key));
  assert(header.rangeCount > 0 && header.rangeCount <= kMaxClothRanges);
  Writer writer(out);
  writer.byte(header.version);
  writer.byte(header.codec);
  writer.byte(static_cast<std::uint8_t>(header.kind));
  writer.byte(header.quality);
  writer.byte(0);  // reserved
  writer.varint(header.epoch);
  writer.varint(header.tick);
  writer.byte(header.referenceCount);
  for (std::size_t i = 0; i < header.referenceCount; ++i) {
    assert(header.references[i] < header.tick);
    writer.varint(header.tick - header.references[i]);
  }
  writer.varint(header.rangeCount);
  std::uint32_t end = 0;
  for (std::size_t i = 0; i < header.rangeCount; ++i) {
    const ClothRange& range = header.ranges[i];
    assert(range.first >= end && range.count > 0);
    writer.varint(range.first - end);
    writer.varint(range.count);
    end = range.first + range.count;
  }
  writer.byte(header.sectionCount);
  for (std::size_t i = 0; i < header.sectionCount; ++i) writer.varint(header.sectionBytes[i]);
  return writer.written();
}

}  // namespace clothstream::codec

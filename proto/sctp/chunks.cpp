// SPDX-License-Identifier: MIT
#include "proto/sctp/chunks.h"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "proto/sctp/crc32c.h"

namespace clothstream::sctp {
namespace {

constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 4;  // of parameters and causes, too
constexpr std::uint32_t kDtls = 1;            // error detection method of RFC 9653, section 8
// Flags of DATA.
constexpr unsigned kEnd = 1, kBegin = 2, kUnordered = 4, kImmediate = 8;

constexpr std::size_t padded(std::size_t bytes) {
  return (bytes + 3) / 4 * 4;
}

// CRC-32C of a packet with zeros instead of the checksum.
std::uint32_t checksumOf(std::span<const std::byte> packet) {
  constexpr std::array<std::byte, 4> kZeros{};
  return crc32c(packet.subspan(kHeaderBytes), crc32c(kZeros, crc32c(packet.first(8))));
}

// The checksum is the only little-endian number of SCTP (RFC 9260, appendix A).
std::uint32_t readChecksum(std::span<const std::byte> packet) {
  std::uint32_t sum = 0;
  for (std::size_t i = 4; i-- > 0;) sum = sum << 8 | std::to_integer<std::uint32_t>(packet[8 + i]);
  return sum;
}

void copy(std::span<std::byte> to, std::size_t at, std::span<const std::byte> from) {
  if (!from.empty()) std::memcpy(to.subspan(at, from.size()).data(), from.data(), from.size());
}

// Reads what type and length begin: a chunk, a parameter or a cause. Returns its bytes without padding.
std::optional<std::span<const std::byte>> takeWhole(std::span<const std::byte>& rest) {
  if (rest.size() < kChunkHeaderBytes) return std::nullopt;
  const std::size_t length = read16(rest, 2);
  if (length < kChunkHeaderBytes || length > rest.size()) return std::nullopt;
  const std::span<const std::byte> whole = rest.first(length);
  rest = rest.subspan(std::min(padded(length), rest.size()));
  return whole;
}

// Parameters of INIT that have a meaning only outside of DTLS, or not for us: addresses, the life of cookies.
bool isIgnored(std::uint16_t type) {
  constexpr std::array<std::uint16_t, 4> kIgnored{5, 6, 9, 12};
  return std::ranges::find(kIgnored, type) != kIgnored.end();
}

void keepUnrecognized(Init& init, std::span<const std::byte> parameter) {
  constexpr std::size_t kMaxBytes = 64;
  if (parameter.size() > kMaxBytes) return;
  const auto free = std::ranges::find_if(init.unrecognized, [](const auto& kept) { return kept.empty(); });
  if (free != init.unrecognized.end()) *free = parameter;
}

// Returns false if the parameters after this one must not be read (RFC 9260, section 3.2.1).
bool readParameter(Init& init, const Parameter& parameter) {
  switch (parameter.type) {
    case kCookieParameter:
      init.cookie = parameter.value;
      return true;
    case kForwardTsnParameter:
      init.forwardTsn = true;
      return true;
    case kZeroChecksumParameter:
      init.zeroChecksum = parameter.value.size() == 4 && read32(parameter.value, 0) == kDtls;
      return true;
    case kExtensionsParameter:
      init.reconfig = std::ranges::find(parameter.value, static_cast<std::byte>(ChunkType::reconfig)) !=
                      parameter.value.end();
      return true;
    default:
      if (isIgnored(parameter.type)) return true;
      if (parameter.type & 0x4000) keepUnrecognized(init, parameter.whole);
      return (parameter.type & 0x8000) != 0;
  }
}

// Writes a parameter at `at`, which then is behind its padding.
void writeParameter(std::span<std::byte> value, std::size_t& at, std::uint16_t type,
                    std::span<const std::byte> content) {
  const std::size_t length = kChunkHeaderBytes + content.size();
  write16(value, at, type);
  write16(value, at + 2, length);
  copy(value, at + kChunkHeaderBytes, content);
  at += padded(length);
}

constexpr std::array kExtensions{static_cast<std::byte>(ChunkType::reconfig),
                                 static_cast<std::byte>(ChunkType::forwardTsn)};
constexpr std::array kDtlsMethod{std::byte{0}, std::byte{0}, std::byte{0}, std::byte{kDtls}};

}  // namespace

std::optional<Packet> parsePacket(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes + kChunkHeaderBytes || bytes.size() > kMaxReceivedBytes ||
      bytes.size() % 4 != 0)
    return std::nullopt;
  if (read16(bytes, 0) != kPort || read16(bytes, 2) != kPort) return std::nullopt;
  const std::uint32_t checksum = readChecksum(bytes);
  if (checksum != 0 && checksum != checksumOf(bytes)) return std::nullopt;
  return Packet{read32(bytes, 4), bytes.subspan(kHeaderBytes)};
}

std::optional<Chunk> takeChunk(std::span<const std::byte>& rest) {
  const auto whole = takeWhole(rest);
  if (!whole) return std::nullopt;
  return Chunk{static_cast<ChunkType>((*whole)[0]), std::to_integer<std::uint8_t>((*whole)[1]),
               whole->subspan(kChunkHeaderBytes), *whole};
}

std::optional<Parameter> takeParameter(std::span<const std::byte>& rest) {
  const auto whole = takeWhole(rest);
  if (!whole) return std::nullopt;
  return Parameter{read16(*whole, 0), whole->subspan(kChunkHeaderBytes), *whole};
}

std::optional<Init> parseInit(const Chunk& chunk) {
  const std::span<const std::byte> value = chunk.value;
  if (value.size() < 16) return std::nullopt;
  Init init{.tag = read32(value, 0),
            .window = read32(value, 4),
            .outgoingStreams = read16(value, 8),
            .incomingStreams = read16(value, 10),
            .tsn = read32(value, 12)};
  if (init.tag == 0 || init.outgoingStreams == 0 || init.incomingStreams == 0) return std::nullopt;
  std::span<const std::byte> rest = value.subspan(16);
  while (!rest.empty()) {
    const auto parameter = takeParameter(rest);
    if (!parameter) return std::nullopt;
    if (!readParameter(init, *parameter)) break;
  }
  return init;
}

std::optional<Data> parseData(const Chunk& chunk) {
  if (chunk.value.size() < 12) return std::nullopt;
  return Data{.tsn = read32(chunk.value, 0),
              .stream = read16(chunk.value, 4),
              .protocol = read32(chunk.value, 8),
              .unordered = (chunk.flags & kUnordered) != 0,
              .sackNow = (chunk.flags & kImmediate) != 0,
              .fragment = (chunk.flags & (kBegin | kEnd)) != (kBegin | kEnd),
              .payload = chunk.value.subspan(12)};
}

std::optional<Sack> parseSack(const Chunk& chunk) {
  const std::span<const std::byte> value = chunk.value;
  if (value.size() < 12) return std::nullopt;
  const std::size_t gaps = read16(value, 8), duplicates = read16(value, 10);
  if (value.size() < 12 + 4 * (gaps + duplicates)) return std::nullopt;
  std::uint16_t highest = 0;
  for (std::size_t i = 0; i < gaps; ++i) {
    const std::uint16_t first = read16(value, 12 + 4 * i), last = read16(value, 14 + 4 * i);
    if (first == 0 || last < first) return std::nullopt;
    highest = std::max(highest, last);
  }
  const std::uint32_t cumulative = read32(value, 0);
  return Sack{cumulative, read32(value, 4), cumulative + highest};
}

void PacketWriter::start(std::uint32_t tag) {
  assert(empty());
  size_ = kHeaderBytes;
  write16(bytes_, 0, kPort);
  write16(bytes_, 2, kPort);
  write32(bytes_, 4, tag);
  write32(bytes_, 8, 0);
}

bool PacketWriter::fits(std::size_t valueBytes) const {
  return std::max(size_, kHeaderBytes) + padded(kChunkHeaderBytes + valueBytes) <= bytes_.size();
}

std::span<std::byte> PacketWriter::add(ChunkType type, std::uint8_t flags, std::size_t valueBytes) {
  assert(!empty() && fits(valueBytes));
  const std::size_t length = kChunkHeaderBytes + valueBytes;
  const std::span<std::byte> chunk = std::span(bytes_).subspan(size_, padded(length));
  std::ranges::fill(chunk, std::byte{0});
  chunk[0] = static_cast<std::byte>(type);
  chunk[1] = static_cast<std::byte>(flags);
  write16(chunk, 2, length);
  size_ += chunk.size();
  return chunk.subspan(kChunkHeaderBytes, valueBytes);
}

std::span<const std::byte> PacketWriter::finish(bool zeroChecksum) {
  const std::span<std::byte> packet = std::span(bytes_).first(size_);
  std::uint32_t checksum = zeroChecksum ? 0 : checksumOf(packet);
  for (std::size_t i = 8; i < kHeaderBytes; ++i, checksum >>= 8)
    packet[i] = static_cast<std::byte>(checksum & 0xff);
  size_ = 0;
  return packet;
}

std::size_t initBytes(const Init& init) {
  std::size_t bytes = 16;
  const auto add = [&](std::size_t content) { bytes += padded(kChunkHeaderBytes + content); };
  if (init.forwardTsn) add(0);
  if (init.reconfig) add(kExtensions.size());
  if (init.zeroChecksum) add(kDtlsMethod.size());
  if (!init.cookie.empty()) add(init.cookie.size());
  for (const auto& parameter : init.unrecognized)
    if (!parameter.empty()) add(parameter.size());
  return bytes;
}

void writeInit(std::span<std::byte> value, const Init& init) {
  write32(value, 0, init.tag);
  write32(value, 4, init.window);
  write16(value, 8, init.outgoingStreams);
  write16(value, 10, init.incomingStreams);
  write32(value, 12, init.tsn);
  std::size_t at = 16;
  if (init.forwardTsn) writeParameter(value, at, kForwardTsnParameter, {});
  if (init.reconfig) writeParameter(value, at, kExtensionsParameter, kExtensions);
  if (init.zeroChecksum) writeParameter(value, at, kZeroChecksumParameter, kDtlsMethod);
  if (!init.cookie.empty()) writeParameter(value, at, kCookieParameter, init.cookie);
  for (const auto& parameter : init.unrecognized)
    if (!parameter.empty()) writeParameter(value, at, kUnrecognizedParameter, parameter);
}

std::uint8_t dataFlags(const Data& data) {
  return static_cast<std::uint8_t>(kBegin | kEnd | (data.unordered ? kUnordered : 0) |
                                   (data.sackNow ? kImmediate : 0));
}

void writeData(std::span<std::byte> value, const Data& data) {
  write32(value, 0, data.tsn);
  write16(value, 4, data.stream);
  write32(value, 8, data.protocol);
  copy(value, 12, data.payload);
}

void writeSack(std::span<std::byte> value, std::uint32_t cumulative, std::uint32_t window,
               std::span<const GapBlock> gaps) {
  write32(value, 0, cumulative);
  write32(value, 4, window);
  write16(value, 8, gaps.size());
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    write16(value, 12 + 4 * i, gaps[i].first);
    write16(value, 14 + 4 * i, gaps[i].last);
  }
}

void writeCause(std::span<std::byte> value, Cause cause, std::span<const std::byte> content) {
  std::size_t at = 0;
  writeParameter(value, at, static_cast<std::uint16_t>(cause), content);
}

}  // namespace clothstream::sctp

// SPDX-License-Identifier: MIT
// Packets and chunks of SCTP (RFC 9260, section 3), as far as one data channel needs them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/sctp/big_endian.h"

namespace clothstream::sctp {

// Port of both ends, as in the attribute `a=sctp-port:5000` of an offer or answer (RFC 8841).
inline constexpr std::uint16_t kPort = 5000;
// Largest packet that is sent, bytes. With DTLS 1.2 and AES-GCM (37 bytes), UDP and IPv6 it fits into 1,280
// bytes, the smallest MTU of IPv6.
inline constexpr std::size_t kMaxSentBytes = 1192;
// Largest packet that is accepted, bytes.
inline constexpr std::size_t kMaxReceivedBytes = 2048;
// Largest payload of a message, bytes.
inline constexpr std::size_t kMaxPayloadBytes = 1150;
// Largest state cookie of a peer that is echoed, bytes.
inline constexpr std::size_t kMaxCookieBytes = 1024;

enum class ChunkType : std::uint8_t {
  data = 0,
  init = 1,
  initAck = 2,
  sack = 3,
  heartbeat = 4,
  heartbeatAck = 5,
  abort = 6,
  shutdown = 7,
  shutdownAck = 8,
  error = 9,
  cookieEcho = 10,
  cookieAck = 11,
  shutdownComplete = 14,
  reconfig = 130,    // RFC 6525
  forwardTsn = 192,  // RFC 3758
};

// Causes of ERROR and ABORT (RFC 9260, section 3.3.10).
enum class Cause : std::uint16_t {
  missingParameter = 2,
  unrecognizedChunk = 6,
  noUserData = 9,
  userInitiated = 12,
};

// Types of parameters (RFC 9260, section 3.3.2; RFC 3758; RFC 5061; RFC 9653).
inline constexpr std::uint16_t kCookieParameter = 7, kUnrecognizedParameter = 8;
inline constexpr std::uint16_t kZeroChecksumParameter = 0x8001, kExtensionsParameter = 0x8008;
inline constexpr std::uint16_t kForwardTsnParameter = 0xc000;

// A chunk of a received packet. The views point into the packet.
struct Chunk {
  ChunkType type{};  // any number
  std::uint8_t flags = 0;
  std::span<const std::byte> value;  // without header and padding
  std::span<const std::byte> whole;  // with the header, without padding
};

// A received packet with a valid header. `chunks` points into it.
struct Packet {
  std::uint32_t tag = 0;  // verification tag
  std::span<const std::byte> chunks;
};

// Reads the common header. nullopt if the packet is longer than kMaxReceivedBytes, has no chunk, is not
// padded, has another port than kPort, or a wrong checksum. A checksum of zero is accepted, because the
// packet comes from DTLS and our INIT and INIT ACK say so (RFC 9653).
[[nodiscard]] std::optional<Packet> parsePacket(std::span<const std::byte> bytes);

// Takes the first chunk from `rest`. nullopt if `rest` is empty, or if the length is impossible.
[[nodiscard]] std::optional<Chunk> takeChunk(std::span<const std::byte>& rest);

// A parameter, or the cause of an error: a type and a value.
struct Parameter {
  std::uint16_t type = 0;
  std::span<const std::byte> value;
  std::span<const std::byte> whole;
};

// Takes the first parameter from `rest`. nullopt if `rest` is empty, or if the length is impossible.
[[nodiscard]] std::optional<Parameter> takeParameter(std::span<const std::byte>& rest);

// INIT or INIT ACK.
struct Init {
  std::uint32_t tag = 0;     // initiate tag, not 0
  std::uint32_t window = 0;  // advertised receiver window, bytes
  std::uint16_t outgoingStreams = 0, incomingStreams = 0;
  std::uint32_t tsn = 0;      // first TSN
  bool forwardTsn = false;    // knows FORWARD-TSN
  bool reconfig = false;      // knows RE-CONFIG
  bool zeroChecksum = false;  // accepts a checksum of zero, because DTLS protects packets
  std::span<const std::byte> cookie{};
  // Unknown parameters that the sender wants to hear of, with their headers. At most four are kept, of at
  // most 64 bytes each.
  std::array<std::span<const std::byte>, 4> unrecognized{};
};

// nullopt if the chunk is too short, the tag or a number of streams is 0, or a parameter is damaged.
[[nodiscard]] std::optional<Init> parseInit(const Chunk& chunk);

// DATA with a whole message.
struct Data {
  std::uint32_t tsn = 0;
  std::uint16_t stream = 0;
  std::uint32_t protocol = 0;  // payload protocol identifier
  bool unordered = true;
  bool sackNow = false;   // I bit: asks for an acknowledgement without delay
  bool fragment = false;  // a part of a message; only in received chunks
  std::span<const std::byte> payload{};
};

// nullopt if the chunk is too short. The payload may be empty.
[[nodiscard]] std::optional<Data> parseData(const Chunk& chunk);

// TSNs that were received: cumulative + first to cumulative + last.
struct GapBlock {
  std::uint16_t first = 0, last = 0;

  friend bool operator==(const GapBlock&, const GapBlock&) = default;
};

// SACK. Duplicate TSNs are neither read nor written.
struct Sack {
  std::uint32_t cumulative = 0;  // all TSNs up to this one have arrived or are given up
  std::uint32_t window = 0;      // bytes
  std::uint32_t highest = 0;     // highest TSN that has arrived; equals `cumulative` without gaps
};

// nullopt if the chunk is shorter than its numbers of blocks say, or if a block is empty.
[[nodiscard]] std::optional<Sack> parseSack(const Chunk& chunk);

// Collects chunks of one packet in its own memory.
class PacketWriter {
 public:
  // Begins a packet, which must then get a chunk.
  void start(std::uint32_t tag);
  bool empty() const { return size_ == 0; }
  // Whether a chunk with a value of this size fits. An empty writer counts as a started one.
  bool fits(std::size_t valueBytes) const;
  // Appends a chunk, which must fit, and returns its value, filled with zeros, for the caller to write.
  std::span<std::byte> add(ChunkType type, std::uint8_t flags, std::size_t valueBytes);
  // Completes the packet and empties the writer. The bytes stay valid until the next start().
  std::span<const std::byte> finish(bool zeroChecksum);

 private:
  std::size_t size_ = 0;
  std::array<std::byte, kMaxSentBytes> bytes_;
};

// Size of the value of a chunk, and its writer.
std::size_t initBytes(const Init& init);
void writeInit(std::span<std::byte> value, const Init& init);
inline std::size_t dataBytes(const Data& data) {
  return 12 + data.payload.size();
}
std::uint8_t dataFlags(const Data& data);
void writeData(std::span<std::byte> value, const Data& data);
inline std::size_t sackBytes(std::span<const GapBlock> gaps) {
  return 12 + 4 * gaps.size();
}
void writeSack(std::span<std::byte> value, std::uint32_t cumulative, std::uint32_t window,
               std::span<const GapBlock> gaps);
// Writes a cause of ERROR or ABORT with its content, at the beginning of `value`.
void writeCause(std::span<std::byte> value, Cause cause, std::span<const std::byte> content);

}  // namespace clothstream::sctp

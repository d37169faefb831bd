// SPDX-License-Identifier: MIT
// One association of SCTP over DTLS (RFC 9260, RFC 8261): the subset that an unreliable data channel needs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "proto/sctp/chunks.h"
#include "proto/sctp/received_tsns.h"
#include "proto/sctp/sent_tsns.h"
#include "proto/sctp/stream_resets.h"

namespace clothstream::sctp {

enum class SendResult {
  sent,
  notConnected,  // the handshake is not complete, or the association has ended
  badSize,       // empty, or longer than kMaxPayloadBytes
  full,          // the peer's window is full, or too many reliable messages wait; the message is dropped
};

// Message of the peer. `payload` is valid during the call that delivers it.
struct Message {
  std::uint16_t stream = 0;
  std::uint32_t protocol = 0;  // payload protocol identifier
  std::span<const std::byte> payload;
};

// Moves messages over packets, each of which is one DTLS record. Does no input or output, reads no clock and
// makes no random numbers. Times must not decrease. Not thread-safe.
//
// Sending: every message is one DATA chunk, which is sent at once and once. Lost ones are given up:
// FORWARD-TSN (RFC 3758) follows between `patience` and twice that time after an acknowledgement shows the
// gap. The few reliable messages are repeated after 100 ms, then with doubling pauses up to 800 ms; after ten
// repetitions the association ends. There is no congestion control: the owner must pace what it sends. The
// peer's advertised window bounds what is in flight, and what exceeds it is dropped (SendResult::full).
//
// Receiving: whole messages are delivered as they arrive, ordered or not. Fragments are acknowledged and
// dropped; announce `a=max-message-size:1150`, so that a peer sends none. Every second packet is
// acknowledged, or after 20 ms, or at once if the peer asks for it, after a gap, and after duplicates.
//
// State: DTLS has proven who the peer is, and one association belongs to one DTLS connection. So the state
// cookie protects nothing. It names the two tags, has no HMAC, and is compared with the only valid one. A
// restart of the peer (RFC 9260, section 5.2.2) needs a new DTLS connection, and so a new association.
// No HEARTBEAT is sent: the owner finds out whether the peer is alive (RFC 7675), and ends associations whose
// handshake takes too long.
class Association {
 public:
  // Streams that are offered in each direction.
  static constexpr std::uint16_t kStreams = 1024;
  // Advertised receiver window, bytes. Messages are consumed as they arrive, so it never shrinks.
  static constexpr std::uint32_t kWindowBytes = 128 * 1024;
  static constexpr Duration kSackDelay = std::chrono::milliseconds(20);
  static constexpr Duration kFirstRepeat = std::chrono::milliseconds(100);
  static constexpr Duration kLongestRepeat = std::chrono::milliseconds(800);
  static constexpr int kMaxRepeats = 10;
  static constexpr std::size_t kMaxReliable = 4;

  struct Options {
    // Random numbers from a cryptographic source. The tag is not 0 (RFC 9260, section 5.3.1).
    std::uint32_t tag = 0, firstTsn = 0;
    // Time from the acknowledgement that first shows a gap until FORWARD-TSN closes it.
    Duration patience = std::chrono::milliseconds(30);
  };
  // Functions that the association calls, within its own functions that take a time. They may send, but must
  // not destroy the association, and `transmit` must not call it.
  struct Callbacks {
    std::function<void(std::span<const std::byte> packet)> transmit;  // at most kMaxSentBytes
    std::function<void(const Message&)> deliver;
    // The peer has closed its direction of a stream, or of all streams (nullopt).
    StreamResets::Reset reset;
  };

  // Waits for the peer's INIT.
  Association(const Options& options, Callbacks callbacks);
  Association(const Association&) = delete;
  Association& operator=(const Association&) = delete;

  // Sends an INIT in addition. Both ends may do so at the same time (RFC 9260, section 5.2.1). Call it at
  // most once, before the first packet is received.
  void connect(Time now);
  // Handles a packet of the peer. A damaged packet, or one of another association, is ignored.
  void receive(Time now, std::span<const std::byte> packet);
  // Does what is due. Call it at the time of deadline(), or later.
  void advance(Time now);
  // kNever if nothing is due.
  Time deadline() const;

  // Sends an unordered message that is never repeated. `sackNow` asks the peer to acknowledge without delay.
  [[nodiscard]] SendResult send(Time now, const Message& message, bool sackNow);
  // Sends an ordered message that is repeated until the peer has it. At most one for each stream until it is
  // reset, because all have the stream sequence number 0.
  [[nodiscard]] SendResult sendReliable(Time now, const Message& message);
  // Closes our direction of a stream. Does nothing if the peer does not know RE-CONFIG.
  void resetStream(Time now, std::uint16_t stream);
  // Sends an ABORT, unless the association has ended already. `reason` must be a constant.
  void abort(std::string_view reason);

  bool isConnected() const { return state_ == State::established; }
  bool hasEnded() const { return state_ == State::shutdownAckSent || state_ == State::ended; }
  // Why the association has ended, for logs; empty before.
  std::string_view endReason() const { return endReason_; }

 private:
  enum class State { closed, cookieWait, cookieEchoed, established, shutdownAckSent, ended };
  struct Peer {
    std::uint32_t tag = 0, firstTsn = 0, window = 0;
    bool reconfig = false, zeroChecksum = false;
  };
  using Cookie = std::array<std::byte, 8>;

  bool belongsHere(const Packet& packet, const Chunk& first) const;
  // Returns false if the rest of the packet must be ignored.
  bool handle(Time now, const Chunk& chunk);
  void handleData(const Chunk& chunk);
  void handleInit(const Chunk& chunk);
  void handleInitAck(const Chunk& chunk);
  void handleCookieEcho(const Chunk& chunk);
  void handleSack(Time now, const Chunk& chunk);
  void handleForwardTsn(const Chunk& chunk);
  void handleReconfig(const Chunk& chunk);
  void handleShutdown();
  bool reportUnknown(const Chunk& chunk);
  bool accept(const Init& init);
  void establish();
  void abortFor(Cause cause, std::span<const std::byte> content, std::string_view reason);
  void end(State state, std::string_view reason);
  Init ownInit() const;
  Cookie ownCookie() const;

  // Appends a chunk to the packet that is written, and returns its value. Sends the packet first if it is
  // full.
  std::span<std::byte> append(ChunkType type, std::uint8_t flags, std::size_t valueBytes);
  void appendData(const Data& data);
  void appendSack();
  void appendRepeated();
  void appendResetRequest();
  void flush();
  bool hasRepeated() const;
  void restartRepeat();
  void armRepeat(Time now);

  const Options options_;
  const Callbacks callbacks_;
  State state_ = State::closed;
  std::string_view endReason_;
  std::optional<Peer> peer_;           // from its INIT or INIT ACK
  std::vector<std::byte> peerCookie_;  // while it is echoed
  SentTsns sent_;
  std::optional<ReceivedTsns> received_;  // once established
  std::optional<StreamResets> resets_;    // once established
  PacketWriter out_;
  int unacknowledgedPackets_ = 0;
  bool sackNow_ = false;  // a chunk of the current packet needs an acknowledgement without delay
  Time sackAt_ = kNever;
  // INIT, COOKIE ECHO, reliable messages and RE-CONFIG are repeated at this time.
  Time repeatAt_ = kNever;
  int repeats_ = 0;
};

}  // namespace clothstream::sctp

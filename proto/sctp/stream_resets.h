// SPDX-License-Identifier: MIT
// Resets of streams, by which data channels are closed (RFC 6525; RFC 8831, section 6.7).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "proto/sctp/chunks.h"

namespace clothstream::sctp {

// Both directions of one association. The peer may reset its streams; its other requests are denied. Our
// requests name one stream each and are sent one after the other.
class StreamResets {
 public:
  static constexpr std::size_t kMaxRequests = 8;

  // Both ends number their requests from their first TSN on (RFC 6525, section 4.1).
  StreamResets(std::uint32_t ownFirstTsn, std::uint32_t peerFirstTsn)
      : ownNumber_(ownFirstTsn), peerNumber_(peerFirstTsn) {}

  // Reads a RE-CONFIG chunk of the peer: one or two parameters. Responses are written behind each other into
  // `responses`, which is emptied first, as the value of a RE-CONFIG chunk. `reset` is called for each stream
  // that the peer has reset, or with nullopt if these are all streams. Returns whether our waiting request is
  // done.
  using Reset = std::function<void(std::optional<std::uint16_t> stream)>;
  bool receive(std::span<const std::byte> value, std::vector<std::byte>& responses, const Reset& reset);

  // Asks to reset an outgoing stream, whose newest TSN is at most `newestTsn`. Returns false if it is already
  // requested, or if kMaxRequests wait.
  bool request(std::uint16_t stream, std::uint32_t newestTsn);
  bool isWaiting() const { return !requests_.empty(); }
  // Size of the value of the RE-CONFIG chunk with the first waiting request, and its writer.
  static constexpr std::size_t kRequestBytes = 18;
  void writeRequest(std::span<std::byte> value) const;

 private:
  struct Request {
    std::uint16_t stream = 0;
    std::uint32_t newestTsn = 0;
  };

  std::uint32_t answer(const Parameter& request, const Reset& reset);
  bool readResponse(std::span<const std::byte> value);

  std::uint32_t ownNumber_, peerNumber_;  // next request
  std::uint32_t newestResult_ = 0;        // of the request peerNumber_ - 1
  std::vector<Request> requests_;         // the first one was sent
};

}  // namespace clothstream::sctp

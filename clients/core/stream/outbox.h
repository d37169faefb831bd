// SPDX-License-Identifier: MIT
// Queue of serialised ClientMessages that wait for the transport.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "clients/core/wire/client_message.h"

namespace clothstream::client {

// Keeps only the newest acknowledgement and the newest poses. The proof of identity is sent first, then
// Hello, the offer of datagrams, then the control messages in order.
class Outbox {
 public:
  // Limit of waiting control messages. At the limit the transport has stopped sending.
  static constexpr std::size_t kMaxControl = 256;

  // Replaces a proof that waits; empty: none.
  void setProof(std::string authenticate) { proof_ = std::move(authenticate); }
  // Replaces a Hello that waits.
  void setHello(std::string hello) { hello_ = std::move(hello); }
  bool helloWaits() const { return !hello_.empty(); }
  // Replaces an offer of datagrams that waits.
  void setOffer(std::string offer) { offer_ = std::move(offer); }
  // Returns false if the queue is full.
  [[nodiscard]] bool addControl(std::string message);
  void setAck(std::uint64_t tick) { ackTick_ = tick; }
  // Poses that wait to be sent; write to it to replace them.
  std::string& poses() { return poses_; }
  void clear();

  // Returns the next message, or nullptr. Valid until the next call of this function.
  const std::string* next();

 private:
  std::string proof_;  // empty if none waits
  std::string hello_;  // empty if none waits
  std::string offer_;  // empty if none waits
  std::deque<std::string> control_;
  std::string poses_;  // empty if none wait
  std::optional<std::uint64_t> ackTick_;
  std::string taken_;
};

}  // namespace clothstream::client

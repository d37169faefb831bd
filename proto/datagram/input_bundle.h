// SPDX-License-Identifier: MIT
// Datagrams with the newest ClientMessages, each of which travels several times because datagrams are lost.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/datagram/datagram.h"

namespace clothstream::datagram {

// Messages of a datagram: the newest and the two before it.
inline constexpr std::size_t kBundledMessages = 3;
// Bytes of the longest message that fits into a datagram. Longer ones travel on the stream.
inline constexpr std::size_t kMaxInputBytes = kMaxDatagramBytes - 7;

// Client's side. Each message is in the datagrams of the two messages after it, as far as they fit. Without
// newer messages, the last datagram is sent twice more, every 20 ms, if a message in it asks for that.
class InputSender {
 public:
  static constexpr std::uint64_t kRepeatUs = 20'000;

  // `first`: number of the first message.
  explicit InputSender(std::uint32_t first = 0) : next_(first) {}

  // Writes the datagram of a new message, 1 to kMaxInputBytes long, to `out`, which has at least
  // kMaxDatagramBytes. Returns its length. `repeats`: it may be the last message for some time, and must not
  // be lost then.
  std::size_t write(std::span<const std::byte> message, std::uint64_t nowUs, std::span<std::byte> out,
                    bool repeats = true);

  // Time at which the last datagram is to be repeated if no new message is written; nullopt if never.
  std::optional<std::uint64_t> repeatUs() const;
  // Writes the last datagram again. Call it once repeatUs() has passed. Returns its length.
  std::size_t repeat(std::uint64_t nowUs, std::span<std::byte> out);

 private:
  std::size_t writeNewest(std::uint64_t nowUs, std::span<std::byte> out);

  // Number n is at n modulo 4, a power of two, so that numbers may continue with 0.
  std::array<std::vector<std::byte>, 4> messages_;
  std::uint32_t next_;                     // number of the next message
  std::size_t count_ = 0;                  // messages that are kept
  std::size_t copies_ = kBundledMessages;  // datagrams with the newest message that asks for repeats
  std::uint64_t sentUs_ = 0;
};

// Messages of a datagram that were not delivered before, oldest first. Views of the datagram.
struct InputMessages {
  std::array<std::span<const std::byte>, kBundledMessages> messages;
  std::size_t count = 0;

  auto begin() const { return messages.begin(); }
  auto end() const { return messages.begin() + static_cast<std::ptrdiff_t>(count); }
};

// Server's side. Delivers each number at most once, and in order: a message that arrives after a newer one is
// dropped.
class InputReceiver {
 public:
  // nullopt if the datagram has another kind, no messages or more than three, an empty message, or other
  // lengths than it states. Nothing of it is delivered then.
  [[nodiscard]] std::optional<InputMessages> receive(std::span<const std::byte> datagram);

 private:
  std::uint32_t next_ = 0;  // lowest number that may be delivered
};

}  // namespace clothstream::datagram

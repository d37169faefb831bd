// SPDX-License-Identifier: MIT
// All who are in a scene. Whatever publishes to an audience is a source of frames; mailboxes do not know
// which.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "server/stream/journal.h"
#include "server/stream/mailbox.h"

namespace clothstream::stream {

// Thread-safe; publish() belongs to one thread.
class Audience {
 public:
  // Where there is a journal, it is sent what everybody is, of frames those of the finest quality that are
  // the first of their tick.
  explicit Audience(std::shared_ptr<Journal> journal = nullptr) : journal_(std::move(journal)) {}

  enum class Joining : std::uint8_t { joined, full, closed };
  // Full where there are `limit` members already.
  [[nodiscard]] Joining join(std::shared_ptr<Mailbox> mailbox, std::size_t limit);
  void leave(const Mailbox& mailbox);
  std::size_t size() const;

  void publish(const PublishedFrame& frame);
  // Whoever has no room for it is too slow to be kept: its mailbox is closed.
  void announce(const SharedBytes& message);
  // Everybody's last message.
  void dismiss(const SharedBytes& last);
  // The same, and nobody joins from here on.
  void close(const SharedBytes& last);
  // Of all members, which are to be asked whenever a frame is made.
  FrameWishes wishes(Clock::time_point now) const;
  // The qualities of which some member lacks a key frame, see Mailbox::lacks().
  std::uint8_t lacks() const;

 private:
  const std::shared_ptr<Journal> journal_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Mailbox>> members_;
  bool closed_ = false;
  // Of publish() alone, so that no mailbox is woken under the lock, and nothing is allocated for a frame.
  std::vector<std::shared_ptr<Mailbox>> receivers_;
};

}  // namespace clothstream::stream

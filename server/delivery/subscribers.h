// SPDX-License-Identifier: MIT
// Subscribers of a scene: the mailboxes that its frames and announcements go to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "server/delivery/mailbox.h"
#include "server/delivery/relay.h"

namespace clothstream::delivery {

// The only list of a scene's mailboxes. Simulated scenes and played recordings publish to it. Thread-safe;
// publish() belongs to one thread at a time.
class Subscribers {
 public:
  // `tap`, if any, gets a copy of everything that is sent to all subscribers: announcements, and of each tick
  // the first frame in the finest quality. It is called on the publishing thread and must not block.
  explicit Subscribers(std::function<void(const SharedBytes&)> tap = {}) : tap_(std::move(tap)) {}

  // `participant` is the number by which find() knows the mailbox; 0 for none.
  void add(std::shared_ptr<Mailbox> mailbox, std::uint64_t participant = 0);
  void remove(const Mailbox& mailbox);
  std::size_t size() const;

  // The relay also gets everything from now on, instead of a former one.
  void setRelay(std::shared_ptr<Relay> relay);
  // It gets nothing more. Does nothing if there is another one by now.
  void dropRelay(const Relay& relay);
  // Subscribers, and one more for a relay that needs frames.
  std::size_t receivers(Clock::time_point now) const;

  // Participant of this mailbox; 0 if the mailbox is not in the list.
  std::uint64_t participantOf(const Mailbox& mailbox) const;
  // Mailbox of this participant; null if the participant is disconnected.
  std::shared_ptr<Mailbox> find(std::uint64_t participant) const;

  void publish(const PublishedFrame& frame);
  // Sends frames that were published before to the subscribers that wait for a key frame (Mailbox::deliver).
  void publishAgain(std::span<const PublishedFrame> frames);
  // Sends the message to every subscriber. A subscriber that does not read gets it merged with others.
  void announce(const SharedBytes& message);
  // Sends the message to the subscribers that are connected to this server, and returns how many there are.
  std::size_t announceHere(const SharedBytes& message);
  // Closes every mailbox with this last message, and removes them all.
  void closeAll(const SharedBytes& last);
  // Frames that all subscribers together request. Call it whenever a frame is made.
  RequestedFrames requested(Clock::time_point now) const;
  // Qualities, as bits, in which a subscriber needs a key frame; see Mailbox::needsKeyFrame().
  std::uint8_t needsKeyFrame() const;
  // Returns whether any subscriber has a frame that it has not acknowledged, or does not receive frames yet.
  bool awaitAcknowledgement() const;
  // Returns whether a subscriber has received no frame since it joined or asked for a key frame: any, or all
  // that there are.
  bool anyRestarts() const;
  bool allRestart() const;

 private:
  struct Subscriber {
    std::shared_ptr<Mailbox> mailbox;
    std::uint64_t participant = 0;
  };

  const std::function<void(const SharedBytes&)> tap_;
  mutable std::mutex mutex_;
  std::vector<Subscriber> subscribers_;
  std::shared_ptr<Relay> relay_;
  // Used by publish() alone. It avoids waking mailboxes under the lock and allocating for every frame.
  std::vector<Subscriber> receivers_;
};

}  // namespace clothstream::delivery

// SPDX-License-Identifier: MIT
// Replies and announcements that one peer has not been sent yet.
#pragma once

#include <cstddef>
#include <deque>

#include "server/delivery/envelope.h"
#include "server/delivery/merged_announcements.h"

namespace clothstream::delivery {

// Memory: replies and announcements of at most kMaxBytes each, or one larger message.
//
// A reply without room is refused. Announcements come from other peers, so they are never refused: beyond
// kMaxBytes the waiting ones are merged (merged_announcements.h). The peer then gets the newest state instead
// of every step.
//
// Not thread-safe.
class ControlMessages {
 public:
  static constexpr std::size_t kMaxBytes = 256 * 1024;
  // Bytes counted for each message in addition to its size.
  static constexpr std::size_t kMessageOverhead = 128;
  // If merged announcements are large, the next merge happens when this many bytes more wait.
  static constexpr std::size_t kMinMergeBytes = 64 * 1024;
  // Bytes of announcements that are sent while a frame waits for them.
  static constexpr std::size_t kMaxAnnouncedBytes = 16 * 1024;

  // Returns false if there is no room.
  [[nodiscard]] bool reply(SharedBytes message);
  // `merges` is shared by all that get this message.
  void announce(SharedBytes message, SharedMerges& merges);
  // Drops the announcements. `last` follows the replies, also without room for it; it may be null.
  void end(SharedBytes last);

  // Take the oldest message, or return null.
  SharedBytes nextReply() { return pop(replies_); }
  SharedBytes nextAnnouncement();

  // Returns whether a frame that waits comes before the next announcement: kMaxAnnouncedBytes of them were
  // taken since the newest frame was sent.
  bool framesComeFirst() const { return announcedBytes_ >= kMaxAnnouncedBytes; }
  void frameSent() { announcedBytes_ = 0; }

 private:
  struct Queue {
    std::deque<SharedBytes> messages;
    std::size_t bytes = 0;  // with the overheads
  };
  static void push(Queue& queue, SharedBytes message);
  static SharedBytes pop(Queue& queue);

  Queue replies_, announcements_;
  std::size_t mergeBeyond_ = kMaxBytes;  // bytes of announcements
  std::size_t announcedBytes_ = 0;       // taken since the newest frame
};

}  // namespace clothstream::delivery

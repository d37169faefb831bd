// SPDX-License-Identifier: MIT
// What waits to be sent to one subscriber: control first, then the newest frames it can decode and has room
// for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/stream/clock.h"
#include "server/stream/envelope.h"
#include "server/telemetry/metrics.h"

namespace clothstream::stream {

// A packet on its way to everybody in a scene. Immutable once published.
struct PublishedFrame {
  SharedBytes message;
  std::uint64_t tick = 0;
  bool key = false;
  std::uint64_t referenceTick = 0;  // of a predicted frame
  Clock::time_point complete{};
};

// Everything that a decoder needs before its first frame, as messages; shared by all who join while it holds.
struct Description {
  std::uint64_t contentId = 0;
  std::vector<SharedBytes> chunks;
};

// Thread-safe. Memory of one subscriber: at most kMaxControlBytes of control (or one message that is larger),
// kMaxHeld frames and one description, the latter two shared with the other subscribers.
//
// Room for frames: at most window() of them are out and not acknowledged. It is two, and on long round trips
// as many more as the scene streams in one; the round trip is the shortest of late from a frame's leaving to
// its acknowledgement, so that a queue on the way, which makes it longer, does not feed itself.
//
// Frames form a chain: a predicted one needs the one before. A subscriber without room has up to kMaxHeld
// frames held back; if it falls behind more, they are dropped and it goes on with the next key frame, for
// which it asks (wantsKeyFrame) when it has room and its door waits for something to write: who does not read
// asks for nothing.
class Mailbox {
 public:
  static constexpr std::size_t kMaxControlBytes = 256 * 1024;
  static constexpr std::size_t kMaxHeld = 3;
  static constexpr std::size_t kMinWindow = 2;
  static constexpr std::size_t kMaxWindow = 24;

  // `wake` as for Connection.
  explicit Mailbox(std::function<void()> wake) : wake_(std::move(wake)) {}

  // Answers to this peer alone. False if there is no room: the peer asks without reading.
  [[nodiscard]] bool reply(SharedBytes message);
  // What everybody in the scene is told; kept back until the description is out.
  [[nodiscard]] bool announce(SharedBytes message);

  // From here on it is a subscriber of frames: description first; null where it has it already. `metrics`
  // outlives the mailbox.
  void subscribe(std::shared_ptr<const Description> description, std::uint32_t streamRate,
                 telemetry::SceneMetrics& metrics);
  void deliver(const PublishedFrame& frame);
  bool wantsKeyFrame() const;

  // The peer has decoded this tick. False if it never was sent.
  [[nodiscard]] bool acknowledge(std::uint64_t tick, Clock::time_point now);
  // The peer cannot go on decoding: it starts anew with a key frame.
  void restart();
  // It goes on, and wants a key frame soon.
  void wantKeyFrame();

  // No frames, no announcements any more; what was not sent is dropped, then `last` is the last message (if
  // there is one).
  void close(SharedBytes last);
  bool closed() const;

  std::optional<SharedBytes> next(Clock::time_point now);

  // Calls `wake`, unless silence() has returned.
  void wake();
  void silence();

 private:
  struct Sent {
    std::uint64_t tick;
    Clock::time_point time;
  };
  struct Control {
    std::deque<SharedBytes> messages;
    std::size_t bytes = 0;
  };

  std::optional<SharedBytes> take(Clock::time_point now);
  bool push(Control& control, SharedBytes message);
  static SharedBytes pop(Control& control);
  bool hasRoom() const { return sent_.size() < window(); }
  std::size_t window() const;
  void drop(std::size_t frames);

  mutable std::mutex mutex_;
  bool closed_ = false;
  bool doorWaits_ = false;  // it asked, there was nothing, and there is nothing for it since
  Control replies_, announcements_;

  std::shared_ptr<const Description> description_;
  std::size_t nextChunk_ = 0;

  telemetry::SceneMetrics* metrics_ = nullptr;
  std::uint32_t streamRate_ = 0;
  bool streaming_ = false;  // the description is out
  bool needsKey_ = true;
  bool wantsKey_ = false;        // and does without it until it comes
  std::uint64_t chainTick_ = 0;  // the newest frame held, or else sent
  std::deque<PublishedFrame> held_;
  std::deque<Sent> sent_;  // and not acknowledged
  std::uint64_t newestSent_ = 0;
  std::optional<double> roundTrip_;  // s

  std::mutex wakeMutex_;
  std::function<void()> wake_;
};

}  // namespace clothstream::stream

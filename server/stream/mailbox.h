// SPDX-License-Identifier: MIT
// What waits to be sent to one subscriber: control first, then the newest frames it can decode and has room
// for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "proto/codec/packet_header.h"
#include "server/stream/clock.h"
#include "server/stream/description.h"
#include "server/stream/envelope.h"
#include "server/stream/link_adaptation.h"
#include "server/telemetry/metrics.h"

namespace clothstream::stream {

// A packet on its way to everybody in a scene who gets its quality. Immutable once published.
struct PublishedFrame {
  SharedBytes message;
  std::uint64_t tick = 0;
  bool key = false;
  std::uint64_t referenceTick = 0;  // of a predicted frame
  std::uint8_t quality = 0, layer = 0;
  Clock::time_point complete{};
  // Of a tick whose frame has been made before: for who cannot go on without a key frame, and nobody else.
  bool again = false;
};

// Of the packet with this header, in this message.
PublishedFrame publishedFrame(const codec::PacketHeader& header, SharedBytes message,
                              Clock::time_point complete);

// What a scene's frames are.
struct StreamShape {
  std::uint32_t rate = 0;  // frames/s, with all layers
  std::uint8_t layers = 1;
  // That there are of every frame, for who wants them. 1: each frame is of one, whatever it is.
  std::uint8_t qualities = 1;
};

// Sets of qualities, bit by bit.
struct FrameWishes {
  std::uint8_t qualities = 0;  // somebody gets frames of it, or waits for one
  std::uint8_t keys = 0;       // of these, one of them waits for a key frame

  FrameWishes& operator|=(const FrameWishes& other) {
    qualities |= other.qualities;
    keys |= other.keys;
    return *this;
  }
};

// Thread-safe. Memory of one subscriber: of answers and of announcements kMaxControlBytes each at most (or
// one message that is larger), kMaxHeld frames of kMaxHeldBytes in all (or one that is larger) and one
// description, the latter two shared with the other subscribers.
//
// Room for frames: at most window() of them are out and not acknowledged. It is two, one more for a
// subscriber that acknowledges several at once, and on long round trips as many more as it is sent in one;
// the round trip is the shortest of late from a frame's leaving to its acknowledgement, so that a queue on
// the way, which makes it longer, does not feed itself.
//
// A predicted frame is given only where the frame that it refers to was. A subscriber without room has up to
// kMaxHeld frames held back; if it falls behind more, those of the highest layer go first, for no other layer
// needs them. If the base alone is too much, all go, and it goes on with the next key frame, for which it
// asks when it has room and its endpoint waits for something to write: who does not read asks for nothing.
//
// How many layers, and which quality, LinkAdaptation says; the subscriber is told when it changes. Another
// quality begins with a key frame of it; until that comes it goes on with the former one. Who was sent a tick
// in one quality gets no key frame of the same tick in another, which is stale to a decoder, but the next.
class Mailbox {
 public:
  static constexpr std::size_t kMaxControlBytes = 256 * 1024;
  // What a message takes beside its bytes.
  static constexpr std::size_t kMessageOverhead = 128;
  static constexpr std::size_t kMaxHeld = 3;
  static constexpr std::size_t kMaxHeldBytes = 1024 * 1024;
  static constexpr std::size_t kMinWindow = 2;
  static constexpr std::size_t kMaxWindow = 24;

  // `wake` as for Connection.
  explicit Mailbox(std::function<void()> wake) : wake_(std::move(wake)) {}

  // Answers to this peer alone. False if there is no room: the peer asks without reading.
  [[nodiscard]] bool reply(SharedBytes message);
  // What everybody in the scene is told; kept back until the description is out.
  [[nodiscard]] bool announce(SharedBytes message);

  // From here on it is a subscriber of frames: description first; null where it has it already. `wanted` at
  // most, as far as the stream has it. `metrics` outlives the mailbox.
  void subscribe(std::shared_ptr<const Description> description, const StreamShape& shape,
                 telemetry::SceneMetrics& metrics, OperatingPoint wanted = {0, codec::kMaxTemporalLayers});
  void deliver(const PublishedFrame& frame);
  // What it wants of the next frame. To be asked whenever one is made: so it knows how time passes while it
  // gets none.
  FrameWishes wishes(Clock::time_point now);
  // The quality, as a bit, of which it has room for a key frame and cannot go on without one; 0: none. May be
  // asked while no frames are made.
  std::uint8_t lacks() const;

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
    std::size_t bytes;
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
  // That the adaptation has it at; any where frames are of one.
  std::uint8_t wantedQuality() const;
  void adapt(Clock::time_point now);
  // False where it is left out, could not be decoded, or has no room.
  bool hold(const PublishedFrame& frame);
  // Drops what is held, from the highest layer on, until the frame fits; false where it is to be dropped
  // itself.
  bool makeRoom(const PublishedFrame& frame);
  // Those of this layer and above.
  void dropHeld(std::uint8_t layer);
  void dropped(std::size_t frames);

  mutable std::mutex mutex_;
  bool closed_ = false;
  bool endpointWaits_ = false;  // it asked, there was nothing, and there is nothing for it since
  Control replies_, announcements_;

  std::shared_ptr<const Description> description_;
  std::size_t nextChunk_ = 0;

  telemetry::SceneMetrics* metrics_ = nullptr;
  StreamShape shape_;
  LinkAdaptation adaptation_{{}, 1};
  OperatingPoint told_;     // of what the newest frame that was sent is
  bool streaming_ = false;  // the description is out
  bool needsKey_ = true;
  bool wantsKey_ = false;  // and does without it until it comes
  std::uint8_t quality_ = 0;
  // Of each layer the newest frame that is held, or else was sent.
  std::array<std::optional<std::uint64_t>, codec::kMaxTemporalLayers> chain_;
  std::deque<PublishedFrame> held_;
  std::size_t heldBytes_ = 0;
  std::deque<Sent> sent_;  // and not acknowledged
  std::uint64_t newestSent_ = 0;
  std::optional<std::uint64_t> decodable_;  // newest that was sent, unless the peer began anew since
  bool leavesOut_ = false;                  // the newest acknowledgement was of more than one frame
  std::optional<double> roundTrip_;         // s

  std::mutex wakeMutex_;
  std::function<void()> wake_;
};

}  // namespace clothstream::stream

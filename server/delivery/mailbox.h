// SPDX-License-Identifier: MIT
// Send queue of one peer: control messages first, then the newest frames that it can decode and has room for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include "server/delivery/control_messages.h"
#include "server/delivery/description_chunks.h"
#include "server/delivery/envelope.h"
#include "server/delivery/held_frames.h"
#include "server/delivery/link_adaptation.h"
#include "server/delivery/link_outlet.h"
#include "server/delivery/merged_announcements.h"
#include "server/delivery/published_frame.h"
#include "server/delivery/send_window.h"
#include "server/telemetry/metrics.h"

namespace clothstream::delivery {

// Thread-safe.
//
// Memory per subscriber: that of ControlMessages and of HeldFrames, and one description. Frames and
// description are shared with the other subscribers.
//
// Announcements are sent before frames, but after many of them a frame that waits comes first
// (ControlMessages), except in lockstep. Announcements never close a mailbox.
//
// SendWindow says whether the subscriber has room for a frame. Without room, a few frames are held, and a
// subscriber that misses one continues with the next key frame (HeldFrames). It asks for that key frame once
// it has room and its outlets wait for something to write. A peer that does not read therefore asks for
// nothing.
//
// A mailbox has two outlets: next() for the stream, and nextFrame() for datagrams. Frames leave by the second
// one while setLink() describes a link, as soon as the peer has acknowledged a frame and so has the
// description. The rate controller of the peer then says whether there is room; SendWindow::kMax still bounds
// the frames that are not acknowledged. A frame that is too long for datagrams leaves by next(), and those
// after it wait. Each frame leaves once, in order.
//
// LinkAdaptation chooses the quality; the peer gets an OperatingPoint message when it changes. A new quality
// begins with a key frame; until then the former quality continues. A subscriber that was sent a tick in one
// quality never gets a key frame of the same tick in another one, because decoders reject it as stale.
class Mailbox final : public LinkOutlet {
 public:
  // Minimum distance, in frames, from one key frame to the next one that a requestKeyFrame() causes.
  static constexpr std::uint32_t kMinKeyFrameDistance = 16;

  // `wake` is called, from any thread, when next() may have something or closed() became true. It must not
  // block.
  // `atEdge`: the peer is connected to an edge, and not to this server.
  explicit Mailbox(std::function<void()> wake, bool atEdge = false)
      : atEdge_(atEdge), wake_(std::move(wake)) {}

  bool atEdge() const { return atEdge_; }

  // Queues an answer to this peer. Returns false if there is no room: the peer sends requests and does not
  // read the answers.
  [[nodiscard]] bool reply(SharedBytes message);
  // Queues a message that all subscribers of the scene get; it is sent after the description.
  void announce(SharedBytes message);
  // Same; `merges` is shared by all mailboxes that get this message.
  void announce(SharedBytes message, SharedMerges& merges);

  // Starts sending frames: the description first, unless it is null because the peer has it already. `finest`
  // is the best quality wanted; it is limited to what the stream has. `metrics` must outlive the mailbox.
  void subscribe(std::shared_ptr<const DescriptionChunks> description, const StreamShape& shape,
                 telemetry::SceneMetrics& metrics, std::uint8_t finest = 0);
  void deliver(const PublishedFrame& frame);
  // If the subscriber needs a key frame and has room for it: gives it `frames`, which were published before:
  // a key frame in its quality and those that follow, at most HeldFrames::kMax in all.
  void deliver(std::span<const PublishedFrame> frames);
  // While frames travel over the stream, SendWindow gives the room.
  void setLink(std::optional<Link> link) override;
  void setFrameWake(std::function<void()> wake) override;
  std::optional<SharedBytes> nextFrame(Clock::time_point now) override;
  bool wantsFinerQuality() const override;
  // Returns what the subscriber asks of the next frame. Call it whenever a frame is made, because it also
  // measures the time in which the subscriber gets no frames.
  RequestedFrames requested(Clock::time_point now);
  // Returns the quality, as a bit, in which the subscriber needs a key frame to continue and has room for it;
  // 0 if it needs none. May be called while no frames are made.
  std::uint8_t needsKeyFrame() const;

  // The peer has decoded this tick. Returns false if the tick was never sent.
  [[nodiscard]] bool acknowledge(std::uint64_t tick, Clock::time_point now);
  // Returns whether the peer has not acknowledged everything that was delivered, or does not receive frames
  // yet. False once it is closed.
  bool awaitsAcknowledgement() const;
  // Tick of the oldest frame that was sent before this time and is not acknowledged, if the stream is in
  // lockstep.
  std::optional<std::uint64_t> overdue(Clock::time_point before) const;
  // The peer cannot continue decoding: it restarts with a key frame.
  void restart();
  // Returns whether the peer was sent no frame since restart(), or since it subscribed. The next frame is
  // then a key frame, and another restart() changes nothing.
  bool isRestarting() const;
  // The peer continues decoding and asks for a key frame soon. One key frame answers all requests before it.
  void requestKeyFrame();

  // Accepts no more frames and announcements, and drops those that were not sent. `last` is the last message,
  // or null. Only the first call counts.
  void close(SharedBytes last);
  bool closed() const;

  // Returns the next message to write to the stream, or nothing.
  std::optional<SharedBytes> next(Clock::time_point now);

  // Calls `wake` of the constructor, unless silence() has returned.
  void wake() { call(wake_); }
  // The `wake` of the constructor is not called any more after the return. The caller must hold no lock that
  // it takes.
  void silence();

 private:
  enum class Outlet : std::uint8_t { stream, link };

  std::optional<SharedBytes> take(Clock::time_point now);
  SharedBytes takeFrame(Clock::time_point now);
  bool usesLink() const { return link_ && acknowledged_; }
  bool hasRoom() const {
    return usesLink() ? link_->hasRoom && window_.inFlight() < SendWindow::kMax
                      : window_.hasRoom(shape_.rate);
  }
  // By which the oldest held frame leaves now; nothing without a frame or room.
  std::optional<Outlet> outletOfFrame() const;
  // Whether the outlets have asked for something, found nothing, and nothing has come for them since.
  bool outletsWait() const { return streamWaits_ && (linkWaits_ || !usesLink()); }
  // Notes that the oldest held frame, if it can leave, has come for its outlet, and returns that. Call
  // wake(outlet) afterwards, without the lock.
  std::optional<Outlet> noteFrame();
  void arrived(Outlet outlet) { (outlet == Outlet::stream ? streamWaits_ : linkWaits_) = false; }
  void wake(std::optional<Outlet> outlet);
  void call(const std::function<void()>& wake);
  // Quality that the adaptation chose; the present one if the stream has a single quality.
  std::uint8_t chosenQuality() const;
  void adapt(Clock::time_point now);
  // Queues a frame. Returns false if it cannot be decoded, or there is no room.
  bool hold(const PublishedFrame& frame);
  void countDropped(std::size_t frames);

  const bool atEdge_;
  mutable std::mutex mutex_;
  bool closed_ = false;
  bool streamWaits_ = false;  // next() returned nothing, and nothing has come for it since
  bool linkWaits_ = true;     // the same of nextFrame(); true before its first call
  ControlMessages control_;
  HeldFrames held_;
  SendWindow window_;
  std::optional<Link> link_;

  std::shared_ptr<const DescriptionChunks> description_;
  std::size_t nextChunk_ = 0;

  telemetry::SceneMetrics* metrics_ = nullptr;
  StreamShape shape_;
  LinkAdaptation adaptation_{0, 0};
  std::uint8_t reported_ = 0;   // newest quality in an OperatingPoint that the peer was sent
  bool streaming_ = false;      // the description is sent
  bool acknowledged_ = false;   // a frame was acknowledged, so the peer has the description
  bool requestsKey_ = false;    // the peer asked for a key frame and continues without it
  std::uint32_t sinceKey_ = 0;  // frames of quality_ since the newest key frame
  std::uint8_t quality_ = 0;

  std::mutex wakeMutex_;
  std::function<void()> wake_, frameWake_;
};

}  // namespace clothstream::delivery

// SPDX-License-Identifier: MIT
// Messages of an origin that wait at an edge for their peer: in order on its stream, frames also in
// datagrams.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "server/delivery/envelope.h"
#include "server/delivery/link_outlet.h"

namespace clothstream::fleet {

// The origin has chosen the frames for this peer, so each one leaves once, in order, by one of both outlets;
// see delivery::LinkOutlet. A frame that is too long for datagrams leaves by the stream, and those after it
// wait. All else leaves by the stream. Frames are dropped only when a link ends that may have lost some:
// until the next key frame.
//
// Not thread-safe. Reads no clock.
class RelayedMessages {
 public:
  using Link = delivery::LinkOutlet::Link;

  // Adds a message of the origin's channel. `sequence`, from 1, grows.
  void add(delivery::SharedBytes message, std::uint64_t sequence);
  // Adds a message of the edge itself.
  void add(delivery::SharedBytes message);
  // The peer has decoded a frame.
  void acknowledge(std::uint64_t tick);
  void setLink(std::optional<Link> link);
  // Frames on the stream continue with a key frame, which the origin must be asked for.
  bool needsKeyFrame() const { return needsKeyFrame_; }

  // Whether next() and nextFrame() have something.
  bool hasNext() const { return !messages_.empty() || (!frames_.empty() && !leavesByLink(frames_.front())); }
  bool hasNextFrame() const { return !frames_.empty() && leavesByLink(frames_.front()) && link_->hasRoom; }
  // Next message for the stream, and next frame for the link; null if there is none.
  delivery::SharedBytes next();
  delivery::SharedBytes nextFrame();

  // Messages that wait.
  std::size_t size() const { return messages_.size() + frames_.size(); }
  void clear();
  // Newest message of the channel that has left with all before it; 0: none.
  std::uint64_t taken() const;
  // The messages that wait are those of a former channel.
  void forgetChannel();

 private:
  struct Waiting {
    delivery::SharedBytes message;
    std::uint64_t after = 0;  // sequence of the message before it in the channel
    std::uint64_t tick = 0;   // of a frame in frames_
  };

  bool usesLink() const { return link_ && acknowledged_; }
  bool leavesByLink(const Waiting& frame) const;

  std::deque<Waiting> messages_;
  std::deque<Waiting> frames_;  // that came while frames leave by the link, or wait here
  std::uint64_t newest_ = 0;    // sequence of the newest message of the channel
  std::optional<Link> link_;
  std::optional<std::uint64_t> acknowledged_;  // newest tick
  std::uint64_t newestByLink_ = 0;             // tick of the newest frame that has left by the link
  bool needsKeyFrame_ = false;
};

}  // namespace clothstream::fleet

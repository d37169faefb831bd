// SPDX-License-Identifier: MIT
// Frames of one peer that leave by a link with a rate controller, such as datagrams, instead of its stream.
#pragma once

#include <functional>
#include <optional>

#include "server/delivery/envelope.h"
#include "server/schedule/clock.h"

namespace clothstream::delivery {

// Thread-safe. Each frame leaves once, by one of both ways. Frames leave by the link while setLink()
// describes one, as soon as the peer has acknowledged a frame and so has the description.
class LinkOutlet {
 public:
  virtual ~LinkOutlet() = default;

  // State of a link that a rate controller measures.
  struct Link {
    bool hasRoom = false;  // a frame may start
    double frameRate = 0;  // bytes/s that frames may take, without parity and headers
  };
  // Frames travel over this link from now on; nothing: over the stream. Call it after each frame that
  // nextFrame() returns, and when the controller's state changes. Frames that left by the link and are not
  // acknowledged when it ends may be lost: the stream then continues with a key frame.
  virtual void setLink(std::optional<Link> link) = 0;
  // `wake` is called, from any thread, when nextFrame() may have something. It must not block. Null: it is
  // not called any more after the return; the caller must then hold no lock that `wake` takes.
  virtual void setFrameWake(std::function<void()> wake) = 0;
  // Returns the next frame for the link, or nothing. It fits into pieces (datagram::FramePieces::fits).
  virtual std::optional<SharedBytes> nextFrame(schedule::Clock::time_point now) = 0;
  // Returns whether the link has lowered the quality. The sender then fills frames with parity rows up to
  // LinkAdaptation::kProbe times their size, as far as the link has room, to find out what it carries.
  virtual bool wantsFinerQuality() const = 0;
};

}  // namespace clothstream::delivery

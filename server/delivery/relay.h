// SPDX-License-Identifier: MIT
// Receiver of everything that a scene publishes, besides the mailboxes of its subscribers.
#pragma once

#include "server/delivery/envelope.h"
#include "server/delivery/published_frame.h"

namespace clothstream::delivery {

// The link to edge servers is one. Thread-safe; calls must not block.
class Relay {
 public:
  virtual ~Relay() = default;

  virtual void deliver(const PublishedFrame& frame) = 0;
  virtual void announce(const SharedBytes& message) = 0;
  // Frames that it asks for. No qualities: it needs no frames now.
  virtual RequestedFrames requested(Clock::time_point now) = 0;
};

}  // namespace clothstream::delivery

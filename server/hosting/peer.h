// SPDX-License-Identifier: MIT
// A connected peer, as the server that admitted it sees it.
#pragma once

#include "server/delivery/envelope.h"
#include "server/schedule/clock.h"

namespace clothstream::hosting {

// Thread-safe.
class Peer {
 public:
  virtual ~Peer() = default;

  // Closes the connection with this last message, because the server stops. The participant counts as
  // disconnected: it may come back to the next run of the server.
  virtual void close(delivery::SharedBytes last) = 0;
  // Disconnects the peer if it has been silent for too long, or if its token has ended. Called about once a
  // second. Does not wait for a message that the peer's thread handles.
  virtual void checkSilence(schedule::Clock::time_point now) = 0;
};

}  // namespace clothstream::hosting

// SPDX-License-Identifier: MIT
// Why a session was closed.
#pragma once

#include <cstdint>
#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"

namespace clothstream::session {

struct Closing {
  enum class Reason : std::uint8_t { error, sceneDeleted, serverStopping };

  Reason reason = Reason::serverStopping;
  v1::Error error;   // with Reason::error
  std::string text;  // one line for people
};

// Reads the reason from the last message of a session: a fatal Error, a notice that the scene was deleted, or
// else that the server stops.
Closing closingOf(const delivery::SharedBytes& lastMessage);

}  // namespace clothstream::session

// SPDX-License-Identifier: MIT
// Session of a peer with the server that makes the frames, which is another one than the peer is connected
// to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "server/delivery/envelope.h"
#include "server/delivery/link_outlet.h"

namespace clothstream::scene {

// A peer as the other server learns about it.
struct RemotePeer {
  std::string name;              // for logs
  std::string address;           // groups the peers of one machine; empty for programs of this machine
  std::string token;             // that it has proved its identity with; empty: none
  std::string resumeToken = {};  // of the place that it wants back; empty: a new one
};

// Thread-safe. The session ends with the destructor, as a lost connection, unless end() was called.
//
// Frames that the other server has sent may also leave by a link of this server.
class RemoteSession : public delivery::LinkOutlet {
 public:
  enum class End : std::uint8_t { left, lost, pageClosed };

  // Sends a serialised ClientMessage. Messages arrive in their order, once. Returns false if too many wait,
  // because the other server does not answer.
  [[nodiscard]] virtual bool send(std::span<const std::byte> message) = 0;
  // Next serialised ServerMessage for the peer's stream, or nothing.
  virtual std::optional<delivery::SharedBytes> next() = 0;
  // Whether the other server has ended the session and next() has returned all its messages.
  virtual bool ended() const = 0;
  virtual void end(End how) = 0;
};

}  // namespace clothstream::scene

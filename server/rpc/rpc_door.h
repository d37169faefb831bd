// SPDX-License-Identifier: MIT
// The gRPC door: the service of session.proto, with health checks and reflection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace clothstream::stream {
class SceneServer;
}

namespace clothstream::rpc {

struct RpcDoorOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 50051;  // 0: one that is free
  // Joined at once; one more is answered with RESOURCE_EXHAUSTED.
  std::size_t maxStreams = 256;
};

// Join moves the bytes of stream::Connection as they are, the unary calls answer from SceneServer. When a
// connection finishes, its stream ends with the status that fits the last Error; a peer that vanishes is
// found within 5 s.
//
// All calls are served by one thread of the door's own, but for reflection, which is gRPC's. Construction and
// destruction belong to the caller's thread.
class RpcDoor {
 public:
  // Listens when it returns. `server` must outlive the door. Throws std::runtime_error that says what to do
  // when the port is in use or the host is none of this machine's.
  RpcDoor(stream::SceneServer& server, const RpcDoorOptions& options);
  // Ends every stream with UNAVAILABLE and waits until the clients have it; takes at most about two seconds.
  ~RpcDoor();
  RpcDoor(const RpcDoor&) = delete;
  RpcDoor& operator=(const RpcDoor&) = delete;

  // The actual one.
  std::uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::rpc

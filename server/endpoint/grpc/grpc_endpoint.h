// SPDX-License-Identifier: MIT
// The gRPC endpoint: the service of session.proto, with health checks and reflection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::endpoint {

struct GrpcEndpointOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 50051;  // 0: one that is free
  // Joined at once; one more is answered with RESOURCE_EXHAUSTED.
  std::size_t maxStreams = 256;
};

// Join moves the bytes of stream::Connection as they are, the unary calls answer from SceneServer. When a
// connection finishes, its stream ends with the status that fits the last Error; a peer that vanishes is
// found within 5 s.
//
// All calls are served by one thread of the endpoint's own, but for reflection, which is gRPC's. Construction
// and destruction belong to the caller's thread.
class GrpcEndpoint {
 public:
  // Listens when it returns. `server` must outlive the endpoint. Throws std::runtime_error that says what to
  // do when the port is in use or the host is none of this machine's.
  GrpcEndpoint(hosting::SceneServer& server, const GrpcEndpointOptions& options);
  // Ends every stream with UNAVAILABLE and waits until the clients have it; takes at most about two seconds.
  ~GrpcEndpoint();
  GrpcEndpoint(const GrpcEndpoint&) = delete;
  GrpcEndpoint& operator=(const GrpcEndpoint&) = delete;

  // The actual one.
  std::uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::endpoint

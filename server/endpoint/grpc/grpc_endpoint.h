// SPDX-License-Identifier: MIT
// gRPC endpoint: the service of session.proto, health checks and reflection.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "server/endpoint/grpc/answer_budget.h"
#include "server/endpoint/listen/admission.h"

namespace clothstream::hosting {
class SceneServer;
}
namespace clothstream::tls {
class ServerTls;
}

namespace clothstream::endpoint {

struct GrpcEndpointOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 50051;  // 0: a free port
  // Maximum number of open Join streams. Further ones end with RESOURCE_EXHAUSTED.
  // The same holds for health watches and streams of reflection together.
  std::size_t maxStreams = 256;
  // Also for Join streams, and for health watches with streams of reflection. `connections` is ignored: it
  // follows from maxStreams.
  ConnectionLimits connections{};
  // Memory of the answers that clients have not read yet, and the time after which their calls are cancelled.
  AnswerLimits answers{};
  std::chrono::milliseconds answerTimeout{10'000};
  // Offers reflection. Without it only clients that have session.proto can make calls.
  bool reflects = false;
  // Null: no TLS. Must outlive the endpoint.
  std::shared_ptr<const tls::ServerTls> tls{};
};

// Join forwards the bytes of a session::Session unchanged. SceneServer answers the unary calls. When a
// session finishes, its stream ends with the status that matches the last Error. A client that vanishes is
// found within 5 s.
//
// The endpoint has one thread for all calls. Create and destroy the endpoint on one thread.
class GrpcEndpoint {
 public:
  // Listens when it returns. `server` must outlive the endpoint. Throws std::runtime_error with advice if the
  // port is in use or the host is not an address of this machine.
  GrpcEndpoint(hosting::SceneServer& server, const GrpcEndpointOptions& options);
  // Ends every stream with UNAVAILABLE and waits until the clients have the status: at most about 2 s.
  ~GrpcEndpoint();
  GrpcEndpoint(const GrpcEndpoint&) = delete;
  GrpcEndpoint& operator=(const GrpcEndpoint&) = delete;

  // Port on which the endpoint listens.
  std::uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
// Client of either endpoint for tests: sends and receives serialised messages.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tests/endpoint/viewer.h"

namespace clothstream::tests {

// How an endpoint ended a stream: a gRPC status or a WebSocket close reason.
struct StreamEnd {
  int code = 0;
  std::string text;
};

// Belongs to one thread. Every call returns within 20 s or throws std::runtime_error.
class Client {
 public:
  virtual ~Client() = default;

  // Returns false if the connection is broken.
  virtual bool send(const std::string& message) = 0;
  // Returns nullopt when the server has ended the stream.
  virtual std::optional<std::string> receive() = 0;
  // How the server ended the stream. Call it after receive() returned nullopt.
  virtual StreamEnd end() = 0;
  // Leaves with the goodbye of the transport: a half-closed gRPC stream or a close frame.
  virtual void leave() = 0;
  // Breaks the connection without a goodbye.
  virtual void disconnect() = 0;

  // Receives and acknowledges frames until `done`. Returns false when the server ends the stream first.
  bool watch(Viewer& viewer, const std::function<bool()>& done);
};

// A client that has joined a scene, and what it has received.
struct Joined {
  // Returns when the first frame is decoded. An empty name is the default scene.
  explicit Joined(std::unique_ptr<Client> newClient, const std::string& scene = "");

  // Receives `count` more frames. Returns false when the server ends the stream first.
  bool see(std::uint64_t count);
  bool seeUntil(const std::function<bool()>& done) { return client->watch(viewer, done); }
  // Receives until the server ends the stream.
  StreamEnd seeEnd();

  std::unique_ptr<Client> client;
  Viewer viewer;
};

}  // namespace clothstream::tests

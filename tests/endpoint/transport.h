// SPDX-License-Identifier: MIT
// The two endpoints behind one interface, so that one suite tests both.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "server/hosting/scene_server.h"
#include "tests/endpoint/client.h"

namespace clothstream::tests {

// Why an endpoint ends a stream.
enum class EndCause { left, unknownScene, outOfOrder, malformed, tooLarge, serverStops };

struct TransportOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  // 0: a free port
  std::size_t maxConnections = 256;
};

// One endpoint and the client that matches it. Belongs to one thread.
class Transport {
 public:
  virtual ~Transport() = default;

  // Closes the open endpoint, if any, and opens another. Throws std::runtime_error as the endpoint does.
  virtual void open(hosting::SceneServer& server, const TransportOptions& options = {}) = 0;
  virtual void close() = 0;
  // Port of the open endpoint.
  virtual std::uint16_t port() const = 0;

  // With `smallBuffer`, the client's system buffers only a few KiB of unread data.
  virtual std::unique_ptr<Client> connect(bool smallBuffer = false) = 0;
  // Keeps a client that reads nothing from counting as vanished. Does nothing if the transport answers pings.
  virtual void keepAlive(Client&) {}
  // Whether the endpoint accepts one more connection.
  virtual bool hasRoom() = 0;
  // Longest time in which a misbehaving client that does not read must be cut off.
  virtual std::chrono::seconds cutOffTime() const = 0;

  // StreamEnd::code for this cause.
  virtual int codeOf(EndCause cause) const = 0;
  // Longest StreamEnd::text, bytes.
  virtual std::size_t maxEndText() const { return std::numeric_limits<std::size_t>::max(); }
  // Name of the server's option for the port.
  virtual const char* portOption() const = 0;
};

std::unique_ptr<Transport> makeWebTransport();
// Only in builds with gRPC.
std::unique_ptr<Transport> makeGrpcTransport();

struct TransportKind {
  const char* name;
  std::unique_ptr<Transport> (*make)();

  friend void PrintTo(const TransportKind& kind, std::ostream* out) { *out << kind.name; }
};

// Every transport of this build.
std::vector<TransportKind> transportKinds();

}  // namespace clothstream::tests

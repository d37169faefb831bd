// SPDX-License-Identifier: MIT
// What the sessions of one door share; the door's io thread alone touches it.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "server/web/page.h"

namespace clothstream::stream {
class SceneServer;
}

namespace clothstream::web {

class StreamSession;

struct DoorContext {
  stream::SceneServer& server;
  boost::asio::io_context& io;
  const Page page;
  const std::vector<std::string> allowedOrigins;
  const std::size_t maxConnections;
  std::size_t connections = 0;
  std::unordered_set<std::shared_ptr<StreamSession>> streams;
  bool stopping = false;
};

// Counts one connection as long as it lives; handed on when HTTP becomes WebSocket.
class ConnectionSlot {
 public:
  explicit ConnectionSlot(DoorContext& door) : door_(door) { ++door_.connections; }
  ~ConnectionSlot() { --door_.connections; }
  ConnectionSlot(const ConnectionSlot&) = delete;
  ConnectionSlot& operator=(const ConnectionSlot&) = delete;

 private:
  DoorContext& door_;
};

}  // namespace clothstream::web

// SPDX-License-Identifier: MIT
// State that all sockets of one endpoint share. Belongs to the endpoint's io thread.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "server/endpoint/listen/address_rate.h"
#include "server/endpoint/listen/admission.h"
#include "server/endpoint/web/host_names.h"
#include "server/endpoint/web/page.h"
#include "server/tls/server_tls.h"

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::endpoint {

class WebSocketStream;

// HTTP requests per second of one address. The burst is twice this number.
inline constexpr double kRequestsPerSecond = 100;

struct WebEndpointContext {
  hosting::SceneServer& server;
  boost::asio::io_context& io;
  Page page;
  const HostNames names;
  const std::shared_ptr<const tls::ServerTls> tls;  // null without TLS
  const std::vector<std::string> allowedOrigins;
  const std::size_t maxConnections;
  std::size_t connections = 0;
  // HTTP requests of each address. Programs of this machine share one limit.
  AddressRate requestRate{kRequestsPerSecond, 2 * kRequestsPerSecond};
  std::unordered_set<std::shared_ptr<WebSocketStream>> streams;
  bool stopping = false;
};

// Counts one connection while it lives. Passes to the WebSocket when HTTP is upgraded.
class ConnectionSlot {
 public:
  ConnectionSlot(WebEndpointContext& endpoint, Admission::Ticket ticket)
      : endpoint_(endpoint), ticket_(std::move(ticket)) {
    ++endpoint_.connections;
  }
  ~ConnectionSlot() { --endpoint_.connections; }
  ConnectionSlot(const ConnectionSlot&) = delete;
  ConnectionSlot& operator=(const ConnectionSlot&) = delete;

  // Key of the peer's address (addressKey).
  const std::string& address() const { return ticket_.address(); }

 private:
  WebEndpointContext& endpoint_;
  const Admission::Ticket ticket_;
};

}  // namespace clothstream::endpoint

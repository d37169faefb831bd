// SPDX-License-Identifier: MIT
// The browser's endpoint: the static page over HTTP, and the server's messages over WebSocket at /stream.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::endpoint {

struct WebEndpointOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: one that is free
  // Empty: no page, /stream and /healthz alone.
  std::filesystem::path pageDirectory;
  // Of all kinds; one more is answered with 503.
  std::size_t maxConnections = 256;
  // Pages from elsewhere that may open /stream, such as "https://example.org"; "*" stands for every page. The
  // endpoint's own page always may, and so may what is no browser and names no origin.
  std::vector<std::string> allowedOrigins;
};

// GET and HEAD: the page's files, /healthz ("ok" while the server runs). /stream upgrades to a WebSocket: a
// binary message is an envelope of session.proto; anything else closes it. A peer that vanishes is found
// within 5 s.
//
// All sockets are served by one thread of the endpoint's own. Construction and destruction belong to the
// caller's thread.
class WebEndpoint {
 public:
  // Listens when it returns. `server` must outlive the endpoint. Throws std::runtime_error that says what to
  // do when the port is in use, the host is none of this machine's, or the page cannot be read.
  WebEndpoint(hosting::SceneServer& server, const WebEndpointOptions& options);
  // Closes every WebSocket with "going away"; takes at most about a second.
  ~WebEndpoint();
  WebEndpoint(const WebEndpoint&) = delete;
  WebEndpoint& operator=(const WebEndpoint&) = delete;

  // The actual one.
  std::uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
// Endpoint for browsers: the static page over HTTP, and the server's messages over WebSocket at /stream.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/endpoint/listen/admission.h"

namespace clothstream::hosting {
class SceneServer;
}
namespace clothstream::tls {
class ServerTls;
}

namespace clothstream::endpoint {

struct WebEndpointOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080;  // 0: a free port
  // Directory of the page. Empty: only /stream and /healthz.
  std::filesystem::path pageDirectory{};
  // Maximum number of open connections, HTTP and WebSocket. Further ones are answered with 503.
  std::size_t maxConnections = 256;
  // `connections` is ignored: it follows from maxConnections.
  ConnectionLimits connections{};
  // Names, in addition to those of this machine and to addresses, under which browsers reach the endpoint
  // (HostNames). Requests for other names are answered with 421.
  std::vector<std::string> publicNames{};
  // Null: HTTP. Else HTTPS; requests without TLS are redirected.
  std::shared_ptr<const tls::ServerTls> tls{};
  // Host under which other devices in the network reach the page, which shows it with a QR code. Empty: none.
  std::string hostInNetwork{};
  // Whether the page also shows the fingerprint of the server's key, because no authority has signed it.
  bool showsFingerprint = false;
  // Origins of other pages that may open /stream, such as "https://example.org"; "*" allows every page. The
  // endpoint's own page and clients that send no origin are always allowed.
  std::vector<std::string> allowedOrigins{};
};

// Answers GET and HEAD for the page's files, for /healthz ("ok" while the server runs), and for the address
// that the page shows: /address.json with `address` and `fingerprint`, which may be empty, and /address.svg
// with the QR code. /stream upgrades to a WebSocket: each binary message is an envelope of session.proto; a
// text message closes it. A client that vanishes is found within 5 s.
//
// The endpoint has one thread for all sockets. Create and destroy the endpoint on one thread.
class WebEndpoint {
 public:
  // Listens when it returns. `server` must outlive the endpoint. Throws std::runtime_error with advice if the
  // port is in use, the host is not an address of this machine, or the page cannot be read.
  WebEndpoint(hosting::SceneServer& server, const WebEndpointOptions& options);
  // Closes every WebSocket with "going away": at most about 1 s.
  ~WebEndpoint();
  WebEndpoint(const WebEndpoint&) = delete;
  WebEndpoint& operator=(const WebEndpoint&) = delete;

  // Port on which the endpoint listens.
  std::uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::endpoint

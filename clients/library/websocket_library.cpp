// SPDX-License-Identifier: MIT
// The library over WebSocket.
#include "clients/library/library_transport.h"
#include "clients/websocket/web_socket_transport.h"

namespace clothstream {

const Endpoint kLibraryEndpoint = Endpoint::web;

std::unique_ptr<Transport> makeLibraryTransport(const ServerAddress& address) {
  return makeWebSocketTransport(address);
}

}  // namespace clothstream

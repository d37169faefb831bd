// SPDX-License-Identifier: MIT
// Transport of a native client over WebSocket, with or without TLS.
#pragma once

#include <memory>

#include "clients/native/address.h"
#include "clients/native/transport.h"

namespace clothstream {

// `address` must come from completeAddress(text, Endpoint::web). Throws std::invalid_argument if the file of
// authorities cannot be read. Its destructor does not wait for the network.
std::unique_ptr<Transport> makeWebSocketTransport(const ServerAddress& address);

}  // namespace clothstream

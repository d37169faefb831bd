// SPDX-License-Identifier: MIT
// Transport of a native client with datagrams in addition to its stream (docs/transport.md).
#pragma once

#include <memory>

#include "clients/native/transport.h"

namespace clothstream {

enum class Datagrams {
  automatic,  // if the server opens them and UDP passes; else everything travels on the stream
  required,   // a client has joined when they are open
  off,
};

// `stream` with datagrams (DatagramSession), which use a UDP socket with a thread. Returns `stream` itself
// for `off`. Throws std::runtime_error if OpenSSL fails.
std::unique_ptr<Transport> withDatagrams(std::unique_ptr<Transport> stream, Datagrams use);

}  // namespace clothstream

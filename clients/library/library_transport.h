// SPDX-License-Identifier: MIT
// Protocol that the library is built for (CLOTHSTREAM_LIBRARY_TRANSPORT).
#pragma once

#include <memory>

#include "clients/native/address.h"
#include "clients/native/transport.h"

namespace clothstream {

extern const Endpoint kLibraryEndpoint;

// `address` must come from completeAddress(text, kLibraryEndpoint).
std::unique_ptr<Transport> makeLibraryTransport(const ServerAddress& address);

}  // namespace clothstream

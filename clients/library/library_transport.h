// SPDX-License-Identifier: MIT
// Protocol that the library is built for (CLOTHSTREAM_LIBRARY_TRANSPORT).
#pragma once

#include <cstdint>
#include <memory>

#include "clients/native/address.h"
#include "clients/native/transport.h"

namespace clothstream {

extern const Endpoint kLibraryEndpoint;

// `address` must come from completeAddress(text, kLibraryEndpoint).
std::unique_ptr<Transport> makeLibraryTransport(const ServerAddress& address);

// Whether this build has datagrams.
extern const bool kLibraryHasDatagrams;

// `stream` with datagrams as a clothstream_transport says. A build without them returns `stream` itself.
std::unique_ptr<Transport> withLibraryDatagrams(std::unique_ptr<Transport> stream, std::uint32_t transport);

}  // namespace clothstream

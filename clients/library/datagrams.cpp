// SPDX-License-Identifier: MIT
// The library with datagrams.
#include <utility>

#include <clothstream/clothstream.h>

#include "clients/datagram/datagram_transport.h"
#include "clients/library/library_transport.h"

namespace clothstream {

const bool kLibraryHasDatagrams = true;

std::unique_ptr<Transport> withLibraryDatagrams(std::unique_ptr<Transport> stream, std::uint32_t transport) {
  return withDatagrams(std::move(stream), transport == CLOTHSTREAM_TRANSPORT_AUTO ? Datagrams::automatic
                                          : transport == CLOTHSTREAM_TRANSPORT_DATAGRAMS ? Datagrams::required
                                                                                         : Datagrams::off);
}

}  // namespace clothstream

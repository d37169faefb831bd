// SPDX-License-Identifier: MIT
// The library without datagrams, which need OpenSSL.
#include "clients/library/library_transport.h"

namespace clothstream {

const bool kLibraryHasDatagrams = false;

std::unique_ptr<Transport> withLibraryDatagrams(std::unique_ptr<Transport> stream,
                                                std::uint32_t /*transport*/) {
  return stream;
}

}  // namespace clothstream

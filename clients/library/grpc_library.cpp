// SPDX-License-Identifier: MIT
// The library over gRPC.
#include "clients/grpc/grpc_client.h"
#include "clients/library/library_transport.h"

namespace clothstream {

const Endpoint kLibraryEndpoint = Endpoint::grpc;

std::unique_ptr<Transport> makeLibraryTransport(const ServerAddress& address) {
  return makeGrpcTransport(address);
}

}  // namespace clothstream

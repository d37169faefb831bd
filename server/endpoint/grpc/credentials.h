// SPDX-License-Identifier: MIT
// Credentials of a gRPC server.
#pragma once

#include <memory>

#include <grpcpp/security/server_credentials.h>

namespace clothstream::tls {
class ServerTls;
}

namespace clothstream::endpoint {

// Without TLS if `tls` is null. A reloaded certificate is used within kCertificateInterval, for new
// connections. `tls` must outlive the server.
std::shared_ptr<grpc::ServerCredentials> credentialsOf(const tls::ServerTls* tls);

inline constexpr unsigned kCertificateInterval = 1;  // seconds

}  // namespace clothstream::endpoint

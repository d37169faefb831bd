// SPDX-License-Identifier: MIT
// Names of the DNS-SD service (RFC 6763) under which a server is announced in its network.
#pragma once

namespace clothstream::discovery {

// The port of the service is that of the page.
inline constexpr const char* kServiceType = "_clothstream._tcp";

// Keys of the TXT record.
inline constexpr const char* kGrpcPortKey = "grpc";
inline constexpr const char* kTlsKey = "tls";          // "1" with TLS
inline constexpr const char* kFingerprintKey = "key";  // of the server's own certificate
inline constexpr const char* kVersionKey = "version";  // of the server

}  // namespace clothstream::discovery

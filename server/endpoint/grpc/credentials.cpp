// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "server/tls/server_tls.h"

namespace clothstream::endpoint {

std::shared_ptr<grpc::ServerCredentials> credentialsOf(const tls::ServerTls* tls) {
  if (tls == nullptr) return grpc::InsecureServerCredentials();
  const std::string clientCa = tls->clientCaPath();
  grpc::experimental::TlsServerCredentialsOptions options(
      std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
          tls->certificatePath(), tls->certificatePath(), clientCa, kCertificateInterval));
  options.watch_identity_key_cert_pairs();
  if (clientCa.empty()) {
    options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  } else {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace clothstream::endpoint

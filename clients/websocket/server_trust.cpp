// SPDX-License-Identifier: MIT
// Checks a certificate by its key, or by an authority and the host's name.
#include "clients/websocket/server_trust.h"

#include <stdexcept>

#include <boost/asio/ssl/host_name_verification.hpp>

#include "proto/tls/fingerprint.h"

namespace clothstream {

namespace ssl = boost::asio::ssl;

ServerTrust::ServerTrust(const ServerAddress& server)
    : fingerprint_(server.fingerprint), context_(ssl::context::tls_client) {
  context_.set_options(ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
  context_.set_verify_mode(ssl::verify_peer);
  if (server.fingerprint.empty() && server.caFile.empty()) context_.set_default_verify_paths();
  if (server.fingerprint.empty() && !server.caFile.empty()) {
    boost::system::error_code error;
    context_.load_verify_file(server.caFile, error);
    if (error)
      throw std::invalid_argument("cannot read the certificates in " + server.caFile + ": " +
                                  error.message());
  }
  expect(server.host());
}

void ServerTrust::expect(const std::string& host) {
  const ssl::host_name_verification isSigned(host);
  context_.set_verify_callback([this, isSigned](bool verified, ssl::verify_context& chain) {
    const X509* const certificate = X509_STORE_CTX_get0_cert(chain.native_handle());
    shown_ = certificate ? fingerprintOf(*certificate).value_or("") : "";
    return fingerprint_.empty() ? isSigned(verified, chain) : shown_ == fingerprint_;
  });
}

}  // namespace clothstream

// SPDX-License-Identifier: MIT
#include "proto/dtls/dtls_context.h"

#include <exception>

#include <openssl/x509_vfy.h>

#include "proto/dtls/limits.h"
#include "proto/tls/ciphers.h"

namespace clothstream::dtls {
namespace {

// Returns whether this is the fingerprint of the certificate.
bool hasFingerprint(const X509* certificate, const std::string& fingerprint) {
  try {
    return certificate != nullptr && fingerprintOf(*certificate) == fingerprint;
  } catch (const std::exception&) {
    return false;  // no exception may leave a function that OpenSSL calls
  }
}

// Accepts the one certificate that signalling has named, whatever else it says: the handshake proves that the
// peer has its key. Returns 1 or 0, as OpenSSL requires.
int verify(X509_STORE_CTX* store, void*) {
  const auto* const ssl =
      static_cast<const SSL*>(X509_STORE_CTX_get_ex_data(store, SSL_get_ex_data_X509_STORE_CTX_idx()));
  const auto* const expected = static_cast<const std::string*>(SSL_get_app_data(ssl));
  const bool right = hasFingerprint(X509_STORE_CTX_get0_cert(store), *expected);
  X509_STORE_CTX_set_error(store, right ? X509_V_OK : X509_V_ERR_CERT_REJECTED);
  return right ? 1 : 0;
}

}  // namespace

DtlsContext::DtlsContext(const Certificate& certificate)
    : context_(tls::check(SSL_CTX_new(DTLS_method()), "DTLS")) {
  SSL_CTX* const context = context_.get();
  tls::check(SSL_CTX_set_min_proto_version(context, DTLS1_2_VERSION), "DTLS 1.2");
  tls::check(SSL_CTX_set_max_proto_version(context, DTLS1_2_VERSION), "DTLS 1.2");
  tls::check(SSL_CTX_set_cipher_list(context, tls::kCiphers), "DTLS: no cipher is available");
  SSL_CTX_set_options(context, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_NO_TICKET |
                                   SSL_OP_NO_QUERY_MTU);
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_max_cert_list(context, static_cast<long>(kMaxHandshakeMessage));
  // Sizes the buffer for records that are sent, which would have 16 KiB otherwise.
  tls::check(SSL_CTX_set_max_send_fragment(context, kMaxPayloadBytes), "DTLS: size of records");
  tls::check(SSL_CTX_use_certificate(context, &certificate.x509()), "DTLS: certificate");
  tls::check(SSL_CTX_use_PrivateKey(context, &certificate.key()), "DTLS: key");
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  SSL_CTX_set_cert_verify_callback(context, &verify, nullptr);
}

std::unique_ptr<SSL, tls::Freed<SSL_free>> DtlsContext::newAssociation(
    const std::string& peerFingerprint) const {
  std::unique_ptr<SSL, tls::Freed<SSL_free>> association(tls::check(SSL_new(context_.get()), "DTLS"));
  // OpenSSL takes the pointer without const, and verify() only reads it.
  SSL_set_app_data(association.get(), const_cast<std::string*>(&peerFingerprint));
  return association;
}

}  // namespace clothstream::dtls

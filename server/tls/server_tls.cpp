// SPDX-License-Identifier: MIT
#include "server/tls/server_tls.h"

#include <cerrno>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/system/system_error.hpp>
#include <fmt/format.h>
#include <openssl/ssl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "proto/tls/fingerprint.h"

namespace clothstream::tls {
namespace {

namespace ssl = boost::asio::ssl;

// Of TLS 1.2, those with forward secrecy and authenticated encryption. TLS 1.3 has no others.
constexpr const char* kCiphers = "ECDHE+AESGCM:ECDHE+CHACHA20";

int chooseProtocol(SSL*, const unsigned char** out, unsigned char* outSize, const unsigned char* in,
                   unsigned int inSize, void*) {
  static constexpr unsigned char kHttp[] = {8, 'h', 't', 't', 'p', '/', '1', '.', '1'};
  unsigned char* chosen = nullptr;
  if (SSL_select_next_proto(&chosen, outSize, kHttp, sizeof kHttp, in, inSize) != OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_NOACK;
  *out = chosen;
  return SSL_TLSEXT_ERR_OK;
}

std::shared_ptr<ssl::context> contextOf(const Certificate& certificate, const std::string& clientCa) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  SSL_CTX* const native = context->native_handle();
  SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION);
  SSL_CTX_set_options(native, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_mode(native, SSL_MODE_RELEASE_BUFFERS);
  if (SSL_CTX_set_cipher_list(native, kCiphers) != 1) throw std::runtime_error("TLS: no cipher is available");
  SSL_CTX_set_alpn_select_cb(native, &chooseProtocol, nullptr);
  try {
    context->use_certificate_chain(boost::asio::buffer(certificate.chain));
    context->use_private_key(boost::asio::buffer(certificate.key), ssl::context::pem);
    if (!clientCa.empty()) {
      context->add_certificate_authority(boost::asio::buffer(clientCa));
      context->set_verify_mode(ssl::verify_peer);
    }
  } catch (const boost::system::system_error& refused) {
    throw std::runtime_error(fmt::format("TLS: the certificate cannot be used: {}", refused.what()));
  }
  return context;
}

}  // namespace

MemoryFile::MemoryFile() : descriptor_(::memfd_create("tls", MFD_CLOEXEC)) {
  if (descriptor_ < 0) throw std::system_error(errno, std::system_category(), "memfd_create");
  path_ = fmt::format("/proc/self/fd/{}", descriptor_);
}

MemoryFile::~MemoryFile() {
  ::close(descriptor_);
}

void MemoryFile::write(const std::string& content) {
  const bool written =
      ::ftruncate(descriptor_, 0) == 0 &&
      ::pwrite(descriptor_, content.data(), content.size(), 0) == static_cast<ssize_t>(content.size());
  if (!written) throw std::system_error(errno, std::system_category(), "memory file");
}

ServerTls::ServerTls(std::function<Certificate()> load, std::string clientCa)
    : load_(std::move(load)), clientCa_(std::move(clientCa)) {
  if (!clientCa_.empty()) clientCaFile_.write(clientCa_);
  reload();
}

void ServerTls::reload() {
  const Certificate certificate = load_();
  auto context = contextOf(certificate, clientCa_);
  const std::lock_guard lock(mutex_);
  context_ = std::move(context);
  fingerprint_ = fingerprintOf(certificate.chain).value_or("");
  chain_.write(certificate.chain);
  key_.write(certificate.key);
}

std::shared_ptr<ssl::context> ServerTls::context() const {
  const std::lock_guard lock(mutex_);
  return context_;
}

std::string ServerTls::fingerprint() const {
  const std::lock_guard lock(mutex_);
  return fingerprint_;
}

}  // namespace clothstream::tls

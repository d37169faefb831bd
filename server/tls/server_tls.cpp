// SPDX-License-Identifier: MIT
#include "server/tls/server_tls.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/system/system_error.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/ssl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/tls/ciphers.h"
#include "proto/tls/fingerprint.h"

namespace clothstream::tls {
namespace {

namespace ssl = boost::asio::ssl;

// Sessions of TLS belong to this name. At most 32 bytes.
constexpr std::string_view kSessions = "clothstream";

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
      // OpenSSL refuses to resume a session of a verified peer without it.
      SSL_CTX_set_session_id_context(native, reinterpret_cast<const unsigned char*>(kSessions.data()),
                                     static_cast<unsigned>(kSessions.size()));
    }
  } catch (const boost::system::system_error& refused) {
    throw std::runtime_error(fmt::format("TLS: the certificate cannot be used: {}", refused.what()));
  }
  return context;
}

int makeMemoryFile() {
  const int descriptor = ::memfd_create("tls", MFD_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::system_category(), "memfd_create");
  return descriptor;
}

}  // namespace

MemoryFile::MemoryFile() : descriptor_(makeMemoryFile()) {
  path_ = fmt::format("/proc/self/fd/{}", descriptor_);
}

MemoryFile::~MemoryFile() {
  ::close(descriptor_);
}

void MemoryFile::write(const std::string& content) {
  const int next = makeMemoryFile();
  time_ = std::max(std::time(nullptr), time_ + 1);
  const timespec times[] = {{.tv_sec = time_, .tv_nsec = 0}, {.tv_sec = time_, .tv_nsec = 0}};
  const bool replaced =
      ::pwrite(next, content.data(), content.size(), 0) == static_cast<ssize_t>(content.size()) &&
      ::futimens(next, times) == 0 && ::dup3(next, descriptor_, O_CLOEXEC) >= 0;
  const int error = errno;
  ::close(next);
  if (!replaced) throw std::system_error(error, std::system_category(), "memory file");
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
  file_.write(certificate.chain + "\n" + certificate.key);  // first, because it may throw
  context_ = std::move(context);
  fingerprint_ = fingerprintOf(certificate.chain).value_or("");
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

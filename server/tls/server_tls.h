// SPDX-License-Identifier: MIT
// TLS of the endpoints. The certificate can be replaced while connections stay open.
#pragma once

#include <ctime>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <boost/asio/ssl/context.hpp>

#include "server/tls/certificate.h"

namespace clothstream::tls {

// A file in memory, without a name in the file system. Readers open it by its path in /proc.
class MemoryFile {
 public:
  MemoryFile();  // empty; throws std::system_error
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  // Path in /proc, valid in this process.
  const std::string& path() const { return path_; }
  // Replaces the content at once: a reader that opens the path gets the old or the new content. The time of
  // the last modification grows by at least one second, so that a reader of several parts notices the change.
  // Throws std::system_error, and keeps the old content.
  void write(const std::string& content);

 private:
  const int descriptor_;
  std::time_t time_ = 0;
  std::string path_;
};

// TLS 1.2 or newer. Thread-safe.
class ServerTls {
 public:
  // `load` returns the certificate, now and at each reload(). `clientCa`: PEM text of the authorities whose
  // client certificates are accepted; empty asks for none. A client without a certificate is accepted. Throws
  // what `load` throws, and std::runtime_error if OpenSSL refuses the certificate.
  ServerTls(std::function<Certificate()> load, std::string clientCa);

  // Loads the certificate again, for new connections. Throws as the constructor does, and keeps the old one.
  void reload();

  // For a new connection over HTTP/1.1.
  std::shared_ptr<boost::asio::ssl::context> context() const;
  // SHA-256 of the public key (fingerprintOf).
  std::string fingerprint() const;

  // File with the chain and the key of the present certificate, for gRPC. One file holds both, so that they
  // always belong together.
  const std::string& certificatePath() const { return file_.path(); }
  // Empty without client certificates.
  std::string clientCaPath() const { return clientCa_.empty() ? "" : clientCaFile_.path(); }

 private:
  const std::function<Certificate()> load_;
  const std::string clientCa_;
  MemoryFile file_, clientCaFile_;
  mutable std::mutex mutex_;
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::string fingerprint_;
};

}  // namespace clothstream::tls

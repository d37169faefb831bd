// SPDX-License-Identifier: MIT
// Decides which servers a client on Windows accepts over TLS.
#pragma once

#include <memory>
#include <string>

#include <wincrypt.h>
#include <windows.h>

#include "clients/native/address.h"

namespace clothstream {

// WinHTTP accepts every certificate, so that a refused server can be reported with its fingerprint. This
// check replaces the one of WinHTTP, for all three kinds of trust. It runs before the client reads the answer
// to its request, which has nothing secret. Thread-safe.
class CertificateCheck {
 public:
  // Throws std::invalid_argument if the file of authorities cannot be read.
  explicit CertificateCheck(const ServerAddress& server);
  // The same check for a server of another name.
  CertificateCheck at(const std::string& host) const;

  struct Result {
    bool trusted = false;
    std::string shownKey;  // fingerprint of the key; empty if it has none that can be read
    std::string why;       // for a server that is not trusted
  };
  // May take seconds, because Windows downloads authorities of the system when it first meets them.
  [[nodiscard]] Result check(const CERT_CONTEXT& certificate) const;

 private:
  // Error of the chain or of the name; ERROR_SUCCESS for a trusted certificate.
  DWORD chainError(const CERT_CONTEXT& certificate) const;

  std::string fingerprint_;
  std::wstring host_;
  std::string address_;  // bytes of the IP address if the host is one
  // Store with the authorities of the file, and the engine for them; empty: those of the system.
  std::shared_ptr<void> authorities_, engine_;
};

}  // namespace clothstream

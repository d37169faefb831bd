// SPDX-License-Identifier: MIT
// Decides which servers a client accepts over TLS.
#pragma once

#include <string>

#include <boost/asio/ssl/context.hpp>

#include "clients/native/address.h"

namespace clothstream {

// Belongs to the thread that shakes hands.
class ServerTrust {
 public:
  // Throws std::invalid_argument if the file of authorities cannot be read.
  explicit ServerTrust(const ServerAddress& server);
  ServerTrust(const ServerTrust&) = delete;
  ServerTrust& operator=(const ServerTrust&) = delete;

  // Name of the server that the next connections lead to, in place of the host of the address.
  void expect(const std::string& host);
  boost::asio::ssl::context& context() { return context_; }
  // Fingerprint of the key that the newest server has shown; empty before the first.
  const std::string& shown() const { return shown_; }

 private:
  const std::string fingerprint_;  // empty: an authority must have signed the certificate
  std::string shown_;
  boost::asio::ssl::context context_;
};

}  // namespace clothstream

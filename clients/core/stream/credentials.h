// SPDX-License-Identifier: MIT
// The token or pairing code by which the client proves who it is.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "clients/core/wire/client_message.h"

namespace clothstream::client {

class Credentials {
 public:
  // The proof of later connections.
  void set(Proof proof) { proof_ = std::move(proof); }
  const Proof& proof() const { return proof_; }
  bool empty() const { return proof_.token.empty() && proof_.pairingCode.empty(); }

  // A proof that the server is asked to accept on the current connection. It counts once accepted() is
  // called.
  const Proof& renew(std::string_view token) {
    renewing_ = {.token = std::string(token), .pairingCode = {}};
    return renewing_;
  }
  void forgetRenewal() { renewing_ = {}; }
  // The server accepts the newest proof. Unless `token` is empty, it replaces a pairing code, which has been
  // used.
  void accepted(std::string token) {
    if (!renewing_.token.empty()) proof_ = std::exchange(renewing_, {});
    if (!token.empty()) proof_ = {.token = std::move(token), .pairingCode = {}};
  }

 private:
  Proof proof_;
  Proof renewing_;  // empty without one
};

}  // namespace clothstream::client

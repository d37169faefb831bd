// SPDX-License-Identifier: MIT
// Identity of one peer, and what proved it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/hosting/connections.h"
#include "server/identity/identity.h"

namespace clothstream::session {

// Not thread-safe.
class PeerIdentity {
 public:
  // `connections` must outlive this.
  explicit PeerIdentity(hosting::Connections& connections) : connections_(connections) {}

  bool isKnown() const { return identity_.has_value(); }
  // The identity must be known.
  const identity::Identity& operator*() const { return *identity_; }
  const identity::Identity* operator->() const { return &*identity_; }

  // Sets the identity that `token` has proved, and counts the connection for it. Returns false, and the
  // former identity stays without a connection that counts, if its subject has too many of them.
  [[nodiscard]] bool set(identity::Identity identity, std::string token) {
    // A new token of the same subject replaces the former one.
    const bool same = identity_ && identity_->verified && identity_->subject == identity.subject;
    if (!same) {
      counted_.reset();
      counted_ = connections_.count(identity);
    }
    if (!counted_) return false;
    identity_ = std::move(identity);
    token_ = std::move(token);
    return true;
  }
  // The connection counts no more.
  void release() { counted_.reset(); }

  // Newest token that the peer has sent; empty without one.
  const std::string& token() const { return token_; }

 private:
  hosting::Connections& connections_;
  std::optional<identity::Identity> identity_;  // nothing until the peer has proved what the server requires
  std::string token_;
  std::shared_ptr<const void> counted_;  // while the connection counts for its subject
};

}  // namespace clothstream::session

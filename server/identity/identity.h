// SPDX-License-Identifier: MIT
// Who a peer is, and the highest role that it has.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "server/scene/roles.h"
#include "server/scene/subject.h"

namespace clothstream::identity {

using WallClock = std::chrono::system_clock;

// Without a token (`verified` is false) only `role` is set.
struct Identity {
  scene::Role role = scene::Role::none;
  bool verified = false;
  scene::Subject subject;   // never empty if verified; the same for all tokens of a person or program
  std::string displayName;  // replaces the one in Hello; empty: none
  std::string scene;        // the only scene that it may use; empty: all
  std::optional<WallClock::time_point> expires;
  std::string keyId, keyDigest;  // of the key that has signed the token

  // Returns whether it may use the scene of this name.
  bool reaches(const std::string& name) const { return scene.empty() || scene == name; }
  bool isVerifiedOwner() const { return verified && role == scene::Role::owner; }
};

// Identity of the server's own program, and of every peer of a server that asks for no identity.
inline Identity local() {
  return {.role = scene::Role::owner,
          .verified = false,
          .subject = {},
          .displayName = {},
          .scene = {},
          .expires = {},
          .keyId = {},
          .keyDigest = {}};
}

}  // namespace clothstream::identity

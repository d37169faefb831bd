// SPDX-License-Identifier: MIT
// JSON Web Tokens: signs and checks them with libjwt.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "server/identity/identity.h"
#include "server/identity/token_key.h"
#include "server/messages/field_error.h"

namespace clothstream::identity {

inline constexpr std::size_t kMaxTokenBytes = 4096;
// A token is valid this long before its beginning (nbf), because the clocks of two machines differ.
inline constexpr std::chrono::seconds kLeeway{30};

// Content of a token. Names of the claims are those of the members, except `sub`, `aud`, `exp` and `nbf`.
struct Claims {
  scene::Role role = scene::Role::participant;  // absent: participant
  std::string scene;                            // absent: every scene
  std::string name;                             // display name
  std::string subject;                          // absent: a digest of header and claims
  std::string tenant;
  std::string audience;                            // required
  std::optional<WallClock::time_point> expires;    // required; whole seconds
  std::optional<WallClock::time_point> notBefore;  // whole seconds
};

// Throws std::runtime_error if the key has no signing part.
std::string sign(const TokenKey& key, const Claims& claims);

// Returns the identity that a token proves at the time `now`, or UNAUTHENTICATED and which check failed:
// size, form, crit, kid, algorithm, signature, audience, time, or the type of a claim. The algorithm follows
// from the key alone. The text never contains the token.
[[nodiscard]] messages::Result<Identity> check(const std::string& token, const TokenKeys& keys,
                                               const std::string& audience, WallClock::time_point now);

}  // namespace clothstream::identity

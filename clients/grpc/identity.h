// SPDX-License-Identifier: MIT
// Pairs with a server, and manages its pairing codes and bans, without joining a scene.
#pragma once

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/native/address.h"
#include "clients/native/failure.h"

namespace clothstream {

// Returns the token that the server gives for a pairing code of six digits. `address` must come from
// completeAddress(), here and below.
[[nodiscard]] tl::expected<std::string, Failure> pair(const ServerAddress& address, const std::string& code);

struct PairingCode {
  std::string code;
  std::uint32_t validSeconds = 0;
};
// Code by which others get the role. Needs a token with the role owner.
[[nodiscard]] tl::expected<PairingCode, Failure> createPairingCode(const ServerAddress& address,
                                                                   cs_role role);

struct Ban {
  std::string subject, displayName;
};
// Both need a token with the role owner. An empty scene is the default scene.
[[nodiscard]] tl::expected<std::vector<Ban>, Failure> listBans(const ServerAddress& address,
                                                               const std::string& scene);
[[nodiscard]] tl::expected<void, Failure> liftBan(const ServerAddress& address, const std::string& scene,
                                                  const std::string& subject);

}  // namespace clothstream

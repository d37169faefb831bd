// SPDX-License-Identifier: MIT
#include "server/hosting/server_options.h"

#include <algorithm>

#include "server/identity/authenticator.h"

namespace clothstream::hosting {

std::uint32_t ServerOptions::scenesPerTenant() const {
  constexpr std::uint32_t kTenants = 4;  // with the default, this many tenants can fill the server
  if (maxScenesPerTenant) return *maxScenesPerTenant;
  const bool hasTenants = authenticator && authenticator->hasTenants();
  return hasTenants ? std::max(1U, maxCreatedScenes / kTenants) : maxCreatedScenes;
}

}  // namespace clothstream::hosting

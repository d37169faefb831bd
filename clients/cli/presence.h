// SPDX-License-Identifier: MIT
// Texts about participants.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/core/core.h"

namespace clothstream::cli {

// Name of a role, such as "viewer"; the number of an unknown role.
std::string roleName(std::uint32_t role);
// Role with this name.
std::optional<cs_role> roleNamed(const std::string& name);

// Display name such as "Ada", or "clothstream page (participant 3)" without one.
std::string nameOf(const cs_participant& participant);
// Name of the participant with this id; its number if it is not in the scene.
std::string nameOf(const cs_client* client, std::uint64_t participant);

// Number of a participant whose name does not contain it, such as ", number 3"; else "".
std::string numberOf(const cs_participant& participant);

// Text of a presence event of a participant, such as "Ada joined as participant, number 3".
std::string text(const cs_client* client, const cs_presence& presence, const cs_participant& participant);

}  // namespace clothstream::cli

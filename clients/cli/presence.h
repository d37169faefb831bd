// SPDX-License-Identifier: MIT
// Who is there, in words.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/core/core.h"

namespace clothstream::cli {

// "viewer", ...; of one that this client does not know, its number.
std::string roleName(std::uint32_t role);
// The cs_role of that name.
std::optional<cs_role> roleNamed(const std::string& name);

// Such as: Ada, or clothstream page (participant 3) of who has no name.
std::string nameOf(const cs_participant& participant);
// Of the participant with this id; of who is not there (any more), its number.
std::string nameOf(const cs_client* client, std::uint64_t participant);

// What CS_EVENT_PRESENCE told; such as: Ada joined as participant.
std::string text(const cs_client* client, const cs_presence& presence);

}  // namespace clothstream::cli

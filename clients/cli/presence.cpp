// SPDX-License-Identifier: MIT
// Texts about participants.
#include "clients/cli/presence.h"

#include <array>

#include <fmt/format.h>

namespace clothstream::cli {
namespace {

constexpr std::array<const char*, 4> kRoles{"none", "viewer", "participant", "owner"};

std::string byWhom(const cs_client* client, std::uint64_t by) {
  return by == 0 ? "" : fmt::format(" by {}", nameOf(client, by));
}

}  // namespace

std::string roleName(std::uint32_t role) {
  return role < kRoles.size() ? kRoles[role] : fmt::format("role {}", role);
}

std::optional<cs_role> roleNamed(const std::string& name) {
  for (std::size_t role = CS_ROLE_VIEWER; role < kRoles.size(); ++role)
    if (name == kRoles[role]) return static_cast<cs_role>(role);
  return std::nullopt;
}

std::string nameOf(const cs_participant& participant) {
  if (*participant.name != '\0') return participant.name;
  return fmt::format("{} (participant {})",
                     *participant.client_name != '\0' ? participant.client_name : "client", participant.id);
}

std::string nameOf(const cs_client* client, std::uint64_t participant) {
  cs_participant known;
  for (std::uint32_t i = 0; cs_get_participant(client, i, &known) != 0; ++i)
    if (known.id == participant) return nameOf(known);
  return fmt::format("participant {}", participant);
}

std::string numberOf(const cs_participant& participant) {
  return *participant.name == '\0' ? "" : fmt::format(", number {}", participant.id);
}

std::string text(const cs_client* client, const cs_presence& presence, const cs_participant& participant) {
  const std::string name = nameOf(participant);
  switch (presence.kind) {
    case CS_PRESENCE_JOINED:
      return fmt::format("{} joined as {}{}", name, roleName(participant.role), numberOf(participant));
    case CS_PRESENCE_LEFT:
      if (presence.reason == CS_LEAVE_TIMED_OUT) return name + " was disconnected and did not return";
      if (presence.reason == CS_LEAVE_REMOVED)
        return fmt::format("{} was removed{}", name, byWhom(client, presence.by));
      return name + " left";
    case CS_PRESENCE_ROLE_CHANGED:
      return fmt::format("{} became {}{}", name, roleName(participant.role), byWhom(client, presence.by));
    case CS_PRESENCE_DISCONNECTED:
      return name + " was disconnected";
    case CS_PRESENCE_RETURNED:
      return name + " has returned";
    case CS_PRESENCE_BODY_CHANGED: {
      const char* const body = cs_body_of(client, participant.id);
      return *body == '\0' ? name + " wears no body any more" : fmt::format("{} wears {}", name, body);
    }
    default:
      return fmt::format("{}: an event that this client does not know", name);
  }
}

}  // namespace clothstream::cli

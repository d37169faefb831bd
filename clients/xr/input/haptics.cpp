// SPDX-License-Identifier: MIT
#include "clients/xr/input/haptics.h"

#include <algorithm>
#include <cmath>

namespace clothstream::xr {
namespace {

// Impulse of a contact that vibrates with the largest amplitude, N s: a light fabric at 1 m/s.
constexpr float kFullImpulse = 0.02f;
constexpr float kLeastAmplitude = 0.15f;  // weaker ones are not felt
constexpr float kContactSeconds = 0.02f, kGrabSeconds = 0.03f, kSlipSeconds = 0.08f;

}  // namespace

std::optional<Pulse> pulseOf(const cs_contact_event& event, std::uint64_t ownId, const OwnInput& input) {
  if (event.kind != CS_CONTACT_BEGAN || event.participant_id != ownId || ownId == 0) return std::nullopt;
  if (event.collider_id >= input.colliderCount) return std::nullopt;
  const float strength = std::isfinite(event.impulse) ? event.impulse / kFullImpulse : 0;
  return Pulse{.side = input.colliderSides[event.collider_id],
               .amplitude = std::clamp(strength, kLeastAmplitude, 1.f),
               .seconds = kContactSeconds};
}

std::optional<Pulse> pulseOf(const cs_grab_event& event, Side side) {
  if (event.kind == CS_GRAB_TAKEN) return Pulse{.side = side, .amplitude = 0.5f, .seconds = kGrabSeconds};
  if (event.kind == CS_GRAB_SLIPPED) return Pulse{.side = side, .amplitude = 0.3f, .seconds = kSlipSeconds};
  return std::nullopt;
}

}  // namespace clothstream::xr

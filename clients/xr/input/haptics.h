// SPDX-License-Identifier: MIT
// Vibration of controllers that touch or take hold of cloth.
#pragma once

#include <cstdint>
#include <optional>

#include "clients/xr/input/own_input.h"

namespace clothstream::xr {

struct Pulse {
  Side side = Side::left;
  float amplitude = 0;  // 0 to 1
  float seconds = 0;
};

// Pulse for a contact of an own collider; none for contacts that end, and for hands, heads and other
// participants. `input` is what was sent last. Stronger impulses vibrate more.
std::optional<Pulse> pulseOf(const cs_contact_event& event, std::uint64_t ownId, const OwnInput& input);
// Pulse for a grab that took hold or slipped. `side` holds, or held, the grab.
std::optional<Pulse> pulseOf(const cs_grab_event& event, Side side);

}  // namespace clothstream::xr

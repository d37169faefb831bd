// SPDX-License-Identifier: MIT
// Facts about a scene that are settled before it runs: where it comes from, and how many may join it.
#pragma once

#include <cstdint>
#include <string>

#include "server/scene/defaults.h"

namespace clothstream::scene {

struct SceneTerms {
  bool created = false;  // by a peer, while the server runs
  // Tenant of the peer that created it; empty if it has none.
  std::string tenant = {};
  std::uint32_t maxParticipants = kDefaultMaxParticipants;  // disconnected ones included
  // The scene shares the device as a guest (schedule::TickSchedule), although the server started with it.
  bool sharesAsGuest = false;
  // It is a scene of an earlier run that has no room in this one. It does not run, and stays kept.
  bool waitsForRoom = false;
};

}  // namespace clothstream::scene

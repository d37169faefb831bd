// SPDX-License-Identifier: MIT
// State of a running scene after a tick, and everything about a scene that survives the end of the server.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/model/scene.h"
#include "server/scene/collider_set.h"
#include "server/scene/grabs_and_attachments.h"
#include "server/scene/held_winds.h"
#include "server/scene/roster.h"
#include "server/schedule/overload_policy.h"
#include "server/simulation/state_snapshot.h"

namespace clothstream::scene {

// Everything that a later tick depends on. A scene that continues from it has the same states as one that was
// never interrupted, if it gets the same inputs.
struct Checkpoint {
  simulation::StateSnapshot state;  // its tick is that of the checkpoint
  model::Scene scene;               // with the parameters of the tick
  // Tick at which the easing of a change of solver ends, for each cloth.
  std::vector<std::uint64_t> easeUntil;
  ColliderSet::State colliders;
  GrabsAndAttachments::State grabs;
  std::vector<HeldWinds::Placed> winds;
  std::optional<std::uint64_t> lastRecovery;  // newest tick with an invalid state
  schedule::WorkLevel work;  // of the tick; less than all work while the device is overloaded
};

// A scene of an earlier run of the server.
struct SavedScene {
  model::Scene start;
  std::uint32_t maxParticipants = 0;
  bool paused = false;
  bool resetRequested = false;
  std::string tenant = {};  // of the peer that created it
  SavedRoster roster = {};
  // Nothing if the scene never ran, if there was no room for it, or if it cannot be used.
  std::optional<Checkpoint> checkpoint = {};
  // Definition with the changes that were accepted after the checkpoint; nothing if there were none.
  std::optional<model::Scene> accepted = {};
};

}  // namespace clothstream::scene

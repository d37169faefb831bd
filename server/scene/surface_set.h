// SPDX-License-Identifier: MIT
// Surfaces of the real room in a scene, from tick to tick.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/scene/room_surfaces.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/tick_inputs.h"

namespace clothstream::scene {

// Belongs to the device's thread. A surface acts from the first tick on that can upload what is left of it;
// the surface that it replaces acts until then. The order is that of RoomSurfaces::take().
class SurfaceSet {
 public:
  // Sets all surfaces.
  void set(std::span<const RoomSurface> surfaces);
  void letGo() { slots_.clear(); }
  bool empty() const { return slots_.empty(); }

  // Writes the surfaces of the next tick, and those that arrive meanwhile. `simulation` is the one that will
  // run it; null: it is not ready for surfaces, and none acts.
  void advance(const simulation::ClothSimulation* simulation, simulation::TickInputs& inputs);

 private:
  struct Slot {
    std::uint64_t participant;
    std::uint32_t id;
    std::optional<simulation::PlacedSurface> acting, next;
  };
  std::vector<Slot> slots_, former_;  // the latter is memory that set() reuses
};

}  // namespace clothstream::scene

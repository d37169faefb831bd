// SPDX-License-Identifier: MIT
#include "server/scene/surface_set.h"

#include <algorithm>
#include <utility>

#include "server/model/same_pose.h"
#include "server/simulation/collision/surface_stage.h"

namespace clothstream::scene {

void SurfaceSet::set(std::span<const RoomSurface> surfaces) {
  std::swap(slots_, former_);
  slots_.clear();
  for (const RoomSurface& surface : surfaces) {
    Slot& slot = slots_.emplace_back(Slot{surface.participant, surface.id, std::nullopt, std::nullopt, 0});
    const auto before = std::ranges::find_if(former_, [&](const Slot& one) {
      return one.participant == surface.participant && one.id == surface.id;
    });
    if (before != former_.end()) {
      slot.acting = std::move(before->acting);
      slot.liftTicks = before->liftTicks;
    }
    if (slot.acting && slot.acting->table == surface.placed.table) {
      if (!model::isSame(slot.acting->pose, surface.placed.pose)) slot.liftTicks = kLiftTicks;
      slot.acting = surface.placed;
    } else {
      slot.next = surface.placed;
    }
  }
  former_.clear();
}

void SurfaceSet::advance(const simulation::ClothSimulation* simulation, simulation::TickInputs& inputs) {
  inputs.surfaces.clear();
  inputs.arriving.clear();
  if (simulation == nullptr) return;
  std::size_t left = simulation::kSurfaceUploadTexels;
  for (Slot& slot : slots_) {
    if (slot.next) {
      const std::size_t texels = simulation->texelsToUpload(*slot.next->table);
      if (texels <= left) {
        slot.acting = std::exchange(slot.next, std::nullopt);
        slot.liftTicks = kLiftTicks;
        left -= texels;
      } else {
        inputs.arriving.push_back(slot.next->table);
        left = 0;
      }
    }
    if (!slot.acting) continue;
    slot.acting->lifts = slot.liftTicks > 0;
    slot.liftTicks -= slot.liftTicks > 0 ? 1 : 0;
    inputs.surfaces.push_back(*slot.acting);
  }
}

}  // namespace clothstream::scene

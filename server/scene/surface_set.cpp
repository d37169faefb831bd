// SPDX-License-Identifier: MIT
#include "server/scene/surface_set.h"

#include <algorithm>
#include <utility>

#include "server/simulation/collision/surface_stage.h"

namespace clothstream::scene {

void SurfaceSet::set(std::span<const RoomSurface> surfaces) {
  std::swap(slots_, former_);
  slots_.clear();
  for (const RoomSurface& surface : surfaces) {
    Slot& slot = slots_.emplace_back(Slot{surface.participant, surface.id, std::nullopt, std::nullopt});
    const auto before = std::ranges::find_if(former_, [&](const Slot& one) {
      return one.participant == surface.participant && one.id == surface.id;
    });
    if (before != former_.end()) slot.acting = std::move(before->acting);
    if (slot.acting && slot.acting->table == surface.placed.table)
      slot.acting = surface.placed;
    else
      slot.next = surface.placed;
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
        left -= texels;
      } else {
        inputs.arriving.push_back(slot.next->table);
        left = 0;
      }
    }
    if (slot.acting) inputs.surfaces.push_back(*slot.acting);
  }
}

}  // namespace clothstream::scene

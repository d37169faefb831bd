// SPDX-License-Identifier: MIT
#include "server/scene/held_winds.h"

#include <algorithm>
#include <cstddef>

namespace clothstream::scene {

void HeldWinds::place(std::uint64_t participant, std::span<const model::HeldWind> winds) {
  std::erase_if(placed_, [&](const Placed& placed) { return placed.participant == participant; });
  auto place = std::ranges::lower_bound(placed_, participant, {}, &Placed::participant);
  for (const model::HeldWind& wind : winds) place = placed_.insert(place, {participant, wind}) + 1;
}

void HeldWinds::advance(const model::Scene& scene, float room, std::vector<model::LocalWind>& winds) const {
  winds.assign(scene.winds.begin(), scene.winds.end());
  const std::size_t own = winds.size();
  for (const Placed& placed : placed_)
    if (winds.size() < model::kMaxLocalWinds) winds.push_back(placed.wind);
  const auto held = std::span(winds).subspan(own);
  const float speed = model::speedOf(held);
  if (speed <= room) return;
  for (model::LocalWind& wind : held) wind.speed *= room / speed;
}

}  // namespace clothstream::scene

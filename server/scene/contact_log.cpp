// SPDX-License-Identifier: MIT
#include "server/scene/contact_log.h"

#include <cmath>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {

void ContactLog::addEvents(std::uint64_t tick, const model::Scene& scene, const ColliderSet& colliders,
                           std::span<const simulation::ContactStatus> contacts, v1::TickEvents& events) {
  const auto add = [&](v1::ContactEventKind kind, const Pair& pair, double impulse, double seconds) {
    v1::ContactEvent& event = *events.add_contacts();
    event.set_kind(kind);
    if (pair.collider.participant == 0) {
      event.set_collider(scene.colliders[pair.collider.id].name);
    } else {
      event.set_participant_id(pair.collider.participant);
      event.set_collider_id(pair.collider.id);
    }
    event.set_cloth(scene.cloths[pair.cloth].name);
    event.set_impulse(static_cast<float>(impulse));
    event.set_seconds(static_cast<float>(seconds));
  };
  for (const simulation::ContactStatus& status : contacts) {
    const Pair pair{colliders.identity(status.collider), status.cloth};
    const auto [place, begins] = contacts_.try_emplace(pair, Contact{tick, tick, 0});
    place->second.touched = tick;
    place->second.impulse += status.impulse;
    if (begins) add(v1::CONTACT_EVENT_KIND_BEGAN, pair, status.impulse, 0);
  }
  const auto apart = static_cast<std::uint64_t>(std::ceil(kApart * scene.simulationRate));
  std::erase_if(contacts_, [&](const auto& entry) {
    const auto& [pair, contact] = entry;
    if (tick - contact.touched < apart) return false;
    add(v1::CONTACT_EVENT_KIND_ENDED, pair, contact.impulse,
        static_cast<double>(contact.touched - contact.begun + 1) * scene.tickSeconds());
    return true;
  });
}

}  // namespace clothstream::scene

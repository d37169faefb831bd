// SPDX-License-Identifier: MIT
#include "server/scene/grabs_and_attachments.h"

#include <algorithm>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {

GrabsAndAttachments::GrabsAndAttachments(const model::Scene& scene) {
  std::size_t attachments = 0;
  for (const model::Cloth& cloth : scene.cloths) attachments += cloth.attachments.size();
  moved_.resize(attachments);
}

GrabsAndAttachments::Slot* GrabsAndAttachments::find(std::uint64_t participant, std::uint32_t id) {
  const auto found = std::ranges::find_if(slots_, [&](const Slot& slot) {
    const bool held = slot.phase == Slot::Phase::takes || slot.phase == Slot::Phase::holds;
    return held && slot.participant == participant && slot.now.id == id;
  });
  return found == slots_.end() ? nullptr : &*found;
}

void GrabsAndAttachments::place(std::uint64_t participant, std::span<const model::Grab> grabs,
                                std::span<const model::AttachmentPose> attachments) {
  for (const model::AttachmentPose& put : attachments) moved_[put.attachment] = put.pose;
  for (Slot& slot : slots_) {
    const bool wanted = std::ranges::find(grabs, slot.now.id, &model::Grab::id) != grabs.end();
    if (slot.phase == Slot::Phase::empty || slot.participant != participant || wanted) continue;
    // The device does not know a grab that has not begun.
    slot.phase = slot.phase == Slot::Phase::takes ? Slot::Phase::empty : Slot::Phase::ends;
  }
  for (const model::Grab& grab : grabs) {
    if (Slot* known = find(participant, grab.id)) {
      known->now = grab;
      continue;
    }
    auto place = std::ranges::find(slots_, Slot::Phase::empty, &Slot::phase);
    if (place == slots_.end()) {
      if (slots_.size() == simulation::kMaxGrabs) return;
      place = slots_.emplace(place);
    }
    *place = {participant, grab, grab.pose, Slot::Phase::takes};
  }
}

void GrabsAndAttachments::advance(const model::Scene& scene, double endSeconds,
                                  simulation::TickInputs& inputs) {
  inputs.attachments.clear();
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments) {
      const std::optional<model::Pose>& moved = moved_[inputs.attachments.size()];
      inputs.attachments.push_back(moved ? *moved : model::frameAt(scene, attachment, endSeconds));
    }
  while (!slots_.empty() && slots_.back().phase == Slot::Phase::empty) slots_.pop_back();
  inputs.grabs.clear();
  released_.clear();
  for (Slot& slot : slots_) {
    simulation::Grab& grab = inputs.grabs.emplace_back();
    if (slot.phase == Slot::Phase::ends) released_.emplace_back(slot.participant, slot.now.id);
    if (slot.phase == Slot::Phase::empty || slot.phase == Slot::Phase::ends) {
      slot.phase = Slot::Phase::empty;
      continue;
    }
    const bool takes = slot.phase == Slot::Phase::takes;
    grab = {.state = takes ? simulation::Grab::State::takes : simulation::Grab::State::holds,
            .start = takes ? slot.now.pose : slot.before,
            .end = slot.now.pose,
            .radius = slot.now.radius,
            .reach = slot.now.reach,
            .maxForce = slot.now.maxForce,
            .slipDistance = slot.now.slipDistance};
    slot.before = slot.now.pose;
    slot.phase = Slot::Phase::holds;
  }
}

void GrabsAndAttachments::addEvents(std::span<const simulation::GrabStatus> grabs, v1::TickEvents& events) {
  const auto add = [&](std::uint64_t participant, std::uint32_t id, v1::GrabEventKind kind,
                       std::uint32_t vertices) {
    v1::GrabEvent& event = *events.add_grabs();
    event.set_participant_id(participant);
    event.set_grab_id(id);
    event.set_kind(kind);
    event.set_vertices(vertices);
  };
  for (const auto& [participant, id] : released_) add(participant, id, v1::GRAB_EVENT_KIND_RELEASED, 0);
  for (std::size_t i = 0; i < grabs.size(); ++i) {
    Slot& slot = slots_[i];
    if (slot.phase != Slot::Phase::holds) continue;
    const std::uint32_t vertices = grabs[i].taken - grabs[i].slipped;
    if (slot.vertices == vertices) continue;
    add(slot.participant, slot.now.id,
        slot.vertices ? v1::GRAB_EVENT_KIND_SLIPPED : v1::GRAB_EVENT_KIND_TAKEN, vertices);
    slot.vertices = vertices;
  }
}

bool GrabsAndAttachments::anyGrabHolds() const {
  return std::ranges::find(slots_, Slot::Phase::holds, &Slot::phase) != slots_.end();
}

void GrabsAndAttachments::restartGrabs() {
  for (Slot& slot : slots_)
    if (slot.phase == Slot::Phase::holds) {
      slot.phase = Slot::Phase::takes;
      slot.vertices.reset();
    }
}

}  // namespace clothstream::scene

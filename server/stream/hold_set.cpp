// SPDX-License-Identifier: MIT
// What holds cloth from tick to tick.
#include "server/stream/hold_set.h"

#include <algorithm>

namespace clothstream::stream {

HoldSet::HoldSet(const model::Scene& scene) {
  std::size_t attachments = 0;
  for (const model::Cloth& cloth : scene.cloths) attachments += cloth.attachments.size();
  moved_.resize(attachments);
}

HoldSet::Holder* HoldSet::find(std::uint64_t participant, std::uint32_t id) {
  const auto found = std::ranges::find_if(holders_, [&](const Holder& holder) {
    const bool held = holder.phase == Holder::Phase::takes || holder.phase == Holder::Phase::holds;
    return held && holder.participant == participant && holder.now.id == id;
  });
  return found == holders_.end() ? nullptr : &*found;
}

void HoldSet::place(std::uint64_t participant, std::span<const model::Grab> grabs,
                    std::span<const model::AttachmentPose> attachments) {
  for (const model::AttachmentPose& put : attachments) moved_[put.attachment] = put.pose;
  for (Holder& holder : holders_) {
    const bool wanted = std::ranges::find(grabs, holder.now.id, &model::Grab::id) != grabs.end();
    if (holder.phase == Holder::Phase::empty || holder.participant != participant || wanted) continue;
    // The device never heard of one that has not begun.
    holder.phase = holder.phase == Holder::Phase::takes ? Holder::Phase::empty : Holder::Phase::ends;
  }
  for (const model::Grab& grab : grabs) {
    if (Holder* known = find(participant, grab.id)) {
      known->now = grab;
      continue;
    }
    auto place = std::ranges::find(holders_, Holder::Phase::empty, &Holder::phase);
    if (place == holders_.end()) {
      if (holders_.size() == simulation::kMaxGrabs) return;
      place = holders_.emplace(place);
    }
    *place = {participant, grab, grab.pose, Holder::Phase::takes};
  }
}

void HoldSet::advance(const model::Scene& scene, double endSeconds, simulation::TickInputs& inputs) {
  inputs.attachments.clear();
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments) {
      const std::optional<model::Pose>& moved = moved_[inputs.attachments.size()];
      inputs.attachments.push_back(moved ? *moved : model::frameAt(scene, attachment, endSeconds));
    }
  while (!holders_.empty() && holders_.back().phase == Holder::Phase::empty) holders_.pop_back();
  inputs.grabs.clear();
  released_.clear();
  for (Holder& holder : holders_) {
    simulation::Grab& grab = inputs.grabs.emplace_back();
    if (holder.phase == Holder::Phase::ends) released_.emplace_back(holder.participant, holder.now.id);
    if (holder.phase == Holder::Phase::empty || holder.phase == Holder::Phase::ends) {
      holder.phase = Holder::Phase::empty;
      continue;
    }
    const bool takes = holder.phase == Holder::Phase::takes;
    grab = {.state = takes ? simulation::Grab::State::takes : simulation::Grab::State::holds,
            .start = takes ? holder.now.pose : holder.before,
            .end = holder.now.pose,
            .radius = holder.now.radius,
            .reach = holder.now.reach,
            .maxForce = holder.now.maxForce,
            .slipDistance = holder.now.slipDistance};
    holder.before = holder.now.pose;
    holder.phase = Holder::Phase::holds;
  }
}

void HoldSet::addEvents(std::span<const simulation::GrabStatus> grabs,
                        google::protobuf::RepeatedPtrField<v1::GrabEvent>& events) {
  const auto add = [&](std::uint64_t participant, std::uint32_t id, v1::GrabEventKind kind,
                       std::uint32_t vertices) {
    v1::GrabEvent& event = *events.Add();
    event.set_participant_id(participant);
    event.set_grab_id(id);
    event.set_kind(kind);
    event.set_vertices(vertices);
  };
  for (const auto& [participant, id] : released_) add(participant, id, v1::GRAB_EVENT_KIND_RELEASED, 0);
  for (std::size_t i = 0; i < grabs.size(); ++i) {
    Holder& holder = holders_[i];
    if (holder.phase != Holder::Phase::holds) continue;
    const std::uint32_t vertices = grabs[i].taken - grabs[i].slipped;
    if (holder.vertices == vertices) continue;
    add(holder.participant, holder.now.id,
        holder.vertices ? v1::GRAB_EVENT_KIND_SLIPPED : v1::GRAB_EVENT_KIND_TAKEN, vertices);
    holder.vertices = vertices;
  }
}

bool HoldSet::holds() const {
  return std::ranges::find(holders_, Holder::Phase::holds, &Holder::phase) != holders_.end();
}

void HoldSet::takeAnew() {
  for (Holder& holder : holders_)
    if (holder.phase == Holder::Phase::holds) {
      holder.phase = Holder::Phase::takes;
      holder.vertices.reset();
    }
}

}  // namespace clothstream::stream

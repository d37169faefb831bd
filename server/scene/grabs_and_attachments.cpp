// SPDX-License-Identifier: MIT
#include "server/scene/grabs_and_attachments.h"

#include <algorithm>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/model/jump.h"
#include "server/model/mesh.h"
#include "server/scene/collider_shares.h"
#include "server/scene/hand_limits.h"

namespace clothstream::scene {
namespace {

simulation::WeightedNodes nodesOf(const model::Scene& scene, const model::ClothPoint& point) {
  std::uint32_t firstNode = 0;
  for (std::uint32_t cloth = 0; cloth < point.cloth; ++cloth) firstNode += scene.cloths[cloth].nodeCount();
  const model::Triangle triangle = model::triangleAt(scene.cloths[point.cloth], point.triangle);
  return {.nodes = {firstNode + triangle[0], firstNode + triangle[1], firstNode + triangle[2]},
          .weights = {1 - point.second - point.third, point.second, point.third}};
}

// Part of the distance between frame and place that is left this many ticks after the grab started. It falls
// from 1 to 0 along a cubic whose slope is 0 at both ends.
float distanceLeft(std::uint32_t age, double tickSeconds) {
  const double part = age * tickSeconds / model::kGrabDrawSeconds;
  return part >= 1 ? 0 : static_cast<float>(1 - part * part * (3 - 2 * part));
}

}  // namespace

GrabsAndAttachments::GrabsAndAttachments(const model::Scene& scene) {
  std::size_t attachments = 0;
  for (const model::Cloth& cloth : scene.cloths) attachments += cloth.attachments.size();
  state_.moved.resize(attachments);
  clothsWentBack(scene, true);
}

void GrabsAndAttachments::clothsWentBack(const model::Scene& scene, bool toStart) {
  state_.frames.clear();
  if (!toStart) return;
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments)
      state_.frames.push_back(model::frameAt(scene, attachment, 0));
}

GrabsAndAttachments::Slot* GrabsAndAttachments::find(std::uint64_t participant, std::uint32_t id) {
  const auto found = std::ranges::find_if(state_.slots, [&](const Slot& slot) {
    const bool held = slot.phase == Slot::Phase::takes || slot.phase == Slot::Phase::holds;
    return held && slot.participant == participant && slot.now.id == id;
  });
  return found == state_.slots.end() ? nullptr : &*found;
}

void GrabsAndAttachments::place(std::uint64_t participant, std::span<const model::Grab> grabs,
                                std::span<const model::AttachmentPose> attachments) {
  for (const model::AttachmentPose& put : attachments) {
    state_.moved[put.attachment] = put.pose;
    if (put.jumps) toldToJump_.push_back(put.attachment);
  }
  for (Slot& slot : state_.slots) {
    const bool wanted = std::ranges::find(grabs, slot.now.id, &model::Grab::id) != grabs.end();
    if (slot.phase == Slot::Phase::empty || slot.participant != participant || wanted) continue;
    release(slot);
  }
  for (const model::Grab& grab : grabs) {
    if (Slot* known = find(participant, grab.id)) {
      const std::optional<model::GrabPlace> place = known->now.place;
      known->now = grab;
      known->now.place = place;
      continue;
    }
    auto place = std::ranges::find(state_.slots, Slot::Phase::empty, &Slot::phase);
    if (place == state_.slots.end()) {
      if (state_.slots.size() == simulation::kMaxGrabs) return;
      place = state_.slots.emplace(place);
    }
    *place = {participant, grab, grab.pose, Slot::Phase::takes, ++newest_};
  }
}

// The device does not know a grab that has not begun.
void GrabsAndAttachments::release(Slot& slot) {
  if (slot.phase == Slot::Phase::empty) return;
  slot.phase = slot.phase == Slot::Phase::takes ? Slot::Phase::empty : Slot::Phase::ends;
}

bool GrabsAndAttachments::isTouched() const {
  return std::ranges::any_of(state_.slots,
                             [](const Slot& slot) { return slot.phase != Slot::Phase::empty; }) ||
         std::ranges::any_of(state_.moved, [](const auto& moved) { return moved.has_value(); });
}

void GrabsAndAttachments::letGo() {
  std::ranges::for_each(state_.slots, release);
  std::ranges::fill(state_.moved, std::nullopt);
  toldToJump_.clear();
}

float GrabsAndAttachments::forceOfEach(float most) {
  std::vector<double>& wanted = wantedForces_;
  wanted.clear();
  for (const Slot& slot : state_.slots)
    if ((slot.phase == Slot::Phase::takes || slot.phase == Slot::Phase::holds) && slot.vertices != 0u)
      wanted.push_back(std::min(slot.now.maxForce, most));
  const double together = std::max(double{most}, double{kLeastMaxForce} * static_cast<double>(wanted.size()));
  return static_cast<float>(std::min(double{most}, fairShare(wanted, together)));
}

void GrabsAndAttachments::advance(const model::Scene& scene, double endSeconds,
                                  simulation::TickInputs& inputs) {
  inputs.attachments.clear();
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments) {
      const std::optional<model::Pose>& moved = state_.moved[inputs.attachments.size()];
      inputs.attachments.push_back(moved ? *moved : model::frameAt(scene, attachment, endSeconds));
    }
  inputs.carries.clear();
  if (!state_.frames.empty())
    inputs.carries = model::carriesOf(scene, state_.frames, inputs.attachments, toldToJump_);
  toldToJump_.clear();
  state_.frames = inputs.attachments;
  while (!state_.slots.empty() && state_.slots.back().phase == Slot::Phase::empty) state_.slots.pop_back();
  inputs.grabs.clear();
  released_.clear();
  const float mostForce = forceOfEach(maxGrabForce(scene));
  const float mostWay = kMaxHandSpeed * static_cast<float>(scene.tickSeconds());
  for (Slot& slot : state_.slots) {
    simulation::Grab& grab = inputs.grabs.emplace_back();
    if (slot.phase == Slot::Phase::ends) released_.emplace_back(slot.participant, slot.now.id);
    if (slot.phase == Slot::Phase::empty || slot.phase == Slot::Phase::ends) {
      slot.phase = Slot::Phase::empty;
      continue;
    }
    const bool takes = slot.phase == Slot::Phase::takes;
    const float held = slot.now.radius + slot.now.reach;
    const model::Pose start = takes ? slot.now.pose : slot.before;
    grab = {.state = takes ? simulation::Grab::State::takes : simulation::Grab::State::holds,
            .start = start,
            .end = towards(held, start, slot.now.pose, mostWay),
            .radius = slot.now.radius,
            .reach = slot.now.reach,
            .maxForce = std::min(slot.now.maxForce, mostForce),
            .slipDistance = slot.now.slipDistance};
    if (takes) slot.age = 0;
    if (slot.now.place) {
      if (takes) grab.place = nodesOf(scene, slot.now.place->point);
      grab.leftAtStart = distanceLeft(slot.age, scene.tickSeconds());
      grab.leftAtEnd = distanceLeft(slot.age + 1, scene.tickSeconds());
    }
    ++slot.age;
    slot.before = grab.end;
    slot.phase = Slot::Phase::holds;
  }
}

void GrabsAndAttachments::addEvents(std::span<const simulation::GrabStatus> grabs, v1::TickEvents& events) {
  const auto add = [&](std::uint64_t participant, std::uint32_t id, v1::GrabEventKind kind,
                       std::uint32_t vertices) -> v1::GrabEvent& {
    v1::GrabEvent& event = *events.add_grabs();
    event.set_participant_id(participant);
    event.set_grab_id(id);
    event.set_kind(kind);
    event.set_vertices(vertices);
    return event;
  };
  for (const auto& [participant, id] : released_) add(participant, id, v1::GRAB_EVENT_KIND_RELEASED, 0);
  for (std::size_t i = 0; i < grabs.size(); ++i) {
    Slot& slot = state_.slots[i];
    if (slot.phase != Slot::Phase::holds) continue;
    const std::uint32_t vertices = grabs[i].taken - grabs[i].slipped;
    if (slot.vertices == vertices) continue;
    if (slot.vertices) {
      add(slot.participant, slot.now.id, v1::GRAB_EVENT_KIND_SLIPPED, vertices);
    } else {
      v1::GrabEvent& taken = add(slot.participant, slot.now.id, v1::GRAB_EVENT_KIND_TAKEN, vertices);
      taken.set_distance(grabs[i].offset.norm());
      const std::uint64_t seenTick = slot.now.place ? slot.now.place->seenTick : 0;
      if (seenTick != 0 && seenTick < events.tick()) taken.set_ticks_since_seen(events.tick() - seenTick);
    }
    slot.vertices = vertices;
  }
}

void GrabsAndAttachments::restore(State state) {
  state.moved.resize(state_.moved.size());
  state_ = std::move(state);
  for (const Slot& slot : state_.slots) newest_ = std::max(newest_, slot.number);
}

void GrabsAndAttachments::goBack(std::span<const Slot> then, simulation::HeldNodes& held) {
  state_.frames.clear();
  std::vector<bool> kept(held.grabs.size(), false);
  for (std::size_t i = 0; i < state_.slots.size(); ++i) {
    Slot& slot = state_.slots[i];
    if (slot.phase != Slot::Phase::holds && slot.phase != Slot::Phase::ends) continue;
    const bool same = i < kept.size() && i < then.size() && then[i].phase == Slot::Phase::holds &&
                      then[i].number == slot.number;
    if (same) {
      kept[i] = true;
      slot.age = then[i].age;
      if (slot.vertices != then[i].vertices) slot.vertices.reset();
    } else if (slot.phase == Slot::Phase::holds) {
      slot.phase = Slot::Phase::takes;
      slot.vertices.reset();
    }
  }
  std::erase_if(held.nodes, [&](const simulation::HeldNode& node) { return !kept[node.grab]; });
}

}  // namespace clothstream::scene

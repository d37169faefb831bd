// SPDX-License-Identifier: MIT
#include "server/scene/interaction.h"

#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/model/wind.h"

namespace clothstream::scene {
namespace {

// Maximum number of poses whose latency one frame measures; one for each participant and tick.
constexpr std::size_t kMaxPoseArrivals = 256;

}  // namespace

void Interaction::restore(ColliderSet::State colliders, GrabsAndAttachments::State grabs,
                          std::vector<HeldWinds::Placed> winds) {
  colliders_.restore(std::move(colliders));
  grabs_.restore(std::move(grabs));
  winds_.restore(std::move(winds));
}

void Interaction::add(Poses&& poses) {
  const model::ParticipantPoses& now = poses.now.poses;
  const bool moves = now.acts() || !now.attachments.empty() || !now.joints.empty();
  if (moves && arrivals_.size() < kMaxPoseArrivals) arrivals_.push_back(poses.now.arrival);
  poses_.add(std::move(poses));
}

void Interaction::place(Clock::time_point time) {
  poses_.place(time, [this](std::uint64_t participant, const model::ParticipantPoses& poses) {
    colliders_.place(participant, poses.colliders);
    colliders_.placeJoints(poses.joints);
    grabs_.place(participant, poses.grabs, poses.attachments);
    winds_.place(participant, poses.winds);
    contactRequests_.set(participant, poses.wantsContacts);
    constraintRequests_.set(participant, poses.wantsConstraints);
  });
}

void Interaction::letGo() {
  colliders_.letGo();
  grabs_.letGo();
  winds_.letGo();
  surfaces_.letGo();
  poses_.repeat();
}

void Interaction::advance(const model::Scene& scene, std::uint64_t tick, Recovery recovery, float windRoom,
                          const simulation::ClothSimulation* withSurfaces) {
  const double endSeconds = static_cast<double>(tick + 1) * scene.tickSeconds();
  if (recovery == Recovery::reset) colliders_.clothsWentBack(colliders_.followedAtStart());
  if (recovery == Recovery::rollback) colliders_.clothsWentBack();
  colliders_.advance(scene, endSeconds, inputs_.colliders);
  if (recovery != Recovery::none) grabs_.clothsWentBack(scene, recovery == Recovery::reset);
  grabs_.advance(scene, endSeconds, inputs_);
  inputs_.reportsContacts = contactRequests_.any();
  inputs_.namesConstraints = constraintRequests_.any();
  inputs_.environment = model::environmentAt(scene, tick);
  winds_.advance(scene, windRoom, inputs_.winds);
  surfaces_.advance(withSurfaces, inputs_);
}

void Interaction::takeArrivals(std::vector<Clock::time_point>& arrivals) {
  std::swap(arrivals, arrivals_);
  arrivals_.clear();
}

void Interaction::settle(const simulation::ClothSimulation& simulation) {
  simulation.readDepths(depths_);
  if (!depths_.empty()) colliders_.settle(depths_);
}

void Interaction::addEvents(const model::Scene& scene, const simulation::ClothSimulation& simulation,
                            v1::TickEvents& events) {
  simulation.readGrabs(grabStatuses_);
  grabs_.addEvents(grabStatuses_, events);
  simulation.readContacts(contactStatuses_);
  contacts_.addEvents(events.tick(), scene, colliders_, contactStatuses_, events);
}

}  // namespace clothstream::scene

// SPDX-License-Identifier: MIT
// Everything that acts on the cloths of a scene: colliders, grabs, attachments, winds and the environment.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/delivery/wire_types.h"
#include "server/model/scene.h"
#include "server/scene/collider_set.h"
#include "server/scene/contact_log.h"
#include "server/scene/grabs_and_attachments.h"
#include "server/scene/held_winds.h"
#include "server/scene/inbox.h"
#include "server/scene/journal.h"
#include "server/scene/pose_history.h"
#include "server/scene/requests.h"
#include "server/scene/surface_set.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::scene {

// Makes the inputs of the ticks from the scene and from the poses of its participants, and events from what
// the ticks report. Belongs to the device's thread.
class Interaction {
 public:
  // Starts at simulated time 0.
  explicit Interaction(const model::Scene& scene) : colliders_(scene), grabs_(scene) {}
  // Continues from a state of this scene.
  void restore(ColliderSet::State colliders, GrabsAndAttachments::State grabs,
               std::vector<HeldWinds::Placed> winds);

  // Adds poses that arrived since the last tick.
  void add(Poses&& poses);
  // Places what participants move as their poses are at this time.
  void place(Clock::time_point time);
  // Sets the surfaces of the real room, which act as soon as the device has them.
  void placeSurfaces(std::span<const RoomSurface> surfaces) { surfaces_.set(surfaces); }
  bool hasSurfaces() const { return !surfaces_.empty(); }
  // Participants act on nothing until they send poses again.
  void letGo();
  // Returns whether participants act on the cloth: by colliders, grabs, winds, or what they moved.
  bool isTouched() const {
    return colliders_.isTouched() || grabs_.isTouched() || !winds_.empty() || hasSurfaces();
  }

  // Makes the inputs of the tick after `tick`, before which the cloths have this recovery. The winds that
  // participants hold have at most the speed `windRoom` together, m/s. `withSurfaces` is the simulation of
  // the tick, if it is ready for surfaces of the real room; else null.
  void advance(const model::Scene& scene, std::uint64_t tick, Recovery recovery, float windRoom,
               const simulation::ClothSimulation* withSurfaces);
  // Inputs of the newest advance(), and the identities of their colliders.
  const simulation::TickInputs& inputs() const { return inputs_; }
  const ColliderSet& colliders() const { return colliders_; }
  // Swaps `arrivals` with the arrival times of the poses that were added since the last call.
  void takeArrivals(std::vector<Clock::time_point>& arrivals);

  // The tick is complete. The first accepts or refuses poses of colliders (ColliderSet::settle); the second
  // adds the events of the tick, which is events.tick().
  void settle(const simulation::ClothSimulation& simulation);
  void addEvents(const model::Scene& scene, const simulation::ClothSimulation& simulation,
                 v1::TickEvents& events);

  const GrabsAndAttachments::State& grabs() const { return grabs_.state(); }
  const std::vector<HeldWinds::Placed>& winds() const { return winds_.state(); }
  // The device keeps the state of the cloths after the newest tick, to which Recovery::rollback goes back.
  void keepState() { colliders_.keepFollowed(); }
  // The device goes back to a snapshot (GrabsAndAttachments::goBack), when joints had these poses.
  void goBack(std::span<const GrabsAndAttachments::Slot> then, const ColliderSet::Followed& followed,
              simulation::HeldNodes& held) {
    grabs_.goBack(then, held);
    colliders_.clothsWentBack(followed);
  }

 private:
  ColliderSet colliders_;
  GrabsAndAttachments grabs_;
  HeldWinds winds_;
  SurfaceSet surfaces_;
  ContactLog contacts_;
  Requests contactRequests_, constraintRequests_;
  PoseHistory poses_;
  std::vector<Clock::time_point> arrivals_;  // of poses that no frame has shown yet
  simulation::TickInputs inputs_;
  // Results of the tick, whose memory is reused.
  std::vector<float> depths_;
  std::vector<simulation::GrabStatus> grabStatuses_;
  std::vector<simulation::ContactStatus> contactStatuses_;
};

}  // namespace clothstream::scene

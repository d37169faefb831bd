// SPDX-License-Identifier: MIT
// Colliders of a scene from tick to tick: the scene's own and the participants'.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "server/delivery/wire_types.h"
#include "server/model/input.h"
#include "server/model/scene.h"
#include "server/scene/joint_follower.h"
#include "server/simulation/collision/moving_collider.h"

namespace clothstream::scene {

// A collider that jumps (model::hasJumped) is not swept: it appears at its new pose, at rest. So do the
// joints of a mesh. A collider of a participant that appears is at most kMaxAppearance deep, and grows from
// there by kGrowth.

// A collider of a participant yields to cloth that nothing passes through. It yields if a node is deeper
// inside than kYieldDepth (m), or than kYieldShare of the shape's least radius. It then returns to its last
// accepted pose, and approaches the pose that the participant gives in smaller steps. kLeastStep (m) is the
// least step in a tick.
inline constexpr float kYieldDepth = 0.005f;
inline constexpr float kYieldShare = 0.3f;
inline constexpr float kLeastStep = 0.001f;

// Belongs to the device's thread. The order does not depend on the order of arrival: the scene's colliders as
// defined, then the participants' by participant number and id.
class ColliderSet {
 public:
  // Starts at simulated time 0.
  explicit ColliderSet(const model::Scene& scene);

  // Sets all colliders of this participant. A known id moves to its new pose over the next tick, a new one
  // appears at rest, and a missing one is removed.
  void place(std::uint64_t participant, std::span<const model::ParticipantCollider> colliders);

  // Moves joints of colliders of the scene, in one tick or as fast as bodies move (JointFollower). They stay
  // there until they are moved again.
  void placeJoints(std::span<const model::ColliderJoints> moved);

  // Whether participants have colliders or have moved joints.
  bool isTouched() const;
  // Removes all colliders of participants. Joints that they moved follow their animation again.
  void letGo();

  // Advances to the end of the next tick, in seconds of simulated time. Writes all colliders, each with its
  // start and end pose, to `colliders`.
  void advance(const model::Scene& scene, double endSeconds,
               std::vector<simulation::MovingCollider>& colliders);

  // Accepts or refuses the poses of the newest advance(). `depths` has, for each collider that it wrote, the
  // depth of the deepest node of cloth that nothing passes through at the tick's end, in metres. Do not call
  // it for scenes without such cloth.
  void settle(std::span<const float> depths);

  // A collider of the scene has participant 0, and its index in the scene as id.
  struct Identity {
    std::uint64_t participant;
    std::uint32_t id;
    bool operator<(const Identity& other) const {
      return std::tie(participant, id) < std::tie(other.participant, other.id);
    }
  };
  // Identity of the collider that the newest advance() wrote at `index`.
  Identity identity(std::size_t index) const;

  // Replaces the colliders of `frame` by the present ones. `scene` must be that of the newest advance().
  void write(const model::Scene& scene, v1::Frame& frame) const;

  // A collider that cloth has hindered.
  struct Yield {
    model::Pose accepted;  // the newest pose that cloth had room for
    float depth = 0;       // m, of the deepest node there
    float step = 0;        // m, the longest motion in the next tick
    bool refused = false;  // true: it returns in the next tick
    bool stands = false;   // true: in the newest tick it did not reach the participant's pose
  };
  struct Placed {
    std::uint64_t participant;
    model::ParticipantCollider now;
    model::Pose before;          // at the end of the newest tick
    model::Pose start;           // at its start
    std::optional<Yield> yield;  // absent: it has moved as the participant said
    float depth = 0;             // m, of its shape in the newest tick; 0: it is new
  };
  // Joints of a collider of the scene, relative to their parents; empty if it has none.
  struct Joints {
    std::vector<model::Pose> now;     // at the tick's end
    std::vector<model::Pose> target;  // given by a message; empty: the animation moves the joints
    bool jumps = false;               // to the target in the next tick
  };
  // Everything that a later tick depends on, after a complete tick.
  struct State {
    std::vector<model::Pose> scenePoses;  // at the tick's end
    std::vector<Joints> joints;           // of the colliders of the scene
    std::vector<Placed> colliders;        // of participants, in their order
  };
  const State& state() const { return state_; }
  // Continues from a state of this scene.
  void restore(State state);

  // Poses of the scene's colliders and of their joints, where cloth follows them.
  struct Followed {
    std::vector<model::Pose> colliders;
    std::vector<std::vector<model::Pose>> joints;  // relative to their parents; empty without joints
  };
  // Those after the newest tick, and those of the scene's start.
  Followed followed() const;
  const Followed& followedAtStart() const { return start_; }
  // Keeps those after the newest tick, because the device keeps the state of the cloths.
  void keepFollowed();
  // The cloths went back to the kept state, or to one at which the joints had these poses. In the next tick,
  // cloth that follows joints is taken along to where they are now.
  void clothsWentBack() { takesAlong_ = true; }
  void clothsWentBack(const Followed& then);

 private:
  void advanceJoints(const model::Skin& skin, double endSeconds, double tickSeconds, std::size_t index,
                     simulation::MovingCollider& collider);
  // Lets cloth that follows the joints of this collider go along from where they were when the cloth was
  // kept.
  void takeAlong(const model::Skin& skin, std::size_t index, simulation::MovingCollider& collider) const;

  State state_;
  Followed start_, kept_;
  bool takesAlong_ = false;
  std::vector<std::optional<JointFollower>> followers_;  // of the colliders of the scene
  std::vector<model::Pose> end_;                         // reused in every tick
};

}  // namespace clothstream::scene

// SPDX-License-Identifier: MIT
// Grabs of the participants and poses of the attachments, from tick to tick.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/delivery/wire_types.h"
#include "server/model/input.h"
#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::scene {

// Belongs to the device's thread. Grabs follow their participants at most at kMaxHandSpeed, with at most
// maxGrabForce() (hand_limits.h), which they share evenly.
class GrabsAndAttachments {
 public:
  explicit GrabsAndAttachments(const model::Scene& scene);

  // Sets all grabs of this participant. A known id moves to its new pose over the next tick, a new one starts
  // at the beginning of that tick, and a missing one is released. Attachments move to their pose and stay
  // there. A new grab has no effect while there are kMaxGrabs grabs.
  void place(std::uint64_t participant, std::span<const model::Grab> grabs,
             std::span<const model::AttachmentPose> attachments);

  // Whether participants have grabs or have moved attachments.
  bool isTouched() const;
  // Releases all grabs. Attachments that participants moved follow their own motion again.
  void letGo();

  // The cloths went back: to their start, from where attachments that are elsewhere carry them along, or to
  // an earlier state, from where they catch up.
  void clothsWentBack(const model::Scene& scene, bool toStart);

  // Writes grabs, attachments and what they carry along in the next tick, which ends at this simulated time
  // in seconds.
  void advance(const model::Scene& scene, double endSeconds, simulation::TickInputs& inputs);

  // Adds events for the grabs of tick `events.tick()`, which is the newest and complete. `grabs` is the
  // simulation's result.
  void addEvents(std::span<const simulation::GrabStatus> grabs, v1::TickEvents& events);

  // Entry at the index of TickInputs::grabs.
  struct Slot {
    std::uint64_t participant = 0;
    model::Grab now;
    model::Pose before;
    enum class Phase : std::uint8_t { empty, takes, holds, ends } phase = Phase::empty;
    std::uint64_t number = 0;  // of the grab, counted from 1; no two grabs have the same
    // Vertices held after the newest tick; nothing before the grab's first tick.
    std::optional<std::uint32_t> vertices = {};
    std::uint32_t age = 0;  // ticks since the grab started
  };
  // Everything that a later tick depends on, after a complete tick.
  struct State {
    std::vector<std::optional<model::Pose>> moved;  // poses of attachments that were moved by a message
    std::vector<Slot> slots;
    // Poses of the attachments at the end of the newest tick. Empty: the cloths are not where these took
    // them, and catch up at kMaxAttachmentSpeed.
    std::vector<model::Pose> frames;
  };
  const State& state() const { return state_; }
  // Continues from a state of this scene. The device must hold what its grabs hold.
  void restore(State state);

  // The device goes back to a snapshot, when the slots were `then`. Grabs that held cloth then and still do
  // keep what they held. Younger ones start again. Removes from `held` what ended since.
  void goBack(std::span<const Slot> then, simulation::HeldNodes& held);

 private:
  Slot* find(std::uint64_t participant, std::uint32_t id);
  static void release(Slot& slot);
  // Largest force of each grab, N: those that hold something, or may do so, share it. `most` is
  // maxGrabForce().
  float forceOfEach(float most);

  State state_;
  std::vector<std::size_t> toldToJump_;                            // attachments, in the next tick
  std::vector<double> wantedForces_;                               // of grabs, N; reused in every tick
  std::uint64_t newest_ = 0;                                       // number of the newest grab
  std::vector<std::pair<std::uint64_t, std::uint32_t>> released_;  // in the current tick: participant, id
};

}  // namespace clothstream::scene

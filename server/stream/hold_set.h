// SPDX-License-Identifier: MIT
// What holds cloth from tick to tick: where attachments go, and the participants' grabs.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <google/protobuf/repeated_ptr_field.h>

#include "clothstream/v1/session.pb.h"
#include "server/model/input.h"
#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::stream {

// Belongs to the device's thread.
class HoldSet {
 public:
  explicit HoldSet(const model::Scene& scene);

  // All grabs of this participant: a known id moves there over the next tick, a new one takes hold at its
  // start, one that is missing lets go. Attachments go where they are put, and stay. Where kMaxGrabs grabs
  // hold cloth already, a new one holds nothing.
  void place(std::uint64_t participant, std::span<const model::Grab> grabs,
             std::span<const model::AttachmentPose> attachments);

  // The next tick, which ends at this simulated time: its attachments and grabs.
  void advance(const model::Scene& scene, double endSeconds, simulation::TickInputs& inputs);

  // What became of the grabs of the last tick, which is complete: `grabs` is what the simulation says of
  // them.
  void addEvents(std::span<const simulation::GrabStatus> grabs,
                 google::protobuf::RepeatedPtrField<v1::GrabEvent>& events);

  // Whether some grab holds cloth.
  bool holds() const;

  // The device forgot what was held: every grab takes hold anew.
  void takeAnew();

 private:
  // A place in TickInputs::grabs.
  struct Holder {
    std::uint64_t participant = 0;
    model::Grab now;
    model::Pose before;
    enum class Phase : std::uint8_t { empty, takes, holds, ends } phase = Phase::empty;
    std::optional<std::uint32_t> vertices = {};  // that it held after the last tick; none: it has not begun
  };

  Holder* find(std::uint64_t participant, std::uint32_t id);

  std::vector<std::optional<model::Pose>> moved_;  // attachments that somebody put somewhere
  std::vector<Holder> holders_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> released_;  // in the tick in hand: participant, id
};

}  // namespace clothstream::stream

// SPDX-License-Identifier: MIT
// What holds cloth, in double precision: attachments, tethers, grabs.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/model/tethers.h"
#include "server/reference/contact.h"
#include "server/reference/reference_cloth.h"

namespace clothstream::reference {

// Moves from start to end over a tick's substeps; as simulation::Grab says.
struct Grab {
  enum class State : std::uint8_t { free, holds, takes };
  State state = State::free;
  Pose start = {}, end = {};
  double radius = 0.03, reach = 0.1;
  double maxForce = 20;
  double slipDistance = 0.1;
};

class Attachments {
 public:
  explicit Attachments(const model::Scene& scene);

  // A tick's start: attached nodes get the velocity that takes them to their frames' places at its end, at
  // most model::kMaxAttachmentSpeed; no frames: where they start. Grabs that begin take hold.
  void begin(std::vector<ReferenceCloth>& cloths, std::span<const Pose> frames, std::span<const Grab> grabs,
             double tickSeconds);
  // The end of a substep.
  void apply(std::vector<ReferenceCloth>& cloths, std::span<const Grab> grabs, std::uint32_t substep,
             std::uint32_t substeps, double tickSeconds);

  // Of each grab: nodes that it took hold of, and those that slipped away since.
  struct Status {
    std::uint32_t taken = 0, slipped = 0;
  };
  const std::vector<Status>& status() const { return status_; }

 private:
  struct Attached {
    std::size_t cloth, node, frame;
    Vec3 place;  // in the frame
  };
  struct Held {
    std::size_t grab;
    Vec3 place;  // in the grab
  };

  std::vector<Pose> start_;
  std::vector<Attached> attached_;
  std::vector<std::vector<model::NodeTethers>> tethers_;  // of each cloth; empty: it has none
  std::vector<double> slack_;
  std::vector<std::vector<std::optional<Held>>> held_;  // of each cloth's nodes
  std::vector<Status> status_;
};

}  // namespace clothstream::reference

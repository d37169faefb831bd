// SPDX-License-Identifier: MIT
// What holds cloth, in double precision: attachments, tethers, grips.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/reference/contact.h"
#include "server/reference/reference_cloth.h"
#include "server/scene/scene.h"
#include "server/scene/tethers.h"

namespace clothstream::reference {

// Moves from start to end over a tick's substeps; as simulation::Grip says.
struct Grip {
  enum class State : std::uint8_t { free, holds, takes };
  State state = State::free;
  Pose start = {}, end = {};
  double radius = 0.03, reach = 0.1;
  double maxForce = 20;
  double slipDistance = 0.1;
};

class Holds {
 public:
  explicit Holds(const scene::Scene& scene);

  // A tick's start: attached nodes get the velocity that takes them to their frames' places at its end, at
  // most scene::kMaxAttachmentSpeed; no frames: where they start. Grips that begin take hold.
  void begin(std::vector<ReferenceCloth>& cloths, std::span<const Pose> frames, std::span<const Grip> grips,
             double tickSeconds);
  // The end of a substep.
  void apply(std::vector<ReferenceCloth>& cloths, std::span<const Grip> grips, std::uint32_t substep,
             std::uint32_t substeps, double tickSeconds);

  // Of each grip: nodes that it took hold of, and those that slipped away since.
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
    std::size_t grip;
    Vec3 place;  // in the grip
  };

  std::vector<Pose> start_;
  std::vector<Attached> attached_;
  std::vector<std::vector<scene::NodeTethers>> tethers_;  // of each cloth; empty: it has none
  std::vector<double> slack_;
  std::vector<std::vector<std::optional<Held>>> held_;  // of each cloth's nodes
  std::vector<Status> status_;
};

}  // namespace clothstream::reference

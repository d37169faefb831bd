// SPDX-License-Identifier: MIT
// Attachments, tethers and grabs, in double precision.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/model/tethers.h"
#include "server/reference/contact.h"
#include "server/reference/reference_cloth.h"

namespace clothstream::reference {

// Moves from start to end over a tick's substeps, as simulation::Grab does.
struct Grab {
  enum class State : std::uint8_t { free, holds, takes };
  State state = State::free;
  Pose start = {}, end = {};
  double radius = 0.03, reach = 0.1;
  double maxForce = 20;
  double slipDistance = 0.1;
  struct Place {
    std::size_t cloth = 0;
    std::array<std::size_t, 3> nodes = {};
    std::array<double, 3> weights = {};
  };
  std::optional<Place> place = {};
  double leftAtStart = 0, leftAtEnd = 0;
};

// Rigid motion of a whole cloth at the start of a tick, as model::Carry.
struct Carry {
  std::size_t cloth = 0;
  Pose from, to;
};

void carryAlong(ReferenceCloth& cloth, const Carry& carry);

class Attachments {
 public:
  explicit Attachments(const model::Scene& scene);

  // Starts a tick. Attached nodes get the velocity that takes them to their frames' places at its end, at
  // most model::kMaxAttachmentSpeed. Without `frames`, the frames stay where they start. Beginning grabs grab
  // nodes.
  void begin(std::vector<ReferenceCloth>& cloths, std::span<const Pose> frames, std::span<const Grab> grabs,
             double tickSeconds);
  // Ends a substep.
  void apply(std::vector<ReferenceCloth>& cloths, std::span<const Grab> grabs, std::uint32_t substep,
             std::uint32_t substeps, double tickSeconds);

  // Status of each grab: nodes that it grabbed, and grabbed nodes that slipped away since.
  struct Status {
    std::uint32_t taken = 0, slipped = 0;
    Vec3 offset = Vec3::Zero();  // from the grab's start to its place when it began
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
  std::vector<std::vector<model::NodeTethers>> tethers_;  // by cloth; empty if it has none
  std::vector<double> slack_;
  std::vector<std::vector<std::optional<Held>>> held_;  // by cloth and node
  std::vector<Status> status_;
};

}  // namespace clothstream::reference

// SPDX-License-Identifier: MIT
// Cloth that follows joints, in double precision.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/reference_cloth.h"

namespace clothstream::reference {

struct MovingCollider;

// Where joints take the nodes of cloths, and the limits on their distance from there.
class ClothSkins {
 public:
  explicit ClothSkins(const model::Scene& scene);

  // Starts a tick. Cloths whose joints jump go along, and nodes that follow exactly get the velocity that
  // takes them to their places at the tick's end.
  void begin(std::vector<ReferenceCloth>& cloths, std::span<const MovingCollider> colliders,
             double tickSeconds);
  // Applies the limits at the end of a substep.
  void apply(std::vector<ReferenceCloth>& cloths, std::uint32_t substep, std::uint32_t substeps,
             double tickSeconds) const;

 private:
  struct Skinned {
    std::size_t cloth;
    std::vector<Vec3> start, end, startNormals, endNormals;  // of the tick, by node
  };

  model::Scene scene_;
  std::vector<Skinned> skinned_;
};

}  // namespace clothstream::reference

// SPDX-License-Identifier: MIT
// Largest time step with which explicit integration of a cloth is stable.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

inline constexpr std::uint32_t kMaxSubsteps = 256;

// Maximum speed of the cloth in still air for which the bound includes air damping, m/s.
inline constexpr float kAirSpeed = 10;

// Maximum speed of the air that participants move with local winds, m/s.
inline constexpr float kMaxHeldSpeed = 800;

// Maximum stretch for which the bound of explicit Euler includes spring tension. [Va21] 3.3 calls a spring
// overstretched beyond it.
inline constexpr float kTensionStrain = 0.1f;

// Bound on the time step of the cloths of a scene. The constructor takes time linear in nodes, springs and
// pins; substeps() only depends on the few kinds of nodes that it found, so parameters can be checked often.
class StabilityBound {
 public:
  explicit StabilityBound(const Scene& scene);

  // Minimum number of substeps per tick, 1 to kMaxSubsteps, with which the scene's integrator is stable for
  // every cloth at the scene's simulation rate. 0 if kMaxSubsteps are not enough. `scene` is the scene of the
  // constructor, whose parameters may have changed since. For semi-implicit Euler this is a bound, not an
  // estimate: it holds for every shape of the cloth. The .cpp derives it with Gershgorin's circle theorem for
  // M^-1 K and M^-1 C. Explicit Euler always needs Cloth::damping too: dashpots act along springs only, and
  // motion across them is unstable.
  std::uint32_t substeps(const Scene& scene) const;

  // Speed in m/s that the air may have in addition to the scene's own winds, at most kMaxHeldSpeed: with this
  // number of substeps the scene is still stable. 0 if it is not stable without it.
  float roomForWind(const Scene& scene, std::uint32_t substeps) const;

  // Number of springs of each kind at a node.
  struct NodeSprings {
    std::uint32_t structural, shear, bend;
    double perMass;  // mass of the cloth divided by the mass of the lightest such node
  };

 private:
  struct ClothBound {
    std::vector<NodeSprings> nodes;  // every combination of counts at nodes that are not pinned
    double areaPerShare;             // largest area of a node divided by its share of the mass, m^2
    double bendingRate;              // bendingRate() of a cloth of 1 kg
  };
  // Whether a cloth is stable with steps of h seconds, if the air moves faster than the scene's by `added`.
  using Criterion = std::function<bool(double h, double added)>;
  Criterion criterionOf(const Scene& scene, std::size_t cloth) const;

  std::vector<ClothBound> cloths_;
};

// Largest factor, at most 1, by which the springs' stiffness can be multiplied so that semi-implicit Euler is
// stable with substeps of h seconds, with a tenth to spare. 0 if the damping alone is too much. Takes time
// linear in nodes and springs.
double bearableStiffness(const Cloth& cloth, double h);

// Factor of the stiffness with which the solver takes springs as forces: bearableStiffness() for
// AcadMode::limit, else 1.
double stiffnessShare(const Cloth& cloth, double h);

// StabilityBound(scene).substeps(scene).
std::uint32_t stableSubsteps(const Scene& scene);

}  // namespace clothstream::model

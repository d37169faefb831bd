// SPDX-License-Identifier: MIT
// Variants of the kernels that advance a scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::simulation {

// Code that a scene needs. The kernel leaves out the rest; the bits are the same.
struct AdvanceVariant {
  bool springDamping, air, colliders, springForces;
  bool localWinds;  // only with air
  // ACAD: the kernel finds out whether a spring may become too long. Of AcadMode::paper, such a spring has no
  // force.
  bool testsStretch, omitsStretched;

  std::size_t index() const {
    return (springDamping ? 1u : 0u) | (air ? 2u : 0u) | (colliders ? 4u : 0u) | (springForces ? 8u : 0u) |
           (testsStretch ? 16u : 0u) | (omitsStretched ? 32u : 0u) | (localWinds ? 64u : 0u);
  }
  static constexpr std::size_t kCount = 128;

  // Values of constant_id 1, 2, 3, ... The Runge-Kutta method consists of steps of explicit Euler.
  std::vector<std::uint32_t> specialisation(std::uint32_t rowsPerInvocation,
                                            model::Integrator integrator) const {
    return {rowsPerInvocation,
            springDamping ? 1u : 0u,
            air ? 1u : 0u,
            colliders ? 1u : 0u,
            integrator == model::Integrator::semiImplicitEuler ? 0u : 1u,
            springForces ? 1u : 0u,
            omitsStretched ? 1u : 0u,
            testsStretch ? 1u : 0u,
            localWinds ? 1u : 0u};
  }
};

}  // namespace clothstream::simulation

// SPDX-License-Identifier: MIT
// Solvers of docs/mechanics.md, and the cloth that they move.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "server/model/scene.h"
#include "tests/simulation/scenes.h"

namespace clothstream::mechanics {

// A solver with its name in the page.
struct Way {
  std::string name;
  model::Solver solver;
  // Whether every correction acts along the line between two nodes at the start of the substep. Angular
  // momentum then stays except for rounding.
  bool alongLines = true;
  // Whether the work has a mirror image, and no threshold that rounding decides. Sums of conjugate gradients
  // have an order.
  bool mirrored = true;
};

std::vector<Way> ways();
// The way of this name. Throws std::out_of_range if there is none.
Way wayNamed(std::string_view name);

// Letters and digits of a name in the page, for a test's name.
std::string lettersOf(const std::string& name);

// 8x8 nodes, 40 cm, 50 g, held 50 degrees from the vertical.
model::Cloth clothOf(const Way& way);

// Substeps of 1/288 s bear springs of 8 N/m as forces, those of 1/144 s bend springs of 1 N/m.
model::Scene sceneOf(const model::Cloth& cloth);

simulation::NodeState after(tests::Running& running, const model::Scene& scene, double seconds);

}  // namespace clothstream::mechanics

// SPDX-License-Identifier: MIT
// Materials bend as strips of cloth do in the laboratory.
#include "server/model/material.h"

#include <cmath>

#include <gtest/gtest.h>

#include "server/reference/reference_simulation.h"

namespace clothstream::reference {
namespace {

// ASTM D1388 in reverse: a strip of `parts` parts sticks out over an edge by twice its bending length.
// Returns the angle in degrees between the horizontal and the line from the edge to the end of the strip at
// rest. Implicit Euler is stable for springs of any stiffness.
double sag(const model::Material& material, std::uint32_t parts) {
  const double part = 2 * model::bendingLength(material) / parts;
  model::Cloth strip;
  strip.name = "strip";
  strip.grid = {.rows = parts + 2,
                .columns = 4,
                .width = static_cast<float>(3 * part),
                .height = static_cast<float>((parts + 1) * part),
                .pose = {}};
  strip.grid.pose.orientation = model::Quaternion(std::sqrt(0.5f), -std::sqrt(0.5f), 0, 0);
  model::makeOf(material, strip);
  strip.solver.kind = model::SolverKind::implicitEuler;
  strip.damping = 5;
  strip.drag = strip.lift = 0;
  strip.pins = {{.firstRow = 0, .lastRow = 1, .firstColumn = 0, .lastColumn = 3}};
  model::Scene scene;
  scene.substeps = 4;
  scene.cloths = {strip};
  ReferenceSimulation simulation(scene);
  while (simulation.ticks() < 2 * scene.simulationRate) simulation.tick();
  const auto positions = simulation.cloths()[0].positions();
  const Vec3 from = positions[4], to = positions[positions.size() - 4];
  return std::atan2(from.y() - to.y(), std::hypot(to.x() - from.x(), to.z() - from.z())) * 180 / 3.14159265;
}

TEST(Materials, HangOverAnEdgeAsTheirBendingLengthSays) {
  for (const model::Material& material : model::materials())
    for (const std::uint32_t parts : {3u, 4u, 6u})
      EXPECT_NEAR(sag(material, parts), 41.5, 8) << material.name << ", " << parts;
}

}  // namespace
}  // namespace clothstream::reference

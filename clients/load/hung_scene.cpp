// SPDX-License-Identifier: MIT
#include "clients/load/hung_scene.h"

#include <algorithm>
#include <cmath>

namespace clothstream::load {
namespace {

constexpr std::uint32_t kSubsteps = 10;
constexpr double kMass = 0.2;  // kg
// Parts of m / h^2, the stiffness at which one spring turns a node of mass m around within a substep h. They
// stay below the bound of server/model/stability.cpp together with the drag.
constexpr double kStructural = 0.2, kShear = 0.1, kBend = 0.02;

}  // namespace

v1::Scene hungScene(std::uint32_t nodes, std::uint32_t rate) {
  const auto rows = std::max(2u, static_cast<std::uint32_t>(std::lround(std::sqrt(nodes))));
  const auto columns =
      std::max(2u, static_cast<std::uint32_t>(std::lround(static_cast<double>(nodes) / rows)));
  const double substep = 1.0 / (double{kSubsteps} * rate);
  const double bearable = kMass / (static_cast<double>(rows) * columns) / (substep * substep);
  v1::Scene scene;
  scene.set_simulation_rate(rate);
  scene.set_stream_rate(rate);
  scene.set_substeps(kSubsteps);
  scene.mutable_environment()->mutable_wind()->set_z(4);
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  v1::Grid& grid = *cloth.mutable_grid();
  grid.set_rows(rows);
  grid.set_columns(columns);
  grid.set_width(1);
  grid.set_height(1);
  grid.mutable_pose()->mutable_position()->set_y(2);
  cloth.set_mass(static_cast<float>(kMass));
  cloth.mutable_structural()->set_stiffness(static_cast<float>(kStructural * bearable));
  cloth.mutable_shear()->set_stiffness(static_cast<float>(kShear * bearable));
  cloth.mutable_bend()->set_stiffness(static_cast<float>(kBend * bearable));
  cloth.set_damping(0.5f);
  cloth.set_drag(0.1f);
  v1::GridRange& corners = *cloth.add_pins();
  corners.set_last_column(columns - 1);
  corners.set_column_step(columns - 1);
  return scene;
}

}  // namespace clothstream::load

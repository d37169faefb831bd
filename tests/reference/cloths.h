// SPDX-License-Identifier: MIT
// Cloths that several tests of the reference start from.
#pragma once

#include <random>

#include "server/model/scene.h"
#include "server/reference/reference_cloth.h"

namespace clothstream::reference {

inline const model::Environment kWeightless{
    .gravity = model::Vec3::Zero(), .wind = model::Vec3::Zero(), .airDensity = 0};

// Nodes 0.1 m apart and of 0.01 kg, with structural springs alone.
inline model::Cloth sheet(std::uint32_t rows, std::uint32_t columns) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid.rows = rows;
  cloth.grid.columns = columns;
  cloth.grid.width = 0.1f * static_cast<float>(columns - 1);
  cloth.grid.height = 0.1f * static_cast<float>(rows - 1);
  cloth.mass = 0.01f * static_cast<float>(rows * columns);
  cloth.structural = {100, 0};
  return cloth;
}

inline model::Cloth sheetWithAllSprings(std::uint32_t rows, std::uint32_t columns) {
  model::Cloth cloth = sheet(rows, columns);
  cloth.structural = {100, 0.01f};
  cloth.shear = {60, 0.02f};
  cloth.bend = {30, 0.03f};
  return cloth;
}

inline void shake(ReferenceCloth& cloth, double metres, double metresPerSecond) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Vec3(unit(random), unit(random), unit(random)); };
  for (std::size_t i = 0; i < cloth.nodeCount(); ++i)
    if (cloth.inverseMasses()[i] > 0) {
      cloth.positions()[i] += metres * vector();
      cloth.velocities()[i] += metresPerSecond * vector();
    }
}

}  // namespace clothstream::reference

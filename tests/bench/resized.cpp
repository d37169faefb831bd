// SPDX-License-Identifier: MIT
#include "tests/bench/resized.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "server/model/stability.h"

namespace clothstream::bench {

void resize(model::Cloth& cloth, std::uint32_t size) {
  const auto coarser = [&] {
    return std::max(model::spacing(cloth.grid).column, model::spacing(cloth.grid).row);
  };
  const float before = coarser();
  const auto scaled = [size](std::uint32_t place, std::uint32_t nodes) {
    return static_cast<std::uint32_t>(std::lround(1.0 * place * (size - 1) / (nodes - 1)));
  };
  for (model::GridRange& pins : cloth.pins) {
    for (std::uint32_t* row : {&pins.firstRow, &pins.lastRow, &pins.rowStep})
      *row = scaled(*row, cloth.grid.rows);
    for (std::uint32_t* column : {&pins.firstColumn, &pins.lastColumn, &pins.columnStep})
      *column = scaled(*column, cloth.grid.columns);
    pins.rowStep = std::max(pins.rowStep, 1u);
    pins.columnStep = std::max(pins.columnStep, 1u);
  }
  cloth.grid.rows = cloth.grid.columns = size;
  if (cloth.selfCollision) cloth.selfCollision->radius *= coarser() / before;
}

void raiseSubsteps(model::Scene& scene) {
  const std::uint32_t substeps = model::stableSubsteps(scene);
  if (substeps == 0)
    throw std::runtime_error(fmt::format("{} has no stable time step at this size", scene.name));
  scene.substeps = std::max(scene.substeps, substeps);
}

}  // namespace clothstream::bench

// SPDX-License-Identifier: MIT
// Parts of the suite garment.
#pragma once

#include "server/vulkan/device.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {

// A sheet on a box, and on surfaces of a real room with 1,000 to 100,000 triangles.
void addSurfaces(vulkan::Device& device, const Settings& settings, const RowSink& add);
// One and ten dressed figures.
void addFigures(vulkan::Device& device, const Settings& settings, const RowSink& add);
// Compares the time that limits, gas and surfaces add to a tick with their price.
void addPrices(vulkan::Device& device, const Settings& settings, const RowSink& add);

}  // namespace clothstream::bench

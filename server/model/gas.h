// SPDX-License-Identifier: MIT
// Gas inside a closed cloth: its volume, and its isothermal law.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/model/mesh.h"
#include "server/model/scene.h"

namespace clothstream::model {

// Pressure outside, Pa: the standard atmosphere at sea level, ISO 2533:1975.
inline constexpr double kOutsidePressure = 101'325;
// Smallest volume at rest that gas can have, m^3: a cube with edges of 1 cm. Volumes in single precision then
// keep six digits.
inline constexpr double kMinGasVolume = 1e-6;

// True if the cloth holds gas now.
inline bool hasGas(const Cloth& cloth) {
  return cloth.pressure != 0;
}

// True if the cloth is a closed mesh that can hold gas.
bool canHoldGas(const Cloth& cloth);
// Why the cloth cannot hold gas, for people; nullopt if it can.
std::optional<std::string> unfitForGas(const Cloth& cloth);

// Volume inside a closed surface, m^3, by the divergence theorem; negative if its fronts are inside. Takes
// the places relative to the first one, so that a surface far from zero loses no digits.
double enclosedVolume(std::span<const Triangle> triangles, std::span<const Eigen::Vector3d> positions);

// Gradient of that volume by the place of each node, m^2: a third of the area vectors of its triangles. The
// force of the gas on a node is its pressure times this. The sum of all is zero.
std::vector<Eigen::Vector3d> volumeGradients(std::span<const Triangle> triangles,
                                             std::span<const Eigen::Vector3d> positions);

// Pressure of the gas above the pressure outside, as a fraction of the latter, that fulfils
//
//   (1 + result) (volume + response * result) = 1 + atRest.
//
// `atRest` is the result at the volume at rest, above -1. `volume` is that without the gas, as a fraction of
// the volume at rest; it may be negative. `response` is the growth of that fraction in a substep for each
// unit of the result, above 0. The result is the only root above -1.
double gasPressure(double atRest, double volume, double response);

// Largest change of the volume in a substep, as a fraction of the volume at its start or, if that is less, of
// kSmallVolume times the volume at rest. The law knows the volume of the substep's end by its gradient at the
// start, so that a longer way would overshoot.
inline constexpr double kMostVolumeChange = 0.25, kSmallVolume = 0.1;

// The pressure, changed as little as possible so that the volume does not change by more than that. `start`:
// volume at the substep's start; the others are as above.
double boundedPressure(double pressure, double start, double volume, double response);

}  // namespace clothstream::model

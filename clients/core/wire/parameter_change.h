// SPDX-License-Identifier: MIT
// What changes of a scene while it runs, and the parts of it that a Scene has too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/wire.h"

namespace clothstream::client {

// {stiffness, damping}
using Spring = std::array<float, 2>;

// ConstraintPath in scene.proto.
inline constexpr std::uint32_t kMatrixFree = 1, kAssembled = 2;

struct Solver {
  std::uint32_t kind = CS_SOLVER_MASS_SPRING;  // the field that Solver.kind is
  bool bendConstraints = false;
  std::uint32_t iterations = 20;
  float tolerance = 0.001f;
  std::optional<float> compliance;
  float activation = 0.1f;
  std::uint32_t path = kMatrixFree;
  std::string settings;  // the kind's own message as it came
};

struct Gust {
  float strength = 0;  // m/s
  float seconds = 2;
};

struct ClothChange {
  std::string name;
  std::optional<Spring> structural, shear, bend;
  std::optional<float> damping, drag, lift, friction, thickness;
  std::optional<Solver> solver;
  std::optional<std::string> material = {};
  std::optional<float> ballRadius = {}, ballFriction = {}, tetherSlack = {}, dihedralBending = {};
};

struct ParameterChange {
  std::optional<Vec3> gravity, wind;
  std::optional<float> airDensity;
  std::optional<Gust> gust;
  std::vector<ClothChange> cloths;
  std::uint64_t participantId = 0;  // who made it
};

// False where the message is not well formed, a number is not finite, or there are too many cloths.
[[nodiscard]] bool readParameterChange(Bytes message, ParameterChange& change);
[[nodiscard]] bool readSpring(Bytes message, Spring& out);
[[nodiscard]] bool readGust(Bytes message, Gust& out);
// Of a SelfCollision and of Tethers, in a Scene's Cloth and in a change.
[[nodiscard]] bool readSelfCollision(Bytes message, std::optional<float>& radius,
                                     std::optional<float>& friction);
[[nodiscard]] bool readTethers(Bytes message, std::optional<float>& slack);
[[nodiscard]] bool readSolver(Bytes message, Solver& out);

inline constexpr std::size_t kMaxCloths = 256;

}  // namespace clothstream::client

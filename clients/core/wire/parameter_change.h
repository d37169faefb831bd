// SPDX-License-Identifier: MIT
// Parameters of a running scene, and changes of them. Reads and writes the messages that a Scene and a
// ParameterChange share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <protozero/pbf_writer.hpp>

#include "clients/core/core.h"
#include "clients/core/wire/wire.h"
#include "proto/parameters/cloth_parameters.h"
#include "proto/parameters/environment_parameters.h"
#include "proto/parameters/settings.h"

namespace clothstream::client {

// Values of ConstraintPath in scene.proto.
inline constexpr std::uint32_t kMatrixFree = 1, kAssembled = 2;

struct Solver {
  std::uint32_t kind = CS_SOLVER_MASS_SPRING;  // number of the field in Solver.kind
  bool bendConstraints = false;
  std::uint32_t iterations = parameters::kIterations.initial;
  float tolerance = parameters::kTolerance.initial;
  std::optional<float> compliance;
  float activation = parameters::kActivation.initial;
  std::uint32_t path = kMatrixFree;
  std::uint32_t acadMode = 0;  // AcadMode of scene.proto, as received
  std::string settings;        // message of the kind as received
};

// Current parameters of a cloth.
struct ClothParameters {
  std::string material;
  parameters::ClothNumbers numbers = defaultNumbers();
  Solver solver;
  std::map<std::uint32_t, Solver> solvers;  // newest settings of each kind

  // Defaults of scene.proto. Self-collision and tethers are NaN, because a cloth has none by default.
  static parameters::ClothNumbers defaultNumbers();
};

struct ClothChange {
  std::string name;  // empty: every cloth
  parameters::ClothNumbers numbers = {};
  std::optional<Solver> solver = {};
  std::optional<std::string> material = {};
  std::optional<float> arealMass = {};  // kg/m^2; written only, since no client shows it
};

struct ParameterChange {
  parameters::EnvironmentChange environment;
  std::vector<ClothChange> cloths;
  std::uint64_t participantId = 0;  // participant that made the change; 0 is the server
};

// The functions below return false if the message is not well formed or a number is not finite.

// Returns false also if there are more than kMaxClothChanges elements.
[[nodiscard]] bool readParameterChange(Bytes message, ParameterChange& change);
// Reads a Scene's Environment. Fields that it leaves out stay as they are.
[[nodiscard]] bool readEnvironment(Bytes message, parameters::EnvironmentValues& environment);
// Reads the parameters of a Scene's Cloth, and its name.
[[nodiscard]] bool readClothParameters(Bytes message, std::string& name, ClothParameters& parameters);
[[nodiscard]] bool readSolver(Bytes message, Solver& out);

// Writes a Vec3 as a submessage.
void addVec3(protozero::pbf_writer& parent, field::Field vec3Field, const Vec3& value);

// Writes the fields of a ParameterChange.
void writeFields(protozero::pbf_writer& message, const ParameterChange& change);

void apply(const ClothChange& change, ClothParameters& cloth);

inline constexpr std::size_t kMaxCloths = 256;
// One for each cloth, and one for all of them: announcements that have waited are merged.
inline constexpr std::size_t kMaxClothChanges = kMaxCloths + 1;

}  // namespace clothstream::client

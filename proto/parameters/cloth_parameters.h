// SPDX-License-Identifier: MIT
// The one table of a cloth's numbers that can change while a scene runs. Server and clients share it.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>

namespace clothstream::parameters {

// One for each row of the table, in its order.
enum class ClothNumber : std::uint8_t {
  structuralStiffness,
  structuralDamping,
  shearStiffness,
  shearDamping,
  bendStiffness,
  bendDamping,
  damping,
  drag,
  lift,
  friction,
  thickness,
  ballRadius,
  ballFriction,
  tetherSlack,
  dihedralBending,
  pressure,
};

// Both ends included.
struct Range {
  double min, max;
};

// Field numbers in a message of scene.proto (Cloth, Environment) and in the one of session.proto that changes
// it (ClothChange, ParameterChange).
struct WireField {
  std::uint32_t inScene, inChange;
};

// Field of Cloth and ClothChange whose message holds several numbers.
struct Group {
  WireField field;
  // True: a change replaces the whole message, and a number that it leaves out becomes 0. False: only a cloth
  // that has the message from its start can change it, and a number that the change leaves out stays.
  bool isReplaced;
};

inline constexpr Group kStructural{{5, 2}, true}, kShear{{6, 3}, true}, kBend{{7, 4}, true};
inline constexpr Group kSelfCollision{{21, 21}, false}, kTethers{{23, 23}, false};

struct ClothParameter {
  ClothNumber number;
  std::string_view name;         // of the field in the protos
  const Group* group = nullptr;  // message that holds the field; null: Cloth and ClothChange themselves
  WireField field;               // within the group
  std::string_view unit = {};    // empty if dimensionless
  Range range;
  float initial = 0;             // value where neither scene nor material gives one
  std::string_view option;       // of `clothstream set`
  std::string_view optionGroup;  // heading in its help
  std::string_view help;
};

// `member` finds the number in the server's Cloth; null if the cloth does not have it. `setting` finds it in
// cs_cloth_settings. Both are generic, because this header sees neither type.
template <typename Member, typename Setting>
struct Row {
  ClothParameter parameter;
  Member member;
  Setting setting;
};
template <typename Member, typename Setting>
constexpr Row<Member, Setting> row(ClothParameter parameter, Member member, Setting setting) {
  return {parameter, member, setting};
}

inline constexpr Range kStiffness{0, 1e6}, kSpringDamping{0, 1e4}, kAirCoefficient{0, 10}, kFriction{0, 10};

// Rows stand in the order of their fields in ClothChange, which is the order on the wire.
inline constexpr auto kClothTable = std::make_tuple(
    row(
        {.number = ClothNumber::structuralStiffness,
         .name = "stiffness",
         .group = &kStructural,
         .field = {1, 1},
         .unit = "N/m",
         .range = kStiffness,
         .option = "stiffness",
         .optionGroup = "Springs",
         .help = "Stiffness of structural springs"},
        [](auto& cloth) { return &cloth.structural.stiffness; },
        [](auto& settings) { return &settings.structural[0]; }),
    row(
        {.number = ClothNumber::structuralDamping,
         .name = "damping",
         .group = &kStructural,
         .field = {2, 2},
         .unit = "N s/m",
         .range = kSpringDamping,
         .option = "spring-damping",
         .optionGroup = "Springs",
         .help = "Damping of structural springs"},
        [](auto& cloth) { return &cloth.structural.damping; },
        [](auto& settings) { return &settings.structural[1]; }),
    row(
        {.number = ClothNumber::shearStiffness,
         .name = "stiffness",
         .group = &kShear,
         .field = {1, 1},
         .unit = "N/m",
         .range = kStiffness,
         .option = "shear",
         .optionGroup = "Springs",
         .help = "Stiffness of shear springs"},
        [](auto& cloth) { return &cloth.shear.stiffness; },
        [](auto& settings) { return &settings.shear[0]; }),
    row(
        {.number = ClothNumber::shearDamping,
         .name = "damping",
         .group = &kShear,
         .field = {2, 2},
         .unit = "N s/m",
         .range = kSpringDamping,
         .option = "shear-damping",
         .optionGroup = "Springs",
         .help = "Damping of shear springs"},
        [](auto& cloth) { return &cloth.shear.damping; }, [](auto& settings) { return &settings.shear[1]; }),
    row(
        {.number = ClothNumber::bendStiffness,
         .name = "stiffness",
         .group = &kBend,
         .field = {1, 1},
         .unit = "N/m",
         .range = kStiffness,
         .option = "bend",
         .optionGroup = "Springs",
         .help = "Stiffness of bend springs"},
        [](auto& cloth) { return &cloth.bend.stiffness; }, [](auto& settings) { return &settings.bend[0]; }),
    row(
        {.number = ClothNumber::bendDamping,
         .name = "damping",
         .group = &kBend,
         .field = {2, 2},
         .unit = "N s/m",
         .range = kSpringDamping,
         .option = "bend-damping",
         .optionGroup = "Springs",
         .help = "Damping of bend springs"},
        [](auto& cloth) { return &cloth.bend.damping; }, [](auto& settings) { return &settings.bend[1]; }),
    row(
        {.number = ClothNumber::damping,
         .name = "damping",
         .field = {8, 5},
         .unit = "1/s",
         .range = {0, 1000},
         .option = "damping",
         .optionGroup = "Material",
         .help = "Rate at which velocities decay"},
        [](auto& cloth) { return &cloth.damping; }, [](auto& settings) { return &settings.damping; }),
    row(
        {.number = ClothNumber::drag,
         .name = "drag",
         .field = {9, 6},
         .range = kAirCoefficient,
         .option = "drag",
         .optionGroup = "Material",
         .help = "Drag coefficient in air"},
        [](auto& cloth) { return &cloth.drag; }, [](auto& settings) { return &settings.drag; }),
    row(
        {.number = ClothNumber::lift,
         .name = "lift",
         .field = {10, 7},
         .range = kAirCoefficient,
         .option = "lift",
         .optionGroup = "Material",
         .help = "Lift coefficient in air"},
        [](auto& cloth) { return &cloth.lift; }, [](auto& settings) { return &settings.lift; }),
    row(
        {.number = ClothNumber::friction,
         .name = "friction",
         .field = {11, 8},
         .range = kFriction,
         .initial = 0.3f,
         .option = "friction",
         .optionGroup = "Material",
         .help = "Coulomb friction against colliders"},
        [](auto& cloth) { return &cloth.friction; }, [](auto& settings) { return &settings.friction; }),
    row(
        {.number = ClothNumber::thickness,
         .name = "thickness",
         .field = {12, 9},
         .unit = "m",
         .range = {0, 1},
         .initial = 0.005f,
         .option = "thickness",
         .optionGroup = "Material",
         .help = "Distance that nodes keep from colliders"},
        [](auto& cloth) { return &cloth.thickness; }, [](auto& settings) { return &settings.thickness; }),
    // The server lowers the maximum to the length of the cloth's shortest structural spring, and its default
    // is half of that length.
    row(
        {.number = ClothNumber::ballRadius,
         .name = "radius",
         .group = &kSelfCollision,
         .field = {1, 1},
         .unit = "m",
         .range = {0.00005, 1000},
         .option = "ball-radius",
         .optionGroup = "Material",
         .help = "Radius of a node in self-collision"},
        [](auto& cloth) { return cloth.selfCollision ? &cloth.selfCollision->radius : nullptr; },
        [](auto& settings) { return &settings.ball_radius; }),
    row(
        {.number = ClothNumber::ballFriction,
         .name = "friction",
         .group = &kSelfCollision,
         .field = {2, 2},
         .range = kFriction,
         .initial = 0.3f,
         .option = "ball-friction",
         .optionGroup = "Material",
         .help = "Coulomb friction in self-collision"},
        [](auto& cloth) { return cloth.selfCollision ? &cloth.selfCollision->friction : nullptr; },
        [](auto& settings) { return &settings.ball_friction; }),
    row(
        {.number = ClothNumber::tetherSlack,
         .name = "slack",
         .group = &kTethers,
         .field = {1, 1},
         .range = {0, 1},
         .initial = 0.02f,
         .option = "tether-slack",
         .optionGroup = "Springs",
         .help = "Extra length that tethers allow, as a fraction of the distance along the cloth"},
        [](auto& cloth) { return cloth.tethers ? &cloth.tethers->slack : nullptr; },
        [](auto& settings) { return &settings.tether_slack; }),
    row(
        {.number = ClothNumber::dihedralBending,
         .name = "dihedral_bending",
         .field = {24, 24},
         .unit = "N m",
         .range = {0, 1},
         .option = "dihedral-bending",
         .optionGroup = "Springs",
         .help = "Flexural rigidity across edges between faces"},
        [](auto& cloth) { return &cloth.dihedralBending; },
        [](auto& settings) { return &settings.dihedral_bending; }),
    row(
        {.number = ClothNumber::pressure,
         .name = "pressure",
         .field = {44, 44},
         .unit = "Pa",
         .range = {-50'000, 1'000'000},
         .option = "pressure",
         .optionGroup = "Material",
         .help = "Gas inside a closed mesh, above the pressure outside; 0: no gas"},
        [](auto& cloth) { return &cloth.pressure; }, [](auto& settings) { return &settings.pressure; }));

// The rows without what finds their numbers.
inline constexpr auto kClothParameters =
    std::apply([](const auto&... rows) { return std::array{rows.parameter...}; }, kClothTable);

constexpr bool rowsAreInOrder() {
  for (std::size_t i = 0; i < kClothParameters.size(); ++i)
    if (static_cast<std::size_t>(kClothParameters[i].number) != i) return false;
  return true;
}
static_assert(rowsAreInOrder());

constexpr const ClothParameter& parameterOf(ClothNumber number) {
  return kClothParameters[static_cast<std::size_t>(number)];
}

constexpr float initial(ClothNumber number) {
  return parameterOf(number).initial;
}

// Where a cloth of the server keeps the number; null if the cloth does not have it.
template <typename Cloth>
auto memberOf(Cloth& cloth, ClothNumber number) {
  decltype(&cloth.damping) found = nullptr;
  const auto look = [&](const auto& row) {
    if (row.parameter.number == number) found = row.member(cloth);
  };
  std::apply([&](const auto&... rows) { (look(rows), ...); }, kClothTable);
  return found;
}

// Where cs_cloth_settings keeps the number.
template <typename Settings>
auto& settingOf(Settings& settings, ClothNumber number) {
  decltype(&settings.damping) found = nullptr;
  const auto look = [&](const auto& row) {
    if (row.parameter.number == number) found = row.setting(settings);
  };
  std::apply([&](const auto&... rows) { (look(rows), ...); }, kClothTable);
  assert(found != nullptr);
  return *found;
}

// A value for each number of a cloth, or NaN. In a change, NaN leaves the number as it is.
class ClothNumbers {
 public:
  constexpr ClothNumbers() { values_.fill(std::numeric_limits<float>::quiet_NaN()); }
  constexpr ClothNumbers(std::initializer_list<std::pair<ClothNumber, float>> given) : ClothNumbers() {
    for (const auto& [number, value] : given) (*this)[number] = value;
  }

  constexpr float& operator[](ClothNumber number) { return values_[static_cast<std::size_t>(number)]; }
  constexpr float operator[](ClothNumber number) const { return values_[static_cast<std::size_t>(number)]; }
  bool has(ClothNumber number) const { return !std::isnan((*this)[number]); }
  bool hasAnyOf(const Group& group) const {
    for (const ClothParameter& parameter : kClothParameters)
      if (parameter.group == &group && has(parameter.number)) return true;
    return false;
  }

 private:
  std::array<float, kClothParameters.size()> values_;
};

// Applies a change. `numberOf` gives a pointer to the cloth's value of a ClothNumber, or null if the cloth
// does not have that number.
template <typename NumberOf>
void applyNumbers(const ClothNumbers& change, const NumberOf& numberOf) {
  for (const ClothParameter& parameter : kClothParameters)
    if (change.has(parameter.number))
      if (float* value = numberOf(parameter.number)) *value = change[parameter.number];
}

}  // namespace clothstream::parameters

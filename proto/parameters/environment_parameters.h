// SPDX-License-Identifier: MIT
// The one table of the environment's numbers, which can change while a scene runs. Server and clients share
// it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>

#include "proto/parameters/cloth_parameters.h"
#include "proto/parameters/settings.h"

namespace clothstream::parameters {

// One for each row of the table, in its order. They are indices of EnvironmentValues and EnvironmentChange.
enum EnvironmentField : std::uint8_t { kGravity, kWind, kAirDensity, kGust };

struct EnvironmentNumber {
  Setting setting;             // `initial`: value where a scene leaves the whole field out
  std::string_view help = {};  // of the option, before the range; empty: the help leaves the number out
  bool isOptional = false;  // true: its field may leave it out, and then it is `initial`; false: then it is 0
};

// Field of the messages Environment and ParameterChange. A change replaces all of its numbers.
struct EnvironmentParameter {
  EnvironmentField row;
  WireField field;
  // Several numbers are the fields 1, 2 and so on of a message; one number is the field itself.
  std::span<const EnvironmentNumber> numbers;
  bool isVector = false;    // a Vec3, which ParameterChange has in a Vec3Value
  std::string_view option;  // of `clothstream set`

  constexpr bool isMessage() const { return numbers.size() > 1; }
};

inline constexpr EnvironmentNumber kGravityNumbers[] = {{{"m/s^2", {-1000, 1000}}, "X,Y,Z, each"},
                                                        {{"m/s^2", {-1000, 1000}, -9.81f}},
                                                        {{"m/s^2", {-1000, 1000}}}};
inline constexpr EnvironmentNumber kWindNumbers[] = {
    {{"m/s", {-100, 100}}, "X,Y,Z, each"}, {{"m/s", {-100, 100}}}, {{"m/s", {-100, 100}}}};
inline constexpr EnvironmentNumber kAirDensityNumbers[] = {
    {{"kg/m^3", {0, 100}, 1.2f}, "Density of the air,"}};
inline constexpr EnvironmentNumber kGustNumbers[] = {
    {{"m/s", {0, 100}}, "STRENGTH[,SECONDS]: maximum deviation of the wind,"},
    {{"s", {0.01, 3600}, 2}, ", and its duration,", true}};

// Clients write the fields in this order.
inline constexpr EnvironmentParameter kEnvironmentParameters[] = {
    {.row = kGravity, .field = {1, 1}, .numbers = kGravityNumbers, .isVector = true, .option = "gravity"},
    {.row = kWind, .field = {2, 2}, .numbers = kWindNumbers, .isVector = true, .option = "wind"},
    {.row = kAirDensity, .field = {3, 3}, .numbers = kAirDensityNumbers, .option = "air-density"},
    {.row = kGust, .field = {4, 40}, .numbers = kGustNumbers, .option = "gust"}};

// Numbers of one field. Those that it does not have are 0.
using EnvironmentValue = std::array<float, 3>;
using EnvironmentValues = std::array<EnvironmentValue, std::size(kEnvironmentParameters)>;
// Absent fields stay as they are.
using EnvironmentChange = std::array<std::optional<EnvironmentValue>, std::size(kEnvironmentParameters)>;

inline void applyChange(const EnvironmentChange& change, EnvironmentValues& values) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = change[i].value_or(values[i]);
}

constexpr float initial(EnvironmentField row, std::size_t number = 0) {
  return kEnvironmentParameters[row].numbers[number].setting.initial;
}

// Numbers of a scene that leaves out every field.
constexpr EnvironmentValues initialEnvironment() {
  EnvironmentValues values{};
  for (const EnvironmentParameter& parameter : kEnvironmentParameters)
    for (std::size_t i = 0; i < parameter.numbers.size(); ++i)
      values[parameter.row][i] = initial(parameter.row, i);
  return values;
}

// Numbers of a field that leaves out all of them.
constexpr EnvironmentValue emptyValue(const EnvironmentParameter& parameter) {
  EnvironmentValue value{};
  for (std::size_t i = 0; i < parameter.numbers.size(); ++i)
    if (parameter.numbers[i].isOptional) value[i] = initial(parameter.row, i);
  return value;
}

}  // namespace clothstream::parameters

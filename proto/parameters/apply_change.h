// SPDX-License-Identifier: MIT
// Rules by which a change of parameters applies. Scenes, recordings and clients share them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "proto/parameters/cloth_parameters.h"

namespace clothstream::parameters {

// True if a ClothChange with the name `change` is for this cloth. An empty name is for every cloth.
inline bool isFor(std::string_view change, std::string_view cloth) {
  return change.empty() || change == cloth;
}

// True if a change replaces the whole value of this field of ClothChange. False for groups that keep the
// numbers that a change leaves out.
constexpr bool isReplaced(std::uint32_t fieldInChange) {
  for (const ClothParameter& parameter : kClothParameters)
    if (parameter.group != nullptr && parameter.group->field.inChange == fieldInChange)
      return parameter.group->isReplaced;
  return true;
}

template <typename T>
void assign(T& value, const std::optional<T>& change) {
  if (change) value = *change;
}

// Applies changes with applyToCloth(clothChange, cloth) to each cloth that they are for. Server and clients
// have their own types, whose members have the same names.
template <typename Changes, typename Cloths, typename ApplyToCloth>
void applyToCloths(const Changes& changes, Cloths& cloths, const ApplyToCloth& applyToCloth) {
  for (const auto& clothChange : changes)
    for (auto& cloth : cloths)
      if (isFor(clothChange.name, cloth.name)) applyToCloth(clothChange, cloth);
}

}  // namespace clothstream::parameters

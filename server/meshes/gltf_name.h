// SPDX-License-Identifier: MIT
// Names of the parts of a glTF file in error texts.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "proto/text/excerpt.h"

namespace clothstream::meshes {

// Returns a text such as `mesh "shirt"`, or `mesh 3` if the part has no name.
inline std::string namedPart(std::string_view kind, const std::string& name, std::size_t index) {
  return name.empty() ? fmt::format("{} {}", kind, index) : fmt::format("{} \"{}\"", kind, excerpt(name, 64));
}

}  // namespace clothstream::meshes

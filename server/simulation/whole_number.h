// SPDX-License-Identifier: MIT
// Whole numbers in tables of floats: shaders/shared/whole_number.glsl.
#pragma once

#include <cstddef>

#include "shaders/shared/types.h"

namespace clothstream::simulation {

// The two halves of a whole number, as floats hold them exactly, then two numbers more.
inline shared::vec4 halves(std::size_t number, float z, float w) {
  return {static_cast<float>(number & 0xFFFF), static_cast<float>(number >> 16), z, w};
}

}  // namespace clothstream::simulation

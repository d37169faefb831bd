// SPDX-License-Identifier: MIT
// A vector as kernels read it.
#pragma once

#include <cstddef>

#include "server/model/scene.h"
#include "shaders/shared/types.h"

namespace clothstream::simulation {

inline constexpr std::size_t kTexelBytes = sizeof(shared::vec4);

inline shared::vec4 texel(const model::Vec3& v, float w) {
  return {v.x(), v.y(), v.z(), w};
}

}  // namespace clothstream::simulation

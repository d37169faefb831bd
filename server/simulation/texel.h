// SPDX-License-Identifier: MIT
// Vectors as kernels read them.
#pragma once

#include <cstddef>

#include "server/model/scene.h"
#include "shaders/shared/types.h"

namespace clothstream::simulation {

inline constexpr std::size_t kTexelBytes = sizeof(shared::vec4);

inline shared::vec3 vectorOf(const model::Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

inline shared::vec4 texel(const model::Vec3& v, float w) {
  return {v.x(), v.y(), v.z(), w};
}

inline shared::vec4 texel(const model::Quaternion& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace clothstream::simulation

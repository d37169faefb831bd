// SPDX-License-Identifier: MIT
#include "clients/core/wire/skin.h"

#include <algorithm>
#include <cmath>

namespace clothstream::client {
namespace {

using Triple = std::array<float, 3>;
using Quadruple = std::array<float, 4>;  // x y z w

Triple turned(const Quadruple& q, const Triple& v) {
  const auto cross = [](const Triple& a, const Triple& b) {
    return Triple{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Triple axis{q[0], q[1], q[2]};
  Triple twice = cross(axis, v);
  for (float& number : twice) number *= 2;
  const Triple again = cross(axis, twice);
  return {v[0] + q[3] * twice[0] + again[0], v[1] + q[3] * twice[1] + again[1],
          v[2] + q[3] * twice[2] + again[2]};
}

struct JointFrame {
  Triple position;
  Quadruple orientation;
};

JointFrame jointAt(std::span<const float> numbers, std::size_t joint) {
  const std::span<const float> own = numbers.subspan(kJointNumbers * joint, kJointNumbers);
  return {{own[0], own[1], own[2]}, {own[3], own[4], own[5], own[6]}};
}

}  // namespace

bool Skin::fits(std::size_t vertices) const {
  const std::size_t count = jointCount();
  if ((!names.empty() && names.size() != count) || (!parents.empty() && parents.size() != count))
    return false;
  for (std::size_t joint = 0; joint < parents.size(); ++joint)
    if (parents[joint] > joint) return false;
  return count > 0 && count <= kMaxJoints && rest.size() % kJointNumbers == 0 &&
         joints.size() == kVertexJoints * vertices && weights.size() == joints.size() &&
         std::all_of(joints.begin(), joints.end(), [&](std::uint8_t joint) { return joint < count; }) &&
         std::all_of(weights.begin(), weights.end(), [](float weight) { return std::isfinite(weight); });
}

void pose(const Skin& skin, std::span<const float> rest, std::span<const float> joints,
          std::vector<float>& vertices) {
  vertices.resize(rest.size());
  for (std::size_t i = 0; i < rest.size() / 3; ++i) {
    Triple sum{};
    for (std::size_t k = 0; k < kVertexJoints; ++k) {
      const float weight = skin.weights[kVertexJoints * i + k];
      if (weight == 0) continue;
      const std::size_t joint = skin.joints[kVertexJoints * i + k];
      const JointFrame from = jointAt(skin.rest, joint), to = jointAt(joints, joint);
      const Triple arm{rest[3 * i] - from.position[0], rest[3 * i + 1] - from.position[1],
                       rest[3 * i + 2] - from.position[2]};
      const Quadruple& q = from.orientation;
      const Triple moved = turned(to.orientation, turned({-q[0], -q[1], -q[2], q[3]}, arm));
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weight * (to.position[axis] + moved[axis]);
    }
    std::copy(sum.begin(), sum.end(), vertices.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
}

void moveJoints(std::span<const float> from, std::span<const float> to, float part,
                std::vector<float>& joints) {
  joints.resize(from.size());
  for (std::size_t first = 0; first + kJointNumbers <= from.size(); first += kJointNumbers) {
    for (std::size_t i = first; i < first + 3; ++i) joints[i] = from[i] + part * (to[i] - from[i]);
    float cosine = 0, square = 0;
    for (std::size_t i = first + 3; i < first + kJointNumbers; ++i) cosine += from[i] * to[i];
    const float sign = cosine < 0 ? -1.0f : 1.0f;
    for (std::size_t i = first + 3; i < first + kJointNumbers; ++i) {
      joints[i] = (1 - part) * from[i] + sign * part * to[i];
      square += joints[i] * joints[i];
    }
    const float scale = square > 1e-30f && std::isfinite(square) ? 1 / std::sqrt(square) : 0;
    for (std::size_t i = first + 3; i < first + kJointNumbers; ++i)
      joints[i] = scale > 0 ? scale * joints[i] : from[i];
  }
}

}  // namespace clothstream::client

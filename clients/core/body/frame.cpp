// SPDX-License-Identifier: MIT
#include "clients/core/body/frame.h"

namespace clothstream::client::body {

Rotation basis(const Point& along, const Point& towards) {
  const Point helper = std::abs(along.x) < 0.6 ? Point{1, 0, 0} : Point{0, 1, 0};
  const Point second = direction(across(towards, along), direction(across(helper, along), {0, 1, 0}));
  const Rotation first = between({1, 0, 0}, along);
  // The rest is a rotation about `along`.
  const Point now = first * Point{0, 1, 0};
  return normalised(about(along, std::atan2(dot(cross(now, second), along), dot(now, second))) * first);
}

}  // namespace clothstream::client::body

// SPDX-License-Identifier: MIT
#include "clients/core/body/limb.h"

#include <algorithm>
#include <cmath>

namespace clothstream::client::body {

double farthestReach(const LimbLengths& lengths) {
  return 0.9985 * (lengths.upper + lengths.lower);
}

double nearestReach(const LimbLengths& lengths) {
  constexpr double kCosine = 0.9396926207859084;  // of 20 degrees
  const double square = lengths.upper * lengths.upper + lengths.lower * lengths.lower -
                        2 * lengths.upper * lengths.lower * kCosine;
  return std::sqrt(std::max(square, 0.0));
}

LimbPose bend(const Point& root, const Point& target, const Point& way, const Point& pole,
              const LimbLengths& lengths) {
  const double reach = std::clamp(length(target - root), nearestReach(lengths), farthestReach(lengths));
  // Law of cosines: the hinge is `along` on the way, and `aside` of it.
  const double along =
      (reach * reach + lengths.upper * lengths.upper - lengths.lower * lengths.lower) / (2 * reach);
  const double aside = std::sqrt(std::max(lengths.upper * lengths.upper - along * along, 0.0));
  return {root + along * way + aside * pole, root + reach * way};
}

Point HingeSide::update(const Point& way, const Point& preferred, double seconds) {
  const Point wanted = across(preferred, way);
  const double sine = length(wanted) / std::max(length(preferred), 1e-9);
  const Point helper = std::abs(way.x) < 0.6 ? Point{1, 0, 0} : Point{0, 1, 0};
  const Point goal = direction(wanted, direction(across(helper, way), {0, 0, 1}));
  if (!side_) {
    side_ = goal;
  } else {
    const Point carried = direction(across(between(way_, way) * *side_, way), goal);
    const double angle = std::atan2(dot(cross(carried, goal), way), dot(carried, goal));
    const double most = kSwivelRate * sine * seconds;
    side_ = about(way, std::clamp(angle, -most, most)) * carried;
  }
  way_ = way;
  return *side_;
}

}  // namespace clothstream::client::body

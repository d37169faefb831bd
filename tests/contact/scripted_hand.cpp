// SPDX-License-Identifier: MIT
#include "tests/contact/scripted_hand.h"

#include <algorithm>
#include <cstddef>

namespace clothstream::tests {

HandJoints flatHand(const model::Vec3& palm, const model::Vec3& fingers, const model::Vec3& thumb) {
  HandJoints joints{};
  const auto put = [&](std::size_t joint, float along, float aside, float radius) {
    const model::Vec3 at = palm + along * fingers + aside * thumb;
    std::copy_n(at.data(), 3, &joints[4 * joint]);
    joints[4 * joint + 3] = radius;
  };
  put(0, 0, 0, 0.015f);
  put(1, -0.07f, 0, 0.02f);
  constexpr std::array<float, 4> kThumbAlong{-0.05f, -0.015f, 0.015f, 0.035f};
  constexpr std::array<float, 4> kThumbAside{0.025f, 0.045f, 0.06f, 0.07f};
  for (std::size_t i = 0; i < 4; ++i) put(2 + i, kThumbAlong[i], kThumbAside[i], 0.011f);
  // Metacarpal, proximal, intermediate, distal and tip of the four fingers.
  constexpr std::array<float, 5> kAlong{-0.045f, 0.03f, 0.07f, 0.095f, 0.115f};
  constexpr std::array<float, 4> kAside{0.028f, 0.009f, -0.01f, -0.028f};
  constexpr std::array<float, 4> kLength{0.93f, 1, 0.95f, 0.8f};
  for (std::size_t finger = 0; finger < 4; ++finger)
    for (std::size_t i = 0; i < 5; ++i)
      put(6 + 5 * finger + i, kAlong[i] * (i > 1 ? kLength[finger] : 1), kAside[finger],
          i > 1 ? 0.008f : 0.011f);
  return joints;
}

double smoothWay(double time, double seconds) {
  const double t = std::clamp(time / seconds, 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

}  // namespace clothstream::tests

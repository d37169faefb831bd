// SPDX-License-Identifier: MIT
// Bones of a tracked hand, as server and clients make capsules of them (docs/protocol.md).
#pragma once

#include <array>
#include <cstddef>

namespace clothstream::hands {

// Joints in the order of OpenXR (XrHandJointEXT). The order of WebXR lacks the first one, the palm.
inline constexpr std::size_t kJoints = 26, kJointsWithoutPalm = 25;
inline constexpr std::size_t kWrist = 1, kMiddleMetacarpal = 11;

// Joints that a bone connects. Its capsule has the mean of their radii.
struct Bone {
  std::size_t from, to;
};
// Three bones of the thumb; four of each of the other fingers, whose first one is in the palm; one from the
// wrist to the middle finger.
inline constexpr std::array<Bone, 20> kBones{{{2, 3},   {3, 4},   {4, 5},   {6, 7},
                                              {7, 8},   {8, 9},   {9, 10},  {11, 12},
                                              {12, 13}, {13, 14}, {14, 15}, {16, 17},
                                              {17, 18}, {18, 19}, {19, 20}, {21, 22},
                                              {22, 23}, {23, 24}, {24, 25}, {kWrist, kMiddleMetacarpal}}};

}  // namespace clothstream::hands

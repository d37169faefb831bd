// SPDX-License-Identifier: MIT
// Joints of points near a mesh, taken from the mesh.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/model/cancellation.h"
#include "server/model/closed_mesh.h"
#include "server/model/skin.h"

namespace clothstream::model {

// The four joints with the largest weights, the largest first, scaled so that their sum is 1. Of equal
// weights those of the lower joints come first. Weights below a millionth of the largest are left out. Each
// joint is there once, and one weight is above 0.
VertexJoints largestJoints(std::vector<std::pair<std::uint8_t, double>> weights);

// For each point, the joints of the nearest point of the mesh at rest: the mean of the weights of the three
// vertices by the barycentric coordinates there, of which the four largest are kept. The mesh must have a
// skin. Of equally near triangles the first counts. Only + - * / in double are used, so every machine gives
// the same weights.
//
// Takes time in proportion to n log m for n points and m triangles. A search visits at most
// kMostTransferVisits boxes. If there are more near a point, the nearest triangle that it has seen counts.
// Checks the cancellation every few thousand points; throws Cancelled.
std::vector<VertexJoints> jointsNear(const ClosedMesh& mesh, std::span<const Vec3> points,
                                     const Cancellation& cancellation = {});
inline constexpr std::uint32_t kMostTransferVisits = 4096;

}  // namespace clothstream::model

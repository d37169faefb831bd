// SPDX-License-Identifier: MIT
// Joints of a collider that is a mesh, and the vertices that they move.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace clothstream::client {

// Limit of the joints of a mesh.
inline constexpr std::size_t kMaxJoints = 128;
// Numbers of a joint: position, then the unit quaternion x, y, z, w.
inline constexpr std::size_t kJointNumbers = 7;
// Joints that move a vertex.
inline constexpr std::size_t kVertexJoints = 4;

struct Skin {
  std::vector<std::uint8_t> joints;  // kVertexJoints for each vertex
  std::vector<float> weights;        // likewise
  std::vector<float> rest;           // kJointNumbers for each joint, at rest
  // Name of each joint, and index of the parent plus 1 (0: the frame of the collider; a parent comes before
  // its children). Both are empty if the server does not send them.
  std::vector<std::string> names;
  std::vector<std::uint32_t> parents;

  std::size_t jointCount() const { return rest.size() / kJointNumbers; }
  // True if it fits a mesh of `vertices` vertices.
  bool fits(std::size_t vertices) const;
};

// Moves vertices from their rest by the joints: linear blend skinning. `joints` has kJointNumbers for each
// joint of the skin.
void pose(const Skin& skin, std::span<const float> rest, std::span<const float> joints,
          std::vector<float>& vertices);

// Moves joints a part of the way from `from` to `to`; both have as many. A part above 1 extrapolates.
void moveJoints(std::span<const float> from, std::span<const float> to, float part,
                std::vector<float>& joints);

}  // namespace clothstream::client

// SPDX-License-Identifier: MIT
// A .glb file of a rod that two joints bend.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include <nlohmann/json.hpp>

namespace clothstream::meshes {

// The rod is 40 cm long, along X, in centimetres. A node above the joints scales it to metres, turns and
// moves it. The skin lists the upper joint first, although it is a child of the lower one.
struct SkinnedGlb {
  nlohmann::json root;
  std::string data;  // of the only buffer

  SkinnedGlb();
  std::string bytes() const;
  // The place of a vertex of the file at a time of the animation "bend", and at rest, by the rules of glTF.
  Eigen::Vector3d posed(std::size_t vertex, double seconds) const;

  // Adds an accessor of these floats. Returns its number.
  int add(const std::vector<float>& numbers, const char* type);
};

// Nodes, skin and accessors of the file.
inline constexpr int kArmature = 0, kLower = 1, kUpper = 2;
inline constexpr double kBendSeconds = 2;

}  // namespace clothstream::meshes

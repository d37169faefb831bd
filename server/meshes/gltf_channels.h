// SPDX-License-Identifier: MIT
// Translations and rotations of nodes in an animation of a glTF file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/model/pose.h"

namespace clothstream::meshes {

// Rotation, translation and the same scale along all axes.
struct Similarity {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  double scale = 1;

  Similarity operator*(const Similarity& inner) const {
    return {translation + scale * (rotation * inner.translation), (rotation * inner.rotation).normalized(),
            scale * inner.scale};
  }
  Similarity inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back * translation / -scale, back, 1 / scale};
  }
};

// Changes of one node.
struct GltfChannel {
  enum class Path : std::uint8_t { translation, rotation };
  enum class Curve : std::uint8_t { steps, lines, cubic };
  std::size_t node = 0;  // index in the list of nodes that readChannels() was given
  Path path = Path::translation;
  Curve curve = Curve::lines;
  std::vector<float> times;  // s, increasing
  // Three or four numbers (a quaternion x, y, z, w) for each time. For a cubic curve three times as many: the
  // slope before the time, the value, and the slope after it, per second.
  std::vector<float> values;

  // Sets the part of the pose that this channel changes. Before the first time and after the last one the
  // values stay.
  void apply(double seconds, Similarity& pose) const;

 private:
  // The value at a part of the way between two keys, which are `length` seconds apart.
  Eigen::Vector4d onCubic(std::size_t from, std::size_t to, double part, double length) const;
};

// Channels of the animation that change these nodes. Refuses interpolations that glTF does not have, more
// than `keys` times of a channel, two channels of one part of a node, and scales that change.
[[nodiscard]] tl::expected<std::vector<GltfChannel>, std::string> readChannels(
    const tinygltf::Model& model, const tinygltf::Animation& animation, const std::vector<int>& nodes,
    const std::vector<Similarity>& poses, std::size_t keys);

}  // namespace clothstream::meshes

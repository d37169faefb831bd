// SPDX-License-Identifier: MIT
// Meshes with the skeleton of a person, for tests of bodies.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/core/wire/collider.h"

namespace clothstream::client::tests {

struct FigureJoint {
  std::string name;
  int parent = -1;
  float x = 0, y = 0, z = 0;  // at rest, m
};

// Joints of the figure of the scene `dress`: it looks along -Z, and its right side is at +X.
inline std::vector<FigureJoint> figureJoints() {
  std::vector<FigureJoint> joints{{"hips", -1, 0, 0.96f, 0.01f},
                                  {"spine", 0, 0, 1.08f, 0},
                                  {"chest", 1, 0, 1.22f, 0},
                                  {"neck", 2, 0, 1.44f, 0.015f},
                                  {"head", 3, 0, 1.53f, 0}};
  for (const auto& [side, sign] : {std::pair("right", 1.0f), std::pair("left", -1.0f)}) {
    const auto add = [&](const char* bone, int parent, float x, float y, float z) {
      joints.push_back({std::string(side) + "-" + bone, parent, sign * x, y, z});
      return static_cast<int>(joints.size()) - 1;
    };
    const int arm = add("arm", 2, 0.165f, 1.375f, 0.008f);
    const int forearm = add("forearm", arm, 0.33739f, 1.15436f, 0.008f);
    add("hand", forearm, 0.49131f, 0.95736f, 0.008f);
    const int thigh = add("thigh", 0, 0.088f, 0.90f, 0.005f);
    const int shin = add("shin", thigh, 0.085f, 0.49f, 0);
    add("foot", shin, 0.085f, 0.075f, 0.02f);
  }
  return joints;
}

// A mesh that these joints move: one triangle at each joint, toes 0.15 m before the feet and soles on the
// floor, and a face and a crown at the head, 1.75 m above the floor.
inline Hull figureOf(const std::vector<FigureJoint>& joints, float front = -1) {
  Hull mesh;
  const auto addTriangle = [&](std::size_t joint, float x, float y, float z) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size() / 3);
    for (int corner = 0; corner < 3; ++corner) {
      mesh.vertices.insert(mesh.vertices.end(), {x + 0.01f * static_cast<float>(corner == 1),
                                                 y - 0.01f * static_cast<float>(corner == 2), z});
      mesh.skin.joints.insert(mesh.skin.joints.end(), {static_cast<std::uint8_t>(joint), 0, 0, 0});
      mesh.skin.weights.insert(mesh.skin.weights.end(), {1, 0, 0, 0});
    }
    mesh.triangles.insert(mesh.triangles.end(), {first, first + 1, first + 2});
  };
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const FigureJoint& joint = joints[i];
    mesh.skin.names.push_back(joint.name);
    mesh.skin.parents.push_back(static_cast<std::uint32_t>(joint.parent + 1));
    mesh.skin.rest.insert(mesh.skin.rest.end(), {joint.x, joint.y, joint.z, 0, 0, 0, 1});
    addTriangle(i, joint.x, joint.y, joint.z);
    std::string name = joint.name;
    for (char& c : name) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
    if (name.find("foot") != std::string::npos) addTriangle(i, joint.x, 0.01f, joint.z + 0.15f * front);
    if (name.ends_with("head")) {
      addTriangle(i, joint.x, 1.64f, joint.z + 0.11f * front);
      addTriangle(i, joint.x, 1.75f, joint.z);
    }
  }
  return mesh;
}

inline Hull figure() {
  return figureOf(figureJoints());
}

}  // namespace clothstream::client::tests

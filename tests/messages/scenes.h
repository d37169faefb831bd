// SPDX-License-Identifier: MIT
// Scene messages shared by tests.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include "clothstream/v1/scene.pb.h"

namespace clothstream::messages {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Scene with only the fields that have no default.
inline v1::Scene smallScene() {
  v1::Scene scene;
  scene.set_name("small");
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  v1::Grid& grid = *cloth.mutable_grid();
  grid.set_rows(4);
  grid.set_columns(5);
  grid.set_width(2);
  grid.set_height(1.5f);
  cloth.mutable_structural()->set_stiffness(10);
  v1::Collider& collider = *scene.add_colliders();
  collider.set_name("ball");
  collider.mutable_sphere()->set_radius(0.25f);
  return scene;
}

// smallScene() with a tetrahedron as the collider.
inline v1::Scene sceneWithHull() {
  v1::Scene scene = smallScene();
  v1::ConvexHull& hull = *scene.mutable_colliders(0)->mutable_hull();
  hull.add_vertices();
  hull.add_vertices()->set_x(1);
  hull.add_vertices()->set_y(1);
  hull.add_vertices()->set_z(1);
  for (const auto& face : {std::array{0u, 2u, 1u}, {0u, 1u, 3u}, {0u, 3u, 2u}, {1u, 2u, 3u}})
    hull.add_faces()->mutable_vertices()->Assign(face.begin(), face.end());
  return scene;
}

// A tetrahedron with one or two joints, which move its vertices alternating. Edges at its first vertex are 1
// m long.
inline v1::Collider jointedTetrahedron(const std::string& name, std::uint32_t jointCount) {
  v1::Collider body;
  body.set_name(name);
  v1::ColliderMesh& mesh = *body.mutable_mesh();
  for (const float number : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f})
    mesh.add_positions(number);
  for (const std::uint32_t corner : {0u, 2u, 1u, 0u, 1u, 3u, 0u, 3u, 2u, 1u, 2u, 3u})
    mesh.add_triangles(corner);
  v1::Skin& skin = *mesh.mutable_skin();
  skin.add_joints()->set_name("root");
  if (jointCount > 1) skin.add_joints()->set_parent(0);
  for (std::uint32_t vertex = 0; vertex < 4; ++vertex)
    for (int k = 0; k < 4; ++k) {
      skin.add_vertex_joints(vertex % jointCount);
      skin.add_vertex_weights(k == 0 ? 1 : 0);
    }
  return body;
}

}  // namespace clothstream::messages

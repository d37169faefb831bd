// SPDX-License-Identifier: MIT
// Scene messages that tests start from.
#pragma once

#include "clothstream/v1/scene.pb.h"

namespace clothstream::messages {

// Only what has no default.
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

}  // namespace clothstream::messages

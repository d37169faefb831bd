// SPDX-License-Identifier: MIT
// The body that this client wears: a collider of the scene that the solver moves.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/core/body/body_solver.h"
#include "clients/core/wire/collider.h"

namespace clothstream::client::body {

class WornBody {
 public:
  WornBody(std::string collider, Humanoid humanoid);

  // Name of the collider.
  const std::string& collider() const { return collider_; }
  // Whether the mesh of a new description has the same skeleton.
  bool fits(const Hull& mesh) const;

  // The server announced the body that this participant wears.
  void announced(std::string_view body) {
    isLost_ = isOwn_ && body != collider_;
    isOwn_ = body == collider_;
  }
  // Whether the server has given the body back.
  bool isLost() const { return isLost_; }

  // Bends the body to the person. `collider` is the newest state of the collider. Returns whether it jumps.
  bool update(const Tracked& tracked, const Collider& collider, std::uint64_t nowUs);
  // kJointNumbers for each joint, relative to its parent; empty before update().
  const std::vector<float>& poses() const { return poses_; }
  const BodySolver& solver() const { return solver_; }

 private:
  std::string collider_;
  BodySolver solver_;
  bool isOwn_ = false, isLost_ = false;
  std::optional<std::uint64_t> lastUs_;
  std::vector<float> poses_;
};

}  // namespace clothstream::client::body

// SPDX-License-Identifier: MIT
#include "clients/core/body/worn_body.h"

#include <utility>

namespace clothstream::client::body {

WornBody::WornBody(std::string collider, Humanoid humanoid)
    : collider_(std::move(collider)), solver_(std::move(humanoid)) {}

bool WornBody::fits(const Hull& mesh) const {
  const Humanoid& own = solver_.humanoid();
  if (mesh.skin.jointCount() != own.rest.size() || mesh.skin.parents.size() != own.parents.size())
    return false;
  for (std::size_t joint = 0; joint < own.parents.size(); ++joint)
    if (mesh.skin.parents[joint] != (own.parents[joint] ? *own.parents[joint] + 1 : 0)) return false;
  return true;
}

bool WornBody::update(const Tracked& tracked, const Collider& collider, std::uint64_t nowUs) {
  const double seconds = lastUs_ && nowUs > *lastUs_ ? 1e-6 * static_cast<double>(nowUs - *lastUs_) : 0;
  lastUs_ = nowUs;
  const bool jumps = solver_.update(tracked, seconds);
  const auto& [x, y, z, w] = collider.orientation;
  const auto& [px, py, pz] = collider.position;
  solver_.writeLocal({normalised({x, y, z, w}), {px, py, pz}}, poses_);
  return jumps;
}

}  // namespace clothstream::client::body

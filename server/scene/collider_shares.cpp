// SPDX-License-Identifier: MIT
#include "server/scene/collider_shares.h"

#include <algorithm>
#include <limits>

#include "server/messages/hands.h"

namespace clothstream::scene {
namespace {

// Way that a collider and cloth move while a tick lasts, m; added to the size of a collider.
constexpr float kReach = 0.1f;
// Sums of weights that differ by less are equal.
constexpr double kRounding = 1e-9;

}  // namespace

double weightOf(const model::ParticipantCollider& collider, const ClothBounds* cloth) {
  if (cloth == nullptr) return 1;
  const float radius = model::reachOf(collider.shape);
  const model::Vec3& at = collider.pose.position;
  const model::Vec3 outside = (cloth->low - at).cwiseMax(at - cloth->high).cwiseMax(0.0f);
  if (outside.norm() > radius + kFarAway) return kFarWeight;
  // Cloth is a surface: the share of it near a collider grows with the square of the collider's size.
  const double size = (cloth->high - cloth->low).norm() / 2;
  const double reach = radius + kReach;
  const double share = size > 0 ? reach * reach / (size * size) : 1;
  return std::clamp(share * kMostWeight, kLeastWeight, kMostWeight);
}

bool isHandOrHead(const model::ParticipantCollider& collider) {
  return collider.id >= messages::kFirstBoneId;
}

ColliderLoad loadOf(std::span<const model::ParticipantCollider> colliders, const ClothBounds* cloth) {
  ColliderLoad load;
  for (const model::ParticipantCollider& collider : colliders)
    (isHandOrHead(collider) ? load.hands : load.others) += weightOf(collider, cloth);
  return load;
}

double fairShare(std::span<double> needs, double room) {
  std::ranges::sort(needs);
  std::size_t left = needs.size();
  for (const double need : needs) {
    const double even = room / static_cast<double>(left--);
    if (need > even + kRounding) return std::max(even, 0.0);
    room -= need;
  }
  return std::numeric_limits<double>::infinity();
}

bool trim(std::vector<model::ParticipantCollider>& colliders, const ColliderLoad& share,
          const ClothBounds* cloth) {
  ColliderLoad used;
  const auto exceeds = [&](const model::ParticipantCollider& collider) {
    const bool first = isHandOrHead(collider);
    double& sum = first ? used.hands : used.others;
    const double weight = weightOf(collider, cloth);
    if (sum + weight > (first ? share.hands : share.others) + kRounding) return true;
    sum += weight;
    return false;
  };
  return std::erase_if(colliders, exceeds) > 0;
}

}  // namespace clothstream::scene

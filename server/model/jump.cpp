// SPDX-License-Identifier: MIT
#include "server/model/jump.h"

#include <algorithm>
#include <cmath>

namespace clothstream::model {
namespace {

bool isPinned(const Cloth& cloth) {
  return !cloth.pins.empty() || !cloth.pinnedVertices.empty() || !cloth.pinnedRegions.empty();
}

Pose moved(const Carry& carry, const Pose& pose) {
  const Quaternion turn = carry.to.orientation * carry.from.orientation.conjugate();
  return {carry.to.position + turn * (pose.position - carry.from.position), turn * pose.orientation};
}

}  // namespace

bool hasJumped(const Pose& before, const Pose& now, double tickSeconds, float radius) {
  const float reach = kMaxAttachmentSpeed * static_cast<float>(tickSeconds);
  return (now.position - before.position).squaredNorm() > reach * reach ||
         std::abs(now.orientation.dot(before.orientation)) < kMaxTurn ||
         radius * now.orientation.angularDistance(before.orientation) > 2 * reach;
}

bool hasJumped(std::span<const Pose> before, std::span<const Pose> now, double tickSeconds) {
  for (std::size_t i = 0; i < before.size(); ++i)
    if (hasJumped(before[i], now[i], tickSeconds)) return true;
  return false;
}

std::vector<Carry> carriesOf(const Scene& scene, std::span<const Pose> before, std::span<const Pose> now,
                             std::span<const std::size_t> told) {
  std::vector<Carry> carries;
  std::size_t first = 0;
  for (std::uint32_t i = 0; i < scene.cloths.size(); ++i) {
    const std::size_t count = scene.cloths[i].attachments.size();
    const std::span<const Pose> starts = before.subspan(first, count), ends = now.subspan(first, count);
    const bool isTold =
        std::ranges::any_of(told, [&](std::size_t one) { return one >= first && one < first + count; });
    first += count;
    if (count == 0 || isPinned(scene.cloths[i]) || scene.cloths[i].skin) continue;
    const Carry carry{i, starts[0], ends[0]};
    if (!isTold && !hasJumped(carry.from, carry.to, scene.tickSeconds())) continue;
    bool together = true;
    for (std::size_t k = 1; k < count; ++k)
      together = together && !hasJumped(moved(carry, starts[k]), ends[k], scene.tickSeconds());
    if (together) carries.push_back(carry);
  }
  return carries;
}

}  // namespace clothstream::model

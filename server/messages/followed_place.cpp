// SPDX-License-Identifier: MIT
#include "server/messages/followed_place.h"

#include <algorithm>

#include "server/model/origin.h"

namespace clothstream::messages {

float mostFollowedDistance(const model::Scene& scene) {
  return model::reachOf(scene.stream) / 2;
}

bool isFollowed(const model::Scene& scene, const std::string& collider) {
  return std::ranges::any_of(scene.cloths, [&](const model::Cloth& cloth) {
    return (cloth.skin && cloth.skin->collider == collider) ||
           std::ranges::find(cloth.attachments, collider, &model::Attachment::collider) !=
               cloth.attachments.end();
  });
}

void checkFollowedPlace(Checks& checks, const Path& path, const model::Vec3& place, const model::Vec3& start,
                        const model::Scene& scene) {
  const model::Vec3 origin = model::originOf(scene);
  const float most = std::max(mostFollowedDistance(scene), (start - origin).cwiseAbs().maxCoeff());
  for (int axis = 0; axis < 3; ++axis)
    checks.number(path, place[axis], {.min = origin[axis] - most, .max = origin[axis] + most});
}

}  // namespace clothstream::messages

// SPDX-License-Identifier: MIT
#include "server/simulation/cloth_skin/cloth_skin_tables.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <variant>

#include "server/model/closed_mesh.h"
#include "server/model/cloth_skin.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

enum class Following : std::uint8_t { limited, exact, free };

Following followingOf(const model::SkinLimits& limits) {
  if (limits.followsExactly()) return Following::exact;
  return limits.isBounded() ? Following::limited : Following::free;
}

shared::SkinnedRecord recordOf(std::uint32_t node, const model::Vec3& place, const model::Vec3& normal,
                               const model::VertexJoints& by, const model::SkinLimits& limits) {
  const auto pairOf = [&](std::size_t first) {
    return static_cast<float>(by.joints[first]) +
           shared::kJointBase * static_cast<float>(by.joints[first + 1]);
  };
  return {.place = vectorOf(place),
          .node = static_cast<float>(node),
          .normal = vectorOf(normal),
          .maxDistance = std::min(limits.maxDistance, shared::kUnboundedDistance),
          .joints01 = pairOf(0),
          .joints23 = pairOf(2),
          .backstopDistance = limits.backstopDistance,
          .backstopRadius = normal.isZero(0) ? 0 : limits.backstopRadius,
          .weights = {by.weights[0], by.weights[1], by.weights[2], by.weights[3]}};
}

// Adds the nodes of a cloth that follow in this way; `first` is its first node in the scene.
std::uint32_t add(const model::ClothSkin& skin, std::uint32_t first, std::span<const model::Vec3> places,
                  std::span<const model::Vec3> normals, Following way, ClothSkinTables& tables) {
  const std::size_t before = tables.nodes.size();
  for (std::size_t i = 0; i < places.size(); ++i)
    if (followingOf(skin.limits[i]) == way)
      tables.nodes.push_back(recordOf(first + static_cast<std::uint32_t>(i), places[i], normals[i],
                                      skin.joints[i], skin.limits[i]));
  return static_cast<std::uint32_t>(tables.nodes.size() - before);
}

}  // namespace

ClothSkinTables clothSkinTables(const model::Scene& scene, const model::Vec3& origin) {
  ClothSkinTables tables;
  std::uint32_t first = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    const std::uint32_t node = first;
    first += cloth.nodeCount();
    if (!cloth.skin) continue;
    const model::Skin& skin = model::skinOf(scene, cloth);
    const std::vector<model::Vec3> places = model::restPositions(cloth), normals = model::restNormals(cloth);
    ClothSkinTables::Skinned skinned;
    const model::Collider& collider = scene.colliders[model::skinCollider(scene, cloth)];
    skinned.solid = std::get<model::Solid>(collider.shape);
    skinned.start = model::poseAt(collider, 0);
    skinned.start.position -= origin;
    skinned.nodeCount = cloth.nodeCount();
    skinned.inverseRests = model::inverseRests(skin);
    model::compose(skin, model::restJoints(skin), skinned.rest);
    skinned.push.firstRecord = static_cast<std::uint32_t>(tables.nodes.size());
    skinned.push.firstLimit = tables.limitCount;
    skinned.push.limitedCount = add(*cloth.skin, node, places, normals, Following::limited, tables);
    skinned.push.exactCount = add(*cloth.skin, node, places, normals, Following::exact, tables);
    add(*cloth.skin, node, places, normals, Following::free, tables);
    skinned.push.jointCount = static_cast<std::uint32_t>(skin.joints.size());
    skinned.push.firstJoint = tables.transformCount + skinned.push.jointCount;
    tables.transformCount += 3 * skinned.push.jointCount;
    tables.limitCount += skinned.push.limitedCount;
    tables.cloths.push_back(std::move(skinned));
  }
  tables.hasBackstops = std::ranges::any_of(
      tables.nodes, [](const shared::SkinnedRecord& record) { return record.backstopRadius > 0; });
  return tables;
}

}  // namespace clothstream::simulation

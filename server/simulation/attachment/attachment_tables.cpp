// SPDX-License-Identifier: MIT
// Attached nodes and tethers of a scene.
#include "server/simulation/attachment/attachment_tables.h"

#include <algorithm>
#include <array>

#include "server/model/tethers.h"

namespace clothstream::simulation {
namespace {

// `first`: the cloth's first node.
void addAttached(const model::Scene& scene, const model::Cloth& cloth, std::uint32_t first,
                 AttachmentTables& tables) {
  const std::vector<model::Vec3> rest = model::restPositions(cloth);
  for (const model::Attachment& attachment : cloth.attachments) {
    const model::Pose start = model::frameAt(scene, attachment, 0);
    const auto frame = static_cast<float>(tables.frames.size());
    tables.frames.push_back(frameRecord(start));
    const std::vector<std::uint8_t> attached = model::attachedNodes(cloth, attachment);
    for (std::uint32_t node = 0; node < attached.size(); ++node) {
      if (attached[node] == 0) continue;
      const Eigen::Vector3d away = (rest[node] - start.position).cast<double>();
      const model::Vec3 place = (start.orientation.cast<double>().conjugate() * away).cast<float>();
      tables.attached.push_back(
          {{static_cast<float>(first + node), frame, 0, 0}, {place.x(), place.y(), place.z(), 0}});
    }
  }
}

shared::TetherRecord record(const model::NodeTethers& tethers, std::uint32_t first) {
  shared::TetherRecord record{};
  const auto number = [&](const model::Tether& tether) {
    return tether.anchor == model::Tether::kNone ? 0.0f : static_cast<float>(first + tether.anchor + 1);
  };
  record.anchors = {number(tethers[0]), tethers[0].length, number(tethers[1]), tethers[1].length};
  return record;
}

}  // namespace

shared::FrameRecord frameRecord(const model::Pose& pose) {
  const auto& q = pose.orientation;
  return {{pose.position.x(), pose.position.y(), pose.position.z(), 0}, {q.x(), q.y(), q.z(), q.w()}};
}

AttachmentTables attachmentTables(const model::Scene& scene) {
  AttachmentTables tables;
  const bool anyTethers =
      std::ranges::any_of(scene.cloths, [](const model::Cloth& cloth) { return cloth.tethers.has_value(); });
  std::uint32_t first = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    addAttached(scene, cloth, first, tables);
    if (cloth.tethers)
      for (const model::NodeTethers& tethers : model::nodeTethers(cloth))
        tables.tethers.push_back(record(tethers, first));
    else if (anyTethers)
      tables.tethers.resize(tables.tethers.size() + cloth.nodeCount());
    first += cloth.nodeCount();
  }
  return tables;
}

}  // namespace clothstream::simulation

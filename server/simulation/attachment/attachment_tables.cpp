// SPDX-License-Identifier: MIT
// Attached nodes and tethers of a scene.
#include "server/simulation/attachment/attachment_tables.h"

#include <algorithm>
#include <array>

#include "server/model/cloth_skin.h"
#include "server/model/tethers.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

// `first` is the cloth's first node in the scene.
void addAttached(const model::Scene& scene, const model::Cloth& cloth, std::uint32_t first,
                 const model::Vec3& origin, AttachmentTables& tables) {
  const std::vector<model::Vec3> places = model::startPositions(scene, cloth, origin);
  for (const model::Attachment& attachment : cloth.attachments) {
    model::Pose start = model::frameAt(scene, attachment, 0);
    start.position -= origin;
    const auto frame = static_cast<float>(tables.frames.size());
    tables.frames.push_back(frameRecord(start));
    const std::vector<std::uint8_t> attached = model::attachedNodes(cloth, attachment);
    for (std::uint32_t node = 0; node < attached.size(); ++node) {
      if (attached[node] == 0) continue;
      const Eigen::Vector3d away = (places[node] - start.position).cast<double>();
      const model::Vec3 place = (start.orientation.cast<double>().conjugate() * away).cast<float>();
      tables.attached.push_back({.node = static_cast<float>(first + node),
                                 .frame = frame,
                                 .reserved0 = 0,
                                 .reserved1 = 0,
                                 .place = vectorOf(place),
                                 .reserved2 = 0});
    }
  }
}

shared::TetherRecord record(const model::NodeTethers& tethers, std::uint32_t first) {
  const auto end = [&](const model::Tether& tether) -> shared::TetherEnd {
    const bool exists = tether.anchor != model::Tether::kNone;
    return {exists ? static_cast<float>(first + tether.anchor + 1) : 0.0f, tether.length};
  };
  return {{end(tethers[0]), end(tethers[1])}};
}

}  // namespace

shared::FrameRecord frameRecord(const model::Pose& pose) {
  return {vectorOf(pose.position), 0, texel(pose.orientation)};
}

AttachmentTables attachmentTables(const model::Scene& scene, const model::Vec3& origin) {
  AttachmentTables tables;
  const bool anyTethers =
      std::ranges::any_of(scene.cloths, [](const model::Cloth& cloth) { return cloth.tethers.has_value(); });
  std::uint32_t first = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    addAttached(scene, cloth, first, origin, tables);
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

// SPDX-License-Identifier: MIT
// Residuals of a packet of codec 3.
#include "proto/codec/hierarchical/packed_residuals.h"

#include <algorithm>

namespace clothstream::codec::hierarchical {
namespace {

// Reads the groups of the vertices from `begin` to `end` into `all`, which holds the residuals of all
// vertices.
bool readGroups(BitReader& in, const GroupResiduals& all, std::size_t begin, std::size_t end) {
  for (std::size_t first = begin; first < end; first += kGroupVertices) {
    GroupResiduals group = all;
    for (std::int32_t*& component : group.components)
      if (component != nullptr) component += first;
    if (group.stays != nullptr) group.stays += first;
    group.count = std::min<std::size_t>(kGroupVertices, end - first);
    if (!readGroup(in, group)) return false;
  }
  return true;
}

}  // namespace

bool PackedResiduals::allocate(const StreamLayout& layout, std::size_t coarseVertices) {
  coarse_ = coarseVertices;
  const std::size_t vertices = layout.vertexCount();
  bool isAllocated = stays_.allocate(vertices);
  for (auto& component : residuals_) isAllocated = isAllocated && component.allocate(vertices);
  if (layout.normals == NormalMode::octahedral)
    for (auto& component : ofNormals_) isAllocated = isAllocated && component.allocate(vertices);
  return isAllocated;
}

GroupResiduals PackedResiduals::all() const {
  return {
      .components = {residuals_[kAlongNormal].data(), residuals_[kAlongU].data(), residuals_[kAlongV].data()},
      .stays = stays_.data()};
}

bool PackedResiduals::readCoarse(std::span<const std::byte> section) {
  BitReader in(section);
  return readGroups(in, all(), 0, coarse_) && in.atEnd();
}

bool PackedResiduals::readFine(std::span<const std::byte> section) {
  BitReader in(section);
  const GroupResiduals ofNormals{.components = {ofNormals_[0].data(), ofNormals_[1].data()}};
  return readGroups(in, all(), coarse_, stays_.size()) &&
         readGroups(in, ofNormals, 0, ofNormals_[0].size()) && in.atEnd();
}

}  // namespace clothstream::codec::hierarchical

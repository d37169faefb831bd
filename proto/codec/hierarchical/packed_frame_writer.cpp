// SPDX-License-Identifier: MIT
// Writer of packets of codec 3.
#include "proto/codec/hierarchical/packed_frame_writer.h"

#include <algorithm>

#include "proto/codec/hierarchical/weight_plan.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// Writes the groups of the vertices from `begin` to `end`. `numbers` holds those of all vertices.
template <std::size_t components>
void writeGroups(const std::array<std::vector<std::uint32_t>, components>& numbers, std::size_t begin,
                 std::size_t end, BitWriter& out) {
  for (std::size_t first = begin; first < end; first += kGroupVertices) {
    GroupNumbers group{.count = std::min<std::size_t>(kGroupVertices, end - first),
                       .hasStays = components == kComponents};
    for (std::size_t c = 0; c < components; ++c) group.components[c] = numbers[c].data() + first;
    writeGroup(group, out);
  }
}

}  // namespace

PackedFrameWriter::PackedFrameWriter(const StreamLayout& layout) : packet_(layout) {
  for (auto& component : numbers_) component.resize(layout.vertexCount());
  const bool hasNormals = layout.normals == NormalMode::octahedral;
  for (auto& component : normalNumbers_) component.resize(hasNormals ? layout.vertexCount() : 0);
}

std::size_t PackedFrameWriter::packetBound() const {
  const std::size_t vertices = numbers_[0].size();
  // The coarse vertices and the others each end with a group that is not full.
  return packet_.headerBound() + WeightPlan::kMaxBytes + groupsBound(kComponents, vertices) +
         groupsBound(kComponents, 0) + groupsBound(normalNumbers_.size(), normalNumbers_[0].size());
}

void PackedFrameWriter::add(const ChunkResiduals& chunk, std::size_t count) {
  for (std::size_t c = 0; c < kComponents; ++c) {
    const std::int32_t* residuals = chunk.residual(kCodingOrder[c]);
    std::transform(residuals, residuals + count, numbers_[c].begin() + static_cast<std::ptrdiff_t>(vertices_),
                   zigzag);
  }
  for (std::size_t i = 0; chunk.anyStays && i < count; ++i)
    if (chunk.stays[i]) numbers_[0][vertices_ + i] = kStayNumber;
  vertices_ += count;
}

void PackedFrameWriter::addNormal(std::int8_t u, std::int8_t v) {
  normalNumbers_[0][normals_] = zigzag(u);
  normalNumbers_[1][normals_] = zigzag(v);
  ++normals_;
}

std::size_t PackedFrameWriter::write(const FrameRole& role, std::span<const std::byte> weights,
                                     std::span<std::byte> out) {
  std::byte* const start = std::ranges::copy(weights, packet_.begin(role, out)).out;
  packet_.endSection(start);
  BitWriter groups(start);
  writeGroups(numbers_, 0, coarse_, groups);
  packet_.endSection(groups.finish());
  writeGroups(numbers_, coarse_, vertices_, groups);
  writeGroups(normalNumbers_, 0, normals_, groups);
  packet_.endSection(groups.finish());
  return packet_.finish();
}

}  // namespace clothstream::codec::hierarchical

// SPDX-License-Identifier: MIT
// Tables of a hierarchy on the device.
#include "server/encode/hierarchy_tables.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/codec/hierarchical/residual_model.h"
#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {
namespace {

using codec::hierarchical::Hierarchy;
using codec::hierarchical::Neighbours;
using codec::hierarchical::Phase;
using vulkan::BufferPurpose;

using Row = std::array<std::uint32_t, 4>;

// One word for each number of the model.
constexpr std::size_t kScaleWords = sizeof codec::hierarchical::kScaleWeights / sizeof(std::int16_t);

// Packs ten bits each; the weights are within twice a whole.
constexpr std::uint32_t packed(const std::array<std::int16_t, 4>& parentWeights) {
  std::uint32_t word = 0;
  for (std::size_t i = 1; i < 4; ++i)
    word |= (static_cast<std::uint32_t>(parentWeights[i]) & 1023u) << 10 * (i - 1);
  return word;
}
static_assert(packed(codec::hierarchical::kEqualWeights) == shared::kEqualParentWeights);

using Words = std::span<std::uint32_t>;

void fillLinks(const Hierarchy& hierarchy, Words links) {
  const std::size_t vertices = hierarchy.neighbours.size();
  for (std::size_t slot = 0; slot < vertices; ++slot) {
    const auto row = [&](std::size_t at) {
      return links.begin() + static_cast<std::ptrdiff_t>(4 * (at * vertices + slot));
    };
    const Neighbours& neighbours = hierarchy.neighbours[slot];
    std::copy_n(neighbours.parents.begin(), 4, row(shared::kLinkParents));
    std::copy_n(neighbours.ring.begin(), 4, row(shared::kLinkRing));
    std::copy_n(neighbours.ring.begin() + 4, 4, row(shared::kLinkRing + 1));
    std::copy_n(hierarchy.nearest[slot].begin(), 4, row(shared::kLinkNearest));
  }
}

void fillSlots(const Hierarchy& hierarchy, Words slots) {
  auto next = std::ranges::copy(hierarchy.vertexOf, slots.begin()).out;
  for (const Neighbours& neighbours : hierarchy.neighbours) *next++ = packed(neighbours.weights);
}

void fillModel(const Hierarchy& hierarchy, Words model) {
  auto next = model.begin();
  for (const auto& ofClass : codec::hierarchical::kScaleWeights) {
    for (const codec::hierarchical::ScaleWeights& w : ofClass) {
      for (const std::int16_t weight : {w.parents, w.ring, w.last, w.normal, w.u, w.constant})
        *next++ = static_cast<std::uint32_t>(std::int32_t{weight});
    }
  }
  for (const Phase& phase : hierarchy.phases)
    next = std::ranges::copy(Row{phase.begin, phase.end, phase.weightClass, 0}, next).out;
}

}  // namespace

HierarchyTables::HierarchyTables(const vulkan::Device& device, const Hierarchy& hierarchy)
    : links_(device, BufferPurpose::state, shared::kLinkRows * hierarchy.neighbours.size() * sizeof(Row)),
      slots_(device, BufferPurpose::state, 2 * hierarchy.neighbours.size() * sizeof(std::uint32_t)),
      model_(device, BufferPurpose::state,
             kScaleWords * sizeof(std::uint32_t) + hierarchy.phases.size() * sizeof(Row)),
      upload_(device, BufferPurpose::upload, links_.bytes() + slots_.bytes() + model_.bytes()) {
  const Words words = upload_.mapped<std::uint32_t>();
  const std::size_t links = links_.bytes() / sizeof(std::uint32_t);
  const std::size_t slots = slots_.bytes() / sizeof(std::uint32_t);
  fillLinks(hierarchy, words.first(links));
  fillSlots(hierarchy, words.subspan(links, slots));
  fillModel(hierarchy, words.subspan(links + slots));
}

void HierarchyTables::recordUpload(vulkan::Recorder& recorder) const {
  recorder.copy(upload_, links_, links_.bytes());
  recorder.copy(upload_, slots_, slots_.bytes(), links_.bytes());
  recorder.copy(upload_, model_, model_.bytes(), links_.bytes() + slots_.bytes());
}

}  // namespace clothstream::encode

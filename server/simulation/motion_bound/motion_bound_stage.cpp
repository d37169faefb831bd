// SPDX-License-Identifier: MIT
// Bound on the motion of nodes on the device.
#include "server/simulation/motion_bound/motion_bound_stage.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "kernels/box_branches.h"
#include "kernels/box_faces.h"
#include "kernels/find_pairs.h"
#include "kernels/limit_pairs.h"
#include "kernels/shorten_motions.h"
#include "kernels/slide_nodes.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;
using vulkan::kStorage;
using vulkan::kTexels;

// Work of an invocation (vulkan::Recorder::dispatch).
constexpr std::uint32_t kFindWork = 16, kPairWork = 2;
// Places for pairs, for each node of the cloths.
constexpr std::uint32_t kNodePairs = 16, kEdgePairs = 48;
// The gap, as a share of the smallest radius.
constexpr float kGap = 0.25f;

float gapOf(std::span<const model::Cloth> cloths) {
  float radius = 1e30f;
  for (const model::Cloth& cloth : cloths)
    if (boundsMotion(cloth)) radius = std::min(radius, cloth.selfCollision->radius);
  return kGap * radius;
}

}  // namespace

bool MotionBoundStage::isIn(const model::Scene& scene) {
  return std::ranges::any_of(scene.cloths, boundsMotion);
}

MotionBoundStage::Pairs::Pairs(const vulkan::Device& device, const StateBuffers& state,
                               const MotionBoundStage& stage, bool edges, std::uint32_t places,
                               std::uint32_t workgroupSize)
    : capacity(places),
      list(device, BufferPurpose::state, std::size_t{places} * 2 * sizeof(std::uint32_t)),
      groups(device, BufferPurpose::indirect, sizeof(shared::PairGroups)),
      find(device,
           {.name = "find_pairs",
            .spirv = kernels::find_pairs,
            .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage, kStorage},
            .pushConstantBytes = sizeof(shared::PairPush),
            .workgroupSize = workgroupSize,
            .specialisation = {edges ? 1u : 0u}},
           {&stage.parts_.texels(), &stage.faces_.texels(), state.positions[0], state.positions[1], &stage.boxes_,
            &list, &groups},
           {&stage.parts_.texels(), &stage.faces_.texels(), state.positions[1], state.positions[0], &stage.boxes_,
            &list, &groups}),
      slide(device,
            {.name = "limit_pairs",
             .spirv = kernels::limit_pairs,
             .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage, kStorage, kStorage},
             .pushConstantBytes = sizeof(shared::PairPush),
             .workgroupSize = workgroupSize,
             .specialisation = {edges ? 1u : 0u, 1}},
            {&stage.parts_.texels(), &stage.faces_.texels(), state.positions[0], state.positions[1], &list, &groups,
             &stage.corrections_, &stage.shares_},
            {&stage.parts_.texels(), &stage.faces_.texels(), state.positions[1], state.positions[0], &list, &groups,
             &stage.corrections_, &stage.shares_}),
      limit(device,
            {.name = "limit_pairs",
             .spirv = kernels::limit_pairs,
             .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage, kStorage, kStorage},
             .pushConstantBytes = sizeof(shared::PairPush),
             .workgroupSize = workgroupSize,
             .specialisation = {edges ? 1u : 0u, 0}},
            {&stage.parts_.texels(), &stage.faces_.texels(), state.positions[0], state.positions[1], &list, &groups,
             &stage.corrections_, &stage.shares_},
            {&stage.parts_.texels(), &stage.faces_.texels(), state.positions[1], state.positions[0], &list, &groups,
             &stage.corrections_, &stage.shares_}) {}

MotionBoundStage::MotionBoundStage(const vulkan::Device& device, const model::Scene& scene,
                                   const StateBuffers& state, std::uint32_t workgroupSize)
    : tables_(motionBoundTables(scene.cloths)),
      gap_(gapOf(scene.cloths)),
      substepSeconds_(static_cast<float>(scene.substepSeconds())),
      parts_(device, tables_.parts),
      faces_(device, tables_.faces),
      branches_(device, tables_.branches),
      boxes_(device, BufferPurpose::state,
             std::size_t{tables_.boxCount} * CLOTHSTREAM_TREE_BOX_TEXELS * sizeof(shared::vec4)),
      corrections_(device, BufferPurpose::state, std::size_t{scene.nodeCount()} * 4 * sizeof(std::int32_t)),
      shares_(device, BufferPurpose::state, std::size_t{scene.nodeCount()} * sizeof(std::uint32_t)),
      report_(device, BufferPurpose::state, sizeof(Report)),
      reportReadback_(device, BufferPurpose::readback, 2 * sizeof(Report)),
      boxFaces_(device,
                {.name = "box_faces",
                 .spirv = kernels::box_faces,
                 .bindings = {kTexels, kTexels, kTexels, kStorage},
                 .pushConstantBytes = sizeof(shared::TreePush),
                 .workgroupSize = workgroupSize,
                 .specialisation = {}},
                {&faces_.texels(), state.positions[0], state.positions[1], &boxes_},
                {&faces_.texels(), state.positions[1], state.positions[0], &boxes_}),
      boxBranches_(device, {.name = "box_branches",
                            .spirv = kernels::box_branches,
                            .bindings = {kTexels, kStorage},
                            .pushConstantBytes = sizeof(shared::TreePush),
                            .workgroupSize = workgroupSize,
                            .specialisation = {}}),
      branchBindings_(device, boxBranches_, {&branches_.texels(), &boxes_}),
      nodePairs_(device, state, *this, false, kNodePairs * tables_.nodeCount, workgroupSize),
      edgePairs_(device, state, *this, true, kEdgePairs * tables_.nodeCount, workgroupSize),
      slideNodes_(device,
                  {.name = "slide_nodes",
                   .spirv = kernels::slide_nodes,
                   .bindings = {kTexels, kStorage, kStorage, kStorage, kStorage},
                   .pushConstantBytes = sizeof(shared::NodePush),
                   .workgroupSize = workgroupSize,
                   .specialisation = {}},
                  {&parts_.texels(), state.positions[0], state.positions[1], state.velocities[1], &corrections_},
                  {&parts_.texels(), state.positions[1], state.positions[0], state.velocities[0], &corrections_}),
      shortenMotions_(device,
                      {.name = "shorten_motions",
                       .spirv = kernels::shorten_motions,
                       .bindings = {kTexels, kStorage, kStorage, kStorage, kStorage, kStorage, kStorage, kStorage},
                       .pushConstantBytes = sizeof(shared::NodePush),
                       .workgroupSize = workgroupSize,
                       .specialisation = {}},
                      {&parts_.texels(), state.positions[0], state.positions[1], state.velocities[1], &shares_,
                       &nodePairs_.groups, &edgePairs_.groups, &report_},
                      {&parts_.texels(), state.positions[1], state.positions[0], state.velocities[0], &shares_,
                       &nodePairs_.groups, &edgePairs_.groups, &report_}) {
  assert(isIn(scene));
}

void MotionBoundStage::setCloths(std::span<const model::Cloth> cloths) {
  gap_ = gapOf(cloths);
}

void MotionBoundStage::setSubstepSeconds(double seconds) {
  substepSeconds_ = static_cast<float>(seconds);
}

void MotionBoundStage::recordTables(vulkan::Recorder& recorder) const {
  parts_.recordUpload(recorder);
  faces_.recordUpload(recorder);
  branches_.recordUpload(recorder);
  recorder.fill(corrections_, 0, corrections_.bytes());
  recorder.fill(shares_, std::bit_cast<std::uint32_t>(1.0f), shares_.bytes());
  for (const Pairs* pairs : {&nodePairs_, &edgePairs_}) recorder.fill(pairs->groups, 1, pairs->groups.bytes());
}

void MotionBoundStage::recordClear(vulkan::Recorder& recorder) const {
  recorder.fill(report_, 0, report_.bytes());
}

void MotionBoundStage::recordTree(vulkan::Recorder& recorder, std::uint32_t from) const {
  const auto faces = static_cast<std::uint32_t>(tables_.faces.size());
  recorder.dispatch(boxFaces_.from[from], shared::TreePush{0, faces, gap_}, faces);
  for (std::size_t level = 0; level + 1 < tables_.levels.size(); ++level) {
    const std::uint32_t first = tables_.levels[level], count = tables_.levels[level + 1] - first;
    recorder.barrier();
    recorder.dispatch(branchBindings_, shared::TreePush{first, count, gap_}, count);
  }
}

void MotionBoundStage::recordSubstep(vulkan::Recorder& recorder, std::uint32_t from) const {
  const auto pushOf = [&](const Pairs& pairs) {
    const bool edges = &pairs == &edgePairs_;
    return shared::PairPush{.firstPart = edges ? tables_.nodeCount : 0,
                            .partCount = edges ? tables_.edgeCount() : tables_.nodeCount,
                            .boxCount = tables_.boxCount,
                            .capacity = pairs.capacity,
                            .gap = gap_};
  };
  const shared::NodePush nodePush{.nodeCount = tables_.nodeCount,
                                  .nodePairs = nodePairs_.capacity,
                                  .edgePairs = edgePairs_.capacity,
                                  .gap = gap_,
                                  .substepRate = 1 / substepSeconds_};
  const auto onPairs = [&](Stage Pairs::* kernel) {
    recorder.barrier();
    for (const Pairs* pairs : {&nodePairs_, &edgePairs_})
      recorder.dispatchIndirect((pairs->*kernel).from[from], pushOf(*pairs), pairs->groups, 0,
                                std::uint64_t{tables_.nodeCount} * kPairWork);
  };
  recorder.barrier();
  for (const Pairs* pairs : {&nodePairs_, &edgePairs_}) {
    recorder.fill(pairs->groups, 0, sizeof(std::uint32_t), offsetof(shared::PairGroups, x));
    recorder.fill(pairs->groups, 0, sizeof(std::uint32_t), offsetof(shared::PairGroups, count));
  }
  recordTree(recorder, from);
  recorder.barrier();
  for (const Pairs* pairs : {&nodePairs_, &edgePairs_}) {
    const shared::PairPush push = pushOf(*pairs);
    recorder.dispatch(pairs->find.from[from], push, push.partCount, kFindWork);
  }
  onPairs(&Pairs::slide);
  recorder.barrier();
  recorder.dispatch(slideNodes_.from[from], nodePush, tables_.nodeCount);
  onPairs(&Pairs::limit);
  recorder.barrier();
  recorder.dispatch(shortenMotions_.from[from], nodePush, tables_.nodeCount);
}

void MotionBoundStage::recordReport(vulkan::Recorder& recorder, std::uint32_t slot) const {
  recorder.copy(report_, reportReadback_, report_.bytes(), 0, slot * report_.bytes());
}

MotionBoundStage::Report MotionBoundStage::report(std::uint32_t slot) const {
  return reportReadback_.mapped<const Report>()[slot];
}

}  // namespace clothstream::simulation

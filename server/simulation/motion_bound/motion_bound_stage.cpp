// SPDX-License-Identifier: MIT
// Bound on the motion of nodes on the device.
#include "server/simulation/motion_bound/motion_bound_stage.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <span>

#include "kernels/find_faces.h"
#include "kernels/find_pairs.h"
#include "kernels/limit_pairs.h"
#include "kernels/shorten_motions.h"
#include "kernels/slide_nodes.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

// Work of an invocation (vulkan::Recorder::dispatch): of a triangle that searches the tree, and of the
// expected pairs of a triangle or a node.
constexpr std::uint32_t kSearchWork = 32, kFindWork = 24, kLimitWork = 24;
// Boxes that a search visits at most, in the mean, and the most work of a search and of a pair.
constexpr std::uint64_t kMeanVisits = 2048;
constexpr std::uint32_t kMostSearchWork = 512, kFindPairWork = 32, kLimitPairWork = 24;
// Places for pairs, for each node of the cloths.
constexpr std::uint64_t kFacePairs = 128, kNodePairs = 16, kEdgePairs = 48;
// The gap, as a share of the smallest radius.
constexpr float kGap = 0.25f;

float gapOf(std::span<const model::Cloth> cloths) {
  float radius = 1e30f;
  for (const model::Cloth& cloth : cloths)
    if (model::boundsMotion(cloth)) radius = std::min(radius, cloth.selfCollision->radius);
  return kGap * radius;
}

// Twice the thickness of the thickest cloth.
float touchOf(std::span<const model::Cloth> cloths) {
  float thickness = 0;
  for (const model::Cloth& cloth : cloths)
    if (model::boundsMotion(cloth)) thickness = std::max(thickness, cloth.thickness);
  return 2 * thickness;
}

}  // namespace

bool MotionBoundStage::isIn(const model::Scene& scene) {
  return std::ranges::any_of(scene.cloths, model::boundsMotion);
}

// A dispatch has an invocation for each pair.
MotionBoundStage::List::List(const vulkan::Device& device, std::uint64_t places, std::uint32_t workgroupSize)
    : capacity(static_cast<std::uint32_t>(
          std::min(places, std::uint64_t{device.limits().maxDispatchX} * workgroupSize))),
      pairs(device, BufferPurpose::state, std::size_t{capacity} * 2 * sizeof(std::uint32_t)),
      emptyGroups(device, BufferPurpose::upload,
                  (shared::kPartSizes + std::size_t{3} * parts()) * sizeof(std::uint32_t)),
      groups(device, BufferPurpose::indirect, emptyGroups.bytes()) {
  const std::span<std::uint32_t> numbers = emptyGroups.mapped<std::uint32_t>();
  std::ranges::fill(numbers, 0u);
  for (std::size_t i = shared::kPartSizes; i < numbers.size(); i += 3) numbers[i + 1] = numbers[i + 2] = 1;
}

void MotionBoundStage::List::recordClear(vulkan::Recorder& recorder) const {
  recorder.copy(emptyGroups, groups, groups.bytes());
}

MotionBoundStage::Limits::Limits(const vulkan::Device& device, const StateBuffers& state,
                                 const MotionBoundStage& stage, const List& list, bool edges,
                                 std::uint32_t workgroupSize)
    : slide(bindLimit(device, state, stage, list, edges, true, workgroupSize)),
      limit(bindLimit(device, state, stage, list, edges, false, workgroupSize)) {}

StateBindings MotionBoundStage::Limits::bindLimit(const vulkan::Device& device, const StateBuffers& state,
                                                  const MotionBoundStage& stage, const List& list, bool edges,
                                                  bool slides, std::uint32_t workgroupSize) {
  return bindStates(device,
                    {device, kernels::limit_pairs, workgroupSize, {edges ? 1u : 0u, slides ? 1u : 0u}},
                    [&](std::size_t from) {
                      return BufferList{&stage.parts_.texels(),
                                        &stage.faces_.texels(),
                                        state.positions[from],
                                        state.positions[1 - from],
                                        &list.pairs,
                                        &list.groups,
                                        &stage.corrections_,
                                        &stage.shares_};
                    });
}

MotionBoundStage::MotionBoundStage(const vulkan::Device& device, const model::Scene& scene,
                                   const StateBuffers& state, std::uint32_t workgroupSize)
    : tables_(motionBoundTables(scene.cloths)),
      gap_(gapOf(scene.cloths)),
      touch_(touchOf(scene.cloths)),
      parts_(device, tables_.parts),
      faces_(device, tables_.faces),
      tree_(device, tables_, faces_.texels(), state, workgroupSize),
      depths_(device, tables_.nodeCount, parts_.texels(), state, workgroupSize),
      corrections_(device, BufferPurpose::state, std::size_t{scene.nodeCount()} * 4 * sizeof(std::int32_t)),
      shares_(device, BufferPurpose::state, std::size_t{scene.nodeCount()} * sizeof(std::uint32_t)),
      report_(device, BufferPurpose::state, sizeof(Report)),
      reportReadback_(device, BufferPurpose::readback, 2 * sizeof(Report)),
      facePairs_(device, kFacePairs * tables_.nodeCount, workgroupSize),
      nodePairs_(device, kNodePairs * tables_.nodeCount, workgroupSize),
      edgePairs_(device, kEdgePairs * tables_.nodeCount, workgroupSize),
      findFaces_(device, {device, kernels::find_faces, workgroupSize},
                 {&faces_.texels(), &tree_.boxes(), &facePairs_.pairs, &facePairs_.groups}),
      findPairs_(bindStates(device, {device, kernels::find_pairs, workgroupSize},
                            [&](std::size_t from) {
                              return BufferList{
                                  &faces_.texels(),   state.positions[from], state.positions[1 - from],
                                  &facePairs_.pairs,  &facePairs_.groups,    &nodePairs_.pairs,
                                  &nodePairs_.groups, &edgePairs_.pairs,     &edgePairs_.groups};
                            })),
      nodeLimits_(device, state, *this, nodePairs_, false, workgroupSize),
      edgeLimits_(device, state, *this, edgePairs_, true, workgroupSize),
      slideNodes_(bindStates(device, {device, kernels::slide_nodes, workgroupSize},
                             [&](std::size_t from) {
                               const std::size_t to = 1 - from;
                               return BufferList{&parts_.texels(), state.positions[from], state.positions[to],
                                                 state.velocities[to], &corrections_};
                             })),
      shortenMotions_(
          bindStates(device, {device, kernels::shorten_motions, workgroupSize}, [&](std::size_t from) {
            const std::size_t to = 1 - from;
            return BufferList{
                &parts_.texels(), state.positions[from], state.positions[to], state.velocities[to],
                &shares_,         &facePairs_.groups,    &nodePairs_.groups,  &edgePairs_.groups,
                &report_};
          })) {
  assert(isIn(scene));
}

void MotionBoundStage::setCloths(std::span<const model::Cloth> cloths) {
  gap_ = gapOf(cloths);
  touch_ = touchOf(cloths);
}

void MotionBoundStage::recordTables(vulkan::Recorder& recorder) {
  parts_.recordUpload(recorder);
  faces_.recordUpload(recorder);
  tree_.recordUpload(recorder);
  recorder.fill(corrections_, 0, corrections_.bytes());
  recorder.fill(shares_, std::bit_cast<std::uint32_t>(1.0f), shares_.bytes());
}

void MotionBoundStage::recordInputs(vulkan::Recorder& recorder, const Tick&) {
  recorder.fill(report_, 0, report_.bytes());
  depths_.recordClear(recorder);
}

void MotionBoundStage::recordParts(vulkan::Recorder& recorder, const vulkan::Bindings& bindings,
                                   shared::PairPush push, const List& list, std::uint64_t expected,
                                   std::uint64_t work) {
  for (std::uint32_t part = 0; part < list.parts(); ++part) {
    push.firstPair = part * shared::kPartPairs;
    const std::uint64_t pairs = std::min(shared::kPartPairs, list.capacity - push.firstPair);
    const std::uint64_t now = std::min(expected, pairs * work);
    recorder.dispatchIndirect(bindings, push, list.groups,
                              (shared::kPartSizes + 3 * std::size_t{part}) * sizeof(std::uint32_t), now,
                              pairs * work);
    expected -= now;
  }
}

void MotionBoundStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const std::uint32_t from = substep.from;
  const auto faceCount = static_cast<std::uint32_t>(tables_.faces.size());
  const shared::PairPush push{
      .faceCount = faceCount,
      .boxCount = tables_.boxCount,
      .facePairs = facePairs_.capacity,
      .nodePairs = nodePairs_.capacity,
      .edgePairs = edgePairs_.capacity,
      .gap = gap_,
      .visits = static_cast<std::uint32_t>(kMeanVisits * faceCount / shared::kVisitBlock),
      .firstPair = 0};
  const shared::NodePush nodePush{.nodeCount = tables_.nodeCount,
                                  .facePairs = facePairs_.capacity,
                                  .nodePairs = nodePairs_.capacity,
                                  .edgePairs = edgePairs_.capacity,
                                  .gap = gap_,
                                  .substepRate = 1 / static_cast<float>(substep.tick.substepSeconds)};
  const auto onPairs = [&](StateBindings Limits::*kernel) {
    const std::uint64_t most = std::uint64_t{tables_.nodeCount} * kLimitWork;
    recorder.barrier();
    recordParts(recorder, (nodeLimits_.*kernel)[from], push, nodePairs_, most, kLimitPairWork);
    recordParts(recorder, (edgeLimits_.*kernel)[from], push, edgePairs_, most, kLimitPairWork);
  };
  recorder.barrier();
  for (const List* list : {&facePairs_, &nodePairs_, &edgePairs_}) list->recordClear(recorder);
  tree_.recordFit(recorder, from, gap_);
  recorder.barrier();
  recorder.dispatch(findFaces_, push, faceCount, kSearchWork, kMostSearchWork);
  recorder.barrier();
  recordParts(recorder, findPairs_[from], push, facePairs_, std::uint64_t{faceCount} * kFindWork,
              kFindPairWork);
  onPairs(&Limits::slide);
  recorder.barrier();
  recorder.dispatch(slideNodes_[from], nodePush, tables_.nodeCount);
  onPairs(&Limits::limit);
  recorder.barrier();
  recorder.dispatch(shortenMotions_[from], nodePush, tables_.nodeCount);
}

void MotionBoundStage::recordEnd(vulkan::Recorder& recorder, const Tick&, std::uint32_t present,
                                 const shared::CollisionPush& collision) {
  depths_.record(recorder, present, touch_, collision);
}

void MotionBoundStage::recordReport(vulkan::Recorder& recorder, const Tick& tick) {
  depths_.recordReport(recorder, tick.slot);
  recorder.copy(report_, reportReadback_, report_.bytes(), 0, tick.slot * report_.bytes());
}

MotionBoundStage::Report MotionBoundStage::report(std::uint32_t slot) const {
  return reportReadback_.mapped<const Report>()[slot];
}

}  // namespace clothstream::simulation

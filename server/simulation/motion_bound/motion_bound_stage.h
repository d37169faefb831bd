// SPDX-License-Identifier: MIT
// Bound on the motion of nodes that keeps cloth from passing through itself and other cloth.
#pragma once

#include <cstdint>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/simulation/motion_bound/box_tree.h"
#include "server/simulation/motion_bound/depth_meter.h"
#include "server/simulation/motion_bound/motion_bound_tables.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "shaders/collision/collision.h"

namespace clothstream::simulation {

// Belongs to the device's thread. The last stage of a substep. It finds all pairs of a node and a triangle,
// and of two edges, that could meet between the substep's start and its end. It separates those that come too
// near, and then shortens the motion of nodes so that no pair meets (docs/simulation.md). Pairs and visits of
// the search are limited in proportion to the nodes.
class MotionBoundStage final : public Stage {
 public:
  // At least one cloth must have model::boundsMotion(). Throws std::runtime_error if the device has too
  // little memory. Results do not depend on `workgroupSize`.
  MotionBoundStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
                   std::uint32_t workgroupSize);

  static bool isIn(const model::Scene& scene);

  // Sets the gap, which follows from the radii of the cloths.
  void setCloths(std::span<const model::Cloth> cloths) override;

  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;
  // Measures how deep the nodes are inside the colliders.
  void recordEnd(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present,
                 const shared::CollisionPush& collision) override;
  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;

  struct Report {
    // Substeps in which no node moved, because a list of pairs was too short or the search for them took too
    // long.
    std::uint32_t overflows = 0;
    std::uint32_t shortened = 0;  // motions that were shortened
  };
  // Report of the tick with this slot, once it is complete.
  Report report(std::uint32_t slot) const;
  // For each collider, as the device numbers them: depth inside any collider of the deepest node that touches
  // it, in metres. 0: none is inside.
  std::span<const float> depths(std::uint32_t slot) const { return depths_.depths(slot); }

 private:
  // A list of pairs, and its counts and dispatch sizes. A dispatch works on one part of the list, so that its
  // time is bounded, however many pairs there are.
  struct List {
    List(const vulkan::Device& device, std::uint64_t places, std::uint32_t workgroupSize);
    // Begins an empty list.
    void recordClear(vulkan::Recorder& recorder) const;
    std::uint32_t parts() const { return (capacity + shared::kPartPairs - 1) / shared::kPartPairs; }

    std::uint32_t capacity;
    vulkan::Buffer pairs, emptyGroups, groups;
  };
  // Kernels that separate and limit one kind of pairs.
  struct Limits {
    Limits(const vulkan::Device& device, const StateBuffers& state, const MotionBoundStage& stage,
           const List& list, bool edges, std::uint32_t workgroupSize);

    static StateBindings bindLimit(const vulkan::Device& device, const StateBuffers& state,
                                   const MotionBoundStage& stage, const List& list, bool edges, bool slides,
                                   std::uint32_t workgroupSize);

    StateBindings slide, limit;
  };

  void recordTables(vulkan::Recorder& recorder) override;
  // Runs a kernel on each part of a list. Most parts are empty: `expected` is the work of all of them, and
  // `work` that of a pair (vulkan::Recorder::dispatch).
  static void recordParts(vulkan::Recorder& recorder, const vulkan::Bindings& bindings, shared::PairPush push,
                          const List& list, std::uint64_t expected, std::uint64_t work);

  MotionBoundTables tables_;
  float gap_, touch_;
  DeviceTable parts_, faces_;
  BoxTree tree_;
  DepthMeter depths_;
  vulkan::Buffer corrections_, shares_, report_, reportReadback_;
  List facePairs_, nodePairs_, edgePairs_;
  vulkan::Bindings findFaces_;
  StateBindings findPairs_;
  Limits nodeLimits_, edgeLimits_;
  StateBindings slideNodes_, shortenMotions_;
};

}  // namespace clothstream::simulation

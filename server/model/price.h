// SPDX-License-Identifier: MIT
// Price of a scene: time on the device and memory, computed before the scene is made or changed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/model/crowding.h"
#include "server/model/scene.h"
#include "server/model/springs.h"
#include "server/model/surface.h"

namespace clothstream::model {

// Speed of a device, as simulation::SpeedMeter measures it.
struct DeviceSpeed {
  double nodeStepSeconds = 0;  // one node in one substep of a large grid that only springs move
  double dispatchSeconds = 0;  // a kernel call that waits for the one before it
  double workgroupFactor = 1;  // time of work in one workgroup, relative to the same work on the whole device
  bool gpu = false;            // the kernels have the settings for GPUs
  // A node-step for each node, however few these are: an invocation does its steps one after the other.
  double serialStepSeconds = 0;
};

// Work of one tick.
struct Work {
  double nodeSteps = 0;       // over the whole device, in node-steps (DeviceSpeed)
  double groupNodeSteps = 0;  // in single workgroups
  // In single workgroups with the settings for CPUs, over the whole device with those for GPUs, which need
  // gpuDispatches more.
  double cpuGroupNodeSteps = 0, gpuDispatches = 0;
  double dispatches = 0;
  double serialSteps = 0;  // colliders of a node, in node-steps; part of nodeSteps

  Work& operator+=(const Work& other) {
    nodeSteps += other.nodeSteps;
    groupNodeSteps += other.groupNodeSteps;
    cpuGroupNodeSteps += other.cpuGroupNodeSteps;
    gpuDispatches += other.gpuDispatches;
    dispatches += other.dispatches;
    serialSteps += other.serialSteps;
    return *this;
  }
  void scale(double factor) {
    for (double* part :
         {&nodeSteps, &groupNodeSteps, &cpuGroupNodeSteps, &gpuDispatches, &dispatches, &serialSteps})
      *part *= factor;
  }
  double seconds(const DeviceSpeed& speed) const {
    const double whole = nodeSteps + (speed.gpu ? cpuGroupNodeSteps : 0);
    const double groups = groupNodeSteps + (speed.gpu ? 0 : cpuGroupNodeSteps);
    return (whole + groups * speed.workgroupFactor) * speed.nodeStepSeconds +
           (dispatches + (speed.gpu ? gpuDispatches : 0)) * speed.dispatchSeconds +
           serialSteps * speed.serialStepSeconds;
  }
};

// Work of a search for the nearest point of a triangle mesh, in node-steps.
double searchWork(const ClosedMesh& mesh);

// Work of a surface of the real room for each node and substep, in node-steps. A third of the nodes are
// assumed to be near each surface.
double surfaceWork(const Surface& surface);

// Work of a collider with this shape for each node and substep, in node-steps. A third of the nodes are
// assumed to be near each collider.
double colliderWork(const Shape& shape);

// The constructor takes time linear in nodes and springs, and n log n in nodes with self-collision; the other
// functions only depend on the number of cloths, so parameters can be priced often.
//
// Searches for pairs are priced for the crowding of the scene's start. Cloth that crowds later costs more
// than its price, up to limits in proportion to the nodes.
//
// Solvers that end early are priced with all their iterations. The weights in the .cpp are fitted to measured
// ticks on software Vulkan (clothstream-bench price) and were compared with an NVIDIA H200.
class PriceModel {
 public:
  explicit PriceModel(const Scene& scene);

  // Work of a tick and its frame. `scene` is the scene of the constructor, whose parameters may have changed
  // since. `colliders` includes those of participants, whose shapes are assumed to be boxes, the costliest
  // that participants may have. A part of a collider is one that fewer nodes are near.
  Work work(const Scene& scene, double colliders) const;
  Work work(const Scene& scene) const { return work(scene, static_cast<double>(scene.colliders.size())); }
  // Work of a tick in addition to that, while participants move the joints of colliders.
  Work movedJointsWork(const Scene& scene) const;
  // Work of a tick in addition to that, while participants hold this number of local winds.
  Work heldWindWork(const Scene& scene, std::size_t winds) const;
  // Work of a tick in addition to that, while participants have surfaces of the real room whose surfaceWork()
  // is `searches` together.
  Work surfacesWork(const Scene& scene, double searches) const;
  // Memory that they take, in bytes.
  double surfaceBytes(std::size_t triangles) const;
  // Memory on the device and on the host, in bytes.
  double bytes(const Scene& scene) const;

 private:
  // Counts of one cloth.
  struct ClothCounts {
    std::uint64_t nodes = 0;
    std::array<std::uint64_t, kSpringKinds> springs{};
    std::uint64_t pairs = 0;  // sum over nodes of the squared number of their structural and shear springs
    std::uint32_t mostAtNode = 0;  // of these springs
    std::uint64_t hinges = 0;
    std::uint64_t allSprings() const { return springs[0] + springs[1] + springs[2]; }
  };
  static ClothCounts countsOf(const Grid& grid);
  Work solverWork(const Scene& scene, const Cloth& cloth, const ClothCounts& counts) const;

  std::vector<ClothCounts> cloths_;
  SceneCrowding crowding_;
};

}  // namespace clothstream::model

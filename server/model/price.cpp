// SPDX-License-Identifier: MIT
#include "server/model/price.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "server/model/distance_grid.h"
#include "server/model/gas.h"
#include "server/model/mesh.h"
#include "server/model/springs.h"

namespace clothstream::model {
namespace {

// Weights in node-steps, fitted to ticks of 16x16 to 256x256 nodes on software Vulkan with two processors.
// A node of a grid has six springs.
constexpr double kNode = 0.4, kSpring = 0.1, kMeshFactor = 2;
constexpr double kRungeKutta = 14;  // as a factor
constexpr double kGas = 1;          // of a node
constexpr double kAir = 0.5, kLocalWind = 0.3, kHinge = 2, kSelfCollision = 20, kMotionBound = 120;
// Crowding of a few layers, which kSelfCollision and kMotionBound include. Beyond it each node costs
// kCrowdedBall in each of the searches of a tick, and kCrowdedTriangle in a substep, for one more ball or
// triangle in its cell. Both are limited, as the searches are (SelfCollisionStage, MotionBoundStage).
constexpr double kFewBalls = 12, kMostBalls = 1024, kCrowdedBall = 2.5, kSearches = 3;
constexpr double kFewTriangles = 8, kMostTriangles = 40, kCrowdedTriangle = 100;
// Each node and collider costs these. Each plane of a shape costs kPlane more.
constexpr double kCollider = 0.5, kPlane = 0.05, kBoxPlanes = 6, kGatherCollider = 0.1;
// Each spring of the linear system costs these. ACAD is assumed to have a quarter of its springs active.
constexpr double kPrepare = 2, kIteration = 0.5, kActive = 0.25;
// Each pair of springs that share a node costs these in an assembled system.
constexpr double kFillPair = 0.6, kMultiplyPair = 0.22;
constexpr double kCorrection = 0.45;  // of a spring, with xpbd
// Each node costs kCoarseNode in a coarse correction, and each of about four links of a coarse node
// kCoarseLink in a sweep.
constexpr double kCoarseNode = 1, kCoarseLink = 1.4, kCoarseLinks = 4;
// A search in a triangle mesh costs each node kSearch, and kCrowdedSearch more for each triangle beyond
// kFewAround that lies in one place (ClosedMesh::crowding), at most kMostSearch, as the device limits it
// (kMostSolidVisits). Distances that are sampled cost it kGridWork.
constexpr double kSearch = 6, kFewAround = 16, kCrowdedSearch = 1.2, kMostSearch = 4096, kGridWork = 3;
// Surfaces of the real room cost each node kSurfaceNode. Of a third of the nodes, which lie on one, the paths
// are searched kSurfaceTests times in a substep. A search visits the way down a tree: the binary logarithm of
// its triangles, but at least kLeastSurfaceSearch.
//
// All 4,096 nodes of a sheet on floors of 900, 10,000, 50,000 and 100,000 triangles, in two surfaces, add 25
// to 29, 32 to 39, 46 to 48 and 52 to 58 node-steps (clothstream-bench garment, smallest times of two runs on
// two cores of lavapipe, 30 November 2026), of which 7 are there next to all surfaces. A third of the nodes
// is then 13 to 24, and the price 15 to 22.
constexpr double kSurfaceNode = 6, kSurfaceTests = 3, kNearSurface = 1.0 / 3, kLeastSurfaceSearch = 4;
// Each vertex costs kSkinVertex, and each triangle kRefitTriangle, in a tick of a solid that joints move.
constexpr double kStrides = 10;  // searches of a path near a body that joints move fast, instead of one
constexpr double kSkinVertex = 20, kRefitTriangle = 5, kSkinDispatches = 4;
// Each node of a cloth that follows joints costs kClothSkinTick in a tick, for its place and normal, and
// kClothSkinStep in a substep, where it is kept near its place. Its joints, limits, and places and normals at
// both ends take kClothSkinBytes. Measured: 1 to 2 in a tick (stage "attachments" of the scene `dress`), and
// 1.1 to 1.5 in each of ten substeps, the tick included (clothstream-bench garment, as above).
constexpr double kClothSkinTick = 2, kClothSkinStep = 1.1, kClothSkinBytes = 128;
constexpr double kClothSkinDispatches = 4;
// Each node costs these in a tick and in a frame. The frame includes entropy coding on the host.
constexpr double kTick = 2, kFrame = 8;
constexpr double kTickDispatches = 6, kFrameDispatches = 12, kBoundDispatches = 14;

// Nodes of the largest cloth that one workgroup simulates (SolveStage, XpbdStage): on every device, and with
// the settings for CPUs alone.
constexpr std::uint32_t kGroupSolve = 1024, kGroupMesh = 8192;
constexpr std::uint32_t kCpuGroupSolve = 4096, kCpuGroupGrid = 2048;

// Bytes on device and host, measured like the weights.
constexpr double kSceneBytes = 8e6;
constexpr double kNodeBytes = 1200, kSpringBytes = 64, kMeshNodeBytes = 400;
constexpr double kSelfCollisionBytes = 600, kMotionBoundBytes = 2000, kHingeBytes = 200, kSystemBytes = 64,
                 kPairBytes = 40;
constexpr double kGasBytes = 250;           // of a node of a mesh that can hold gas
constexpr double kTriangleBytes = 400;      // of a solid
constexpr double kDistancePointBytes = 48;  // of a solid's grid, three times 16
constexpr double kSkinVertexBytes = 500;
// Memory of the surfaces of a scene: buffers for the most triangles on the device, and for each triangle the
// mesh and its tables on the host.
constexpr double kSurfaceBuffersBytes = 27e6, kSurfaceTriangleBytes = 250;
constexpr double kCoarseBytes = 40, kCoarseMeshBytes = 250;

// Copies of a scene's lists: as it started, as it was accepted, as it runs, and as descriptions.
constexpr double kListCopies = 6;

double listBytes(const auto& list) {
  return kListCopies * static_cast<double>(sizeof(list[0]) * list.size());
}

// Lists of a cloth that select nodes, and the keys of its attachments.
double listsOf(const Cloth& cloth) {
  double bytes = listBytes(cloth.pins) + listBytes(cloth.pinnedVertices) + listBytes(cloth.pinnedRegions);
  for (const Attachment& attachment : cloth.attachments)
    bytes += listBytes(attachment.ranges) + listBytes(attachment.vertices) + listBytes(attachment.regions) +
             listBytes(attachment.motion.keys);
  return bytes;
}

Work coarseWork(const CoarseCorrection& coarse, std::uint32_t substeps, double nodeWork) {
  const double side = coarse.cells + 1;
  Work work{.nodeSteps = nodeWork,
            .groupNodeSteps = kCoarseLink * kCoarseLinks * side * side * coarse.sweeps,
            .dispatches = 3};
  work.scale(coarse.levels * ((substeps + coarse.every - 1) / coarse.every));
  return work;
}

// Work of the kernels that move the vertices of a solid, in each tick.
Work skinWork(const Shape& shape) {
  const auto* solid = std::get_if<Solid>(&shape);
  if (solid == nullptr || !(*solid)->skin) return {};
  return {.nodeSteps = kSkinVertex * static_cast<double>((*solid)->vertices.size()) +
                       kRefitTriangle * static_cast<double>((*solid)->triangles.size()),
          .groupNodeSteps = 0,
          .dispatches = kSkinDispatches};
}

// Tables of the joints of a solid, and the keys of its animation.
double skinBytes(const ClosedMesh& mesh) {
  if (!mesh.skin) return 0;
  double bytes = kSkinVertexBytes * static_cast<double>(mesh.vertices.size());
  for (const JointKey& key : mesh.skin->keys) bytes += listBytes(key.joints);
  return bytes;
}

// Samples of distances: on the host, for the upload, and on the device.
double gridBytes(const ClosedMesh& mesh) {
  if (mesh.distanceCell == 0) return 0;
  return kDistancePointBytes * static_cast<double>(distanceGridOf(mesh, mesh.distanceCell).points());
}

// Whether the air moves the cloth.
bool isBlown(const Scene& scene, const Cloth& cloth) {
  return scene.environment.airDensity != 0 && (cloth.drag != 0 || cloth.lift != 0);
}

bool isSystem(SolverKind kind) {
  return kind == SolverKind::constraint || kind == SolverKind::acad || kind == SolverKind::implicitEuler;
}

}  // namespace

double searchWork(const ClosedMesh& mesh) {
  return std::min(kSearch + kCrowdedSearch * std::max(mesh.crowding - kFewAround, 0.0), kMostSearch);
}

double surfaceWork(const Surface& surface) {
  const double depth = std::log2(static_cast<double>(surface.triangles.size()));
  const double search =
      std::max(depth, kLeastSurfaceSearch) + kCrowdedSearch * std::max(surface.crowding - kFewAround, 0.0);
  return kNearSurface * std::min(kSurfaceTests * search, kMostSearch);
}

double colliderWork(const Shape& shape) {
  const auto withPlanes = [](double planes) { return kCollider + kPlane * planes; };
  return std::visit(
      ShapeVisitor{
          [&](const Sphere&) { return withPlanes(0); }, [&](const Capsule&) { return withPlanes(0); },
          [&](const Plane&) { return withPlanes(1); }, [&](const Box&) { return withPlanes(kBoxPlanes); },
          [&](const Hull& hull) { return withPlanes(static_cast<double>(hull->planes.size())); },
          [](const Solid& solid) { return solid->distanceCell > 0 ? kGridWork : searchWork(*solid); }},
      shape);
}

PriceModel::ClothCounts PriceModel::countsOf(const Grid& grid) {
  const std::uint64_t rows = grid.rows, columns = grid.columns, nodes = rows * columns;
  ClothCounts counts{.nodes = nodes, .mostAtNode = 8};
  counts.springs[0] = rows * (columns - 1) + columns * (rows - 1);
  counts.springs[1] = 2 * (rows - 1) * (columns - 1);
  counts.springs[2] = rows * (columns - std::min<std::uint64_t>(columns, 2)) +
                      columns * (rows - std::min<std::uint64_t>(rows, 2));
  counts.pairs = nodes * counts.mostAtNode * counts.mostAtNode;
  // A quad has two hinges for each way to split it.
  counts.hinges = 6 * nodes;
  return counts;
}

PriceModel::PriceModel(const Scene& scene) : crowding_(crowdingOf(scene)) {
  for (const Cloth& cloth : scene.cloths) {
    if (!cloth.mesh) {
      cloths_.push_back(countsOf(cloth.grid));
      continue;
    }
    ClothCounts counts{.nodes = cloth.nodeCount(), .hinges = 3 * cloth.mesh->shape.triangles.size()};
    std::vector<std::uint32_t> springsAt(cloth.nodeCount());
    for (const SpringLink& link : cloth.mesh->links) {
      ++counts.springs[static_cast<std::size_t>(link.kind)];
      if (link.kind == SpringKind::bend) continue;
      ++springsAt[link.a];
      ++springsAt[link.b];
    }
    for (const std::uint32_t springs : springsAt) {
      counts.pairs += std::uint64_t{springs} * springs;
      counts.mostAtNode = std::max(counts.mostAtNode, springs);
    }
    cloths_.push_back(counts);
  }
}

Work PriceModel::solverWork(const Scene& scene, const Cloth& cloth, const ClothCounts& counts) const {
  const Solver& solver = cloth.solver;
  const double iterations = solver.iterations;
  const double mesh = cloth.mesh ? kMeshFactor : 1;
  const double all = static_cast<double>(counts.allSprings());
  Work work;
  if (solver.kind == SolverKind::xpbd) {
    const double corrections = mesh * kCorrection * all * iterations;
    const double dispatches = 1 + iterations * (cloth.mesh ? 2.0 * counts.mostAtNode : 3);
    const bool group = cloth.mesh && counts.nodes <= kGroupMesh;
    const bool cpuGroup = !cloth.mesh && counts.nodes <= kCpuGroupGrid;
    (group ? work.groupNodeSteps : cpuGroup ? work.cpuGroupNodeSteps : work.nodeSteps) = corrections;
    work.dispatches = group || cpuGroup ? 2 : dispatches;
    work.gpuDispatches = cpuGroup ? dispatches - 2 : 0;
  } else if (isSystem(solver.kind)) {
    const bool bend = solver.kind == SolverKind::implicitEuler || solver.bendConstraints;
    const double constraints = bend ? all : static_cast<double>(counts.springs[0] + counts.springs[1]);
    const bool group = counts.nodes <= kGroupSolve, cpuGroup = !group && counts.nodes <= kCpuGroupSolve;
    const double active = solver.kind == SolverKind::acad ? kActive : 1;
    double prepare = mesh * kPrepare * constraints, iterate = mesh * kIteration * constraints * iterations;
    if (isAssembled(solver)) {
      const double pairs = static_cast<double>(counts.pairs) * (bend ? 2.25 : 1);
      prepare += kFillPair * pairs;
      iterate = kMultiplyPair * pairs * iterations;
    }
    work.nodeSteps = active * prepare;
    (group ? work.groupNodeSteps : cpuGroup ? work.cpuGroupNodeSteps : work.nodeSteps) += active * iterate;
    const double dispatches = 4 + 2 * iterations;
    work.dispatches = group || cpuGroup ? 5 : dispatches;
    work.gpuDispatches = cpuGroup ? std::max(0.0, dispatches - 5) : 0;
    if (isAcad(solver, AcadMode::limit)) {
      work.nodeSteps += active * prepare * (kLimitRounds - 1);
      work.dispatches += 5 * (kLimitRounds - 1);
    }
  }
  work.scale(scene.substeps);
  return work;
}

Work PriceModel::work(const Scene& scene, double colliders) const {
  assert(scene.cloths.size() == cloths_.size());
  const double substeps = scene.substeps;
  double collisions = 0;
  for (const Collider& collider : scene.colliders) collisions += colliderWork(collider.shape);
  const auto own = static_cast<double>(scene.colliders.size());
  if (colliders > own) collisions += (colliders - own) * colliderWork(Box{});
  const double crowdedBalls = std::clamp(crowding_.balls - kFewBalls, 0.0, kMostBalls);
  const double crowdedTriangles = std::clamp(crowding_.triangles - kFewTriangles, 0.0, kMostTriangles);
  const double framesPerTick = static_cast<double>(scene.streamRate) / scene.simulationRate;
  Work work{.dispatches = kTickDispatches + kFrameDispatches * framesPerTick + substeps,
            .serialSteps = substeps * collisions};
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    const Cloth& cloth = scene.cloths[i];
    const ClothCounts& counts = cloths_[i];
    const auto nodes = static_cast<double>(counts.nodes);
    double step = kNode * nodes + kSpring * static_cast<double>(counts.allSprings());
    if (cloth.mesh) step *= kMeshFactor;
    if (scene.integrator == Integrator::rungeKutta4) step *= kRungeKutta;
    if (isBlown(scene, cloth)) step += (kAir + kLocalWind * static_cast<double>(scene.winds.size())) * nodes;
    if (hasGas(cloth)) step += kGas * nodes;
    if (cloth.dihedralBending != 0) step += kHinge * static_cast<double>(counts.hinges);
    if (cloth.selfCollision)
      step += (boundsMotion(cloth) ? kSelfCollision + kMotionBound : kSelfCollision) * nodes;
    if (cloth.selfCollision) work.nodeSteps += kSearches * kCrowdedBall * crowdedBalls * nodes;
    if (boundsMotion(cloth)) step += kCrowdedTriangle * crowdedTriangles * nodes;
    step += collisions * nodes;
    work.nodeSteps +=
        substeps * step + nodes * (kTick + kFrame * framesPerTick + kGatherCollider * colliders);
    work += solverWork(scene, cloth, counts);
    if (cloth.skin) work.nodeSteps += (kClothSkinTick + kClothSkinStep * substeps) * nodes;
    if (cloth.coarse) work += coarseWork(*cloth.coarse, scene.substeps, nodes * (kCoarseNode + collisions));
  }
  for (const Collider& collider : scene.colliders) work += skinWork(collider.shape);
  if (scene.integrator == Integrator::rungeKutta4) work.dispatches += 11 * substeps;
  const auto any = [&](auto has) { return std::ranges::any_of(scene.cloths, has) ? 1.0 : 0.0; };
  work.dispatches += 3 * substeps * any([](const Cloth& cloth) { return cloth.dihedralBending != 0; });
  work.dispatches += 3 * substeps * static_cast<double>(std::ranges::count_if(scene.cloths, hasGas));
  const bool solids = std::ranges::any_of(scene.colliders, [](const Collider& collider) {
    return std::holds_alternative<Solid>(collider.shape);
  });
  work.dispatches += substeps * (solids ? 1 : 0);
  work.dispatches +=
      (6 + 4 * substeps) * any([](const Cloth& cloth) { return cloth.selfCollision.has_value(); });
  work.dispatches += kBoundDispatches * substeps * any(boundsMotion);
  work.dispatches +=
      (kClothSkinDispatches + substeps) * any([](const Cloth& cloth) { return cloth.skin != nullptr; });
  return work;
}

Work PriceModel::heldWindWork(const Scene& scene, std::size_t winds) const {
  double nodes = 0;
  for (std::size_t i = 0; i < cloths_.size(); ++i)
    if (isBlown(scene, scene.cloths[i])) nodes += static_cast<double>(cloths_[i].nodes);
  Work work;
  work.nodeSteps = kLocalWind * static_cast<double>(winds) * nodes * scene.substeps;
  return work;
}

Work PriceModel::surfacesWork(const Scene& scene, double searches) const {
  if (searches == 0) return {};
  double nodes = 0;
  for (const ClothCounts& counts : cloths_) nodes += static_cast<double>(counts.nodes);
  Work work;
  work.nodeSteps = (kSurfaceNode + searches) * nodes * scene.substeps;
  work.dispatches = scene.substeps;
  return work;
}

double PriceModel::surfaceBytes(std::size_t triangles) const {
  return triangles == 0 ? 0 : kSurfaceBuffersBytes + kSurfaceTriangleBytes * static_cast<double>(triangles);
}

// The path of a node that is near a fast body is followed in strides.
Work PriceModel::movedJointsWork(const Scene& scene) const {
  double nodes = 0, searches = 0;
  for (const ClothCounts& counts : cloths_) nodes += static_cast<double>(counts.nodes);
  for (const Collider& collider : scene.colliders) {
    const auto* solid = std::get_if<Solid>(&collider.shape);
    if (solid != nullptr && (*solid)->skin) searches += searchWork(**solid);
  }
  Work work;
  work.nodeSteps = searches * nodes * scene.substeps * (kStrides - 1);
  return work;
}

double PriceModel::bytes(const Scene& scene) const {
  assert(scene.cloths.size() == cloths_.size());
  double bytes = kSceneBytes;
  for (const Collider& collider : scene.colliders) {
    bytes += listBytes(collider.motion.keys);
    if (const auto* solid = std::get_if<Solid>(&collider.shape))
      bytes += kTriangleBytes * static_cast<double>((*solid)->triangles.size()) + skinBytes(**solid) +
               gridBytes(**solid);
  }
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    const Cloth& cloth = scene.cloths[i];
    const ClothCounts& counts = cloths_[i];
    const auto nodes = static_cast<double>(counts.nodes);
    const auto springs = static_cast<double>(counts.allSprings());
    bytes += kNodeBytes * nodes + kSpringBytes * springs;
    bytes += listsOf(cloth);
    if (cloth.mesh)
      bytes += kMeshNodeBytes * nodes + listBytes(cloth.mesh->shape.uvs) +
               listBytes(cloth.mesh->shape.uvTriangles);
    if (cloth.skin) bytes += kClothSkinBytes * nodes;
    if (cloth.selfCollision) bytes += kSelfCollisionBytes * nodes;
    if (canHoldGas(cloth)) bytes += kGasBytes * nodes;
    if (cloth.coarse) bytes += cloth.coarse->levels * (cloth.mesh ? kCoarseMeshBytes : kCoarseBytes) * nodes;
    if (boundsMotion(cloth)) bytes += kMotionBoundBytes * nodes;
    if (cloth.dihedralBending != 0) bytes += kHingeBytes * static_cast<double>(counts.hinges);
    if (isSystem(cloth.solver.kind) || cloth.solver.kind == SolverKind::xpbd) bytes += kSystemBytes * springs;
    if (isAssembled(cloth.solver)) bytes += kPairBytes * static_cast<double>(counts.pairs);
  }
  return bytes;
}

}  // namespace clothstream::model

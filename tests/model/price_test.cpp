// SPDX-License-Identifier: MIT
// Price of a scene, without a device.
#include "server/model/price.h"

#include <utility>

#include <gtest/gtest.h>

#include "server/model/cloth_skin.h"
#include "tests/model/meshes.h"
#include "tests/model/solids.h"
#include "tests/model/surfaces.h"

namespace clothstream::model {
namespace {

constexpr DeviceSpeed kSpeed{.nodeStepSeconds = 1e-8, .dispatchSeconds = 1e-5, .workgroupFactor = 2};

Scene sheetScene(std::uint32_t size, SolverKind kind = SolverKind::massSpring) {
  Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 1;
  cloth.solver.kind = kind;
  Scene scene;
  scene.name = "sheet";
  scene.cloths = {cloth};
  return scene;
}

double secondsOf(const Scene& scene) {
  return PriceModel(scene).work(scene).seconds(kSpeed);
}

TEST(Price, TimeGrowsWithNodesSubstepsIterationsAndColliders) {
  const Scene plain = sheetScene(100);
  const double before = secondsOf(plain);
  EXPECT_GT(before, 0);
  Scene scene = plain;
  scene.substeps *= 2;
  // Frames cost the same.
  EXPECT_GT(secondsOf(scene) / before, 1.3);
  EXPECT_LT(secondsOf(scene) / before, 2);
  EXPECT_NEAR(secondsOf(sheetScene(200)) / before, 4, 0.5);
  scene = plain;
  scene.colliders.resize(10);
  EXPECT_GT(secondsOf(scene), 2 * before);
  scene = plain;
  scene.cloths[0].selfCollision = SelfCollision{.radius = 0.001f};
  EXPECT_GT(secondsOf(scene), 5 * before);
  const double balls = secondsOf(scene);
  scene.cloths[0].selfCollision->nothingPasses = true;
  EXPECT_GT(secondsOf(scene), 4 * balls);
  for (const SolverKind kind :
       {SolverKind::constraint, SolverKind::acad, SolverKind::xpbd, SolverKind::implicitEuler}) {
    Scene few = sheetScene(100, kind), many = sheetScene(100, kind);
    few.cloths[0].solver.iterations = 10;
    many.cloths[0].solver.iterations = 1000;
    EXPECT_GT(secondsOf(few), before);
    EXPECT_GT(secondsOf(many), 30 * secondsOf(few)) << static_cast<int>(kind);
  }
}

TEST(Price, AClothThatFollowsJointsCostsMoreTimeAndMemory) {
  const Scene free = sheetScene(100);
  Scene bound = free;
  bound.cloths[0].skin = std::make_shared<const ClothSkin>();
  EXPECT_GT(secondsOf(bound), 1.5 * secondsOf(free));
  EXPECT_LT(secondsOf(bound), 4 * secondsOf(free));
  EXPECT_EQ(PriceModel(bound).bytes(bound) - PriceModel(free).bytes(free), 128.0 * 100 * 100);
}

// A floor in two surfaces, as clothstream-bench garment measures it: what all nodes of a sheet on it add, in
// node-steps, and what nodes next to it add.
TEST(Price, SurfacesAreWithinAFactorOfOneAndAHalfOfAMeasurement) {
  const Scene scene = sheetScene(64);
  const PriceModel prices(scene);
  constexpr double kBeside = 7;
  for (const auto& [cells, onIt] : {std::pair(15u, 27.0), {50u, 36.0}, {111u, 47.0}, {158u, 55.0}}) {
    const Surface half = surfaceOf(flat(2, 4, cells));
    const double priced = prices.surfacesWork(scene, 2 * kSurfaceTestWork + surfaceWork(half)).nodeSteps /
                          (4096.0 * scene.substeps);
    const double measured = kBeside + (onIt - kBeside) / 3;
    EXPECT_LT(priced, 1.5 * measured) << cells;
    EXPECT_GT(priced, measured / 1.5) << cells;
  }
  EXPECT_EQ(prices.surfacesWork(scene, 0).nodeSteps, 0);
}

// A GPU sweeps cloths of 33 to 64 nodes a side with all of its workgroups (XpbdStage, SolveStage).
TEST(Price, GpusDivideClothsThatOneThreadOfASoftwareDeviceSolves) {
  DeviceSpeed gpu = kSpeed;
  gpu.gpu = true;
  gpu.workgroupFactor = 100;
  const auto on = [](const DeviceSpeed& speed, const Scene& scene) {
    return PriceModel(scene).work(scene).seconds(speed);
  };
  DeviceSpeed software = gpu;
  software.gpu = false;
  for (const SolverKind kind : {SolverKind::constraint, SolverKind::acad, SolverKind::implicitEuler}) {
    EXPECT_LT(on(gpu, sheetScene(64, kind)), 0.2 * on(software, sheetScene(64, kind)))
        << static_cast<int>(kind);
    EXPECT_EQ(on(gpu, sheetScene(32, kind)), on(software, sheetScene(32, kind))) << static_cast<int>(kind);
    EXPECT_EQ(on(gpu, sheetScene(65, kind)), on(software, sheetScene(65, kind))) << static_cast<int>(kind);
  }
  EXPECT_LT(on(gpu, sheetScene(32, SolverKind::xpbd)), 0.2 * on(software, sheetScene(32, SolverKind::xpbd)));
}

// Few nodes take as long as many, because each tests all colliders.
TEST(Price, CollidersCostTheTimeOfAnInvocation) {
  DeviceSpeed gpu = kSpeed;
  gpu.serialStepSeconds = 1e-6;
  Scene scene = sheetScene(2);
  scene.colliders.resize(64);
  const Work work = PriceModel(scene).work(scene);
  EXPECT_DOUBLE_EQ(work.seconds(gpu) - work.seconds(kSpeed),
                   scene.substeps * 64 * colliderWork(scene.colliders.front().shape) * 1e-6);
}

// Collision with a polyhedron tests its planes, one after the other.
TEST(Price, CollidersCostMoreWithMorePlanes) {
  const auto priceWith = [](const Shape& shape) {
    Scene scene = sheetScene(100);
    scene.colliders.resize(8);
    for (Collider& collider : scene.colliders) collider.shape = shape;
    return secondsOf(scene);
  };
  const auto hull = [](std::size_t planes) {
    ConvexHull made;
    made.planes.resize(planes);
    return std::make_shared<const ConvexHull>(made);
  };
  EXPECT_EQ(priceWith(Sphere{}), priceWith(Capsule{}));
  EXPECT_GT(priceWith(Box{}), priceWith(Sphere{}));
  EXPECT_GT(priceWith(hull(32)), priceWith(Box{}));
  EXPECT_GT(priceWith(hull(128)), 2 * priceWith(hull(32)));
  // Participants may have boxes, but no hulls.
  const Scene plain = sheetScene(100);
  Scene boxes = plain;
  boxes.colliders.resize(8);
  for (Collider& collider : boxes.colliders) collider.shape = Box{};
  EXPECT_DOUBLE_EQ(PriceModel(plain).work(plain, 8).nodeSteps, PriceModel(boxes).work(boxes).nodeSteps);
}

TEST(Price, MeshesWithJointsCostMoreWithMoreTriangles) {
  const auto scene = [](std::uint32_t rings, bool skinned) {
    ClosedMesh mesh = *ballMesh(0.3f, rings);
    if (skinned) {
      mesh.skin.emplace();
      mesh.skin->joints = {{"root", std::nullopt, {}}};
      mesh.skin->vertices.resize(mesh.vertices.size(), {{}, {1, 0, 0, 0}});
      mesh.skin->keys = {{0, {Pose{}}}, {1, {Pose{}}}};
    }
    Scene made = sheetScene(32);
    made.colliders.resize(1);
    made.colliders[0].shape = std::make_shared<const ClosedMesh>(std::move(mesh));
    return made;
  };
  const Scene rigid = scene(70, false), few = scene(10, true), many = scene(70, true);
  EXPECT_EQ(secondsOf(scene(10, false)), secondsOf(rigid));
  EXPECT_GT(secondsOf(few), secondsOf(scene(10, false)));
  EXPECT_GT(secondsOf(many), 3 * secondsOf(few));
  EXPECT_GT(PriceModel(many).bytes(many), PriceModel(rigid).bytes(rigid) + 200.0 * 9000);
}

TEST(Price, MemoryGrowsWithListsKeysAndTextureCoordinates) {
  constexpr std::size_t kEntries = 10'000;
  const Scene plain = sheetScene(100);
  const double before = PriceModel(plain).bytes(plain);
  const auto added = [&](const Scene& scene) { return PriceModel(scene).bytes(scene) - before; };
  Scene scene = plain;
  scene.cloths[0].pinnedVertices.resize(kEntries);
  EXPECT_GE(added(scene), 4.0 * kEntries * sizeof(std::uint32_t));
  scene = plain;
  scene.cloths[0].attachments.resize(1);
  scene.cloths[0].attachments[0].vertices.resize(kEntries);
  scene.cloths[0].attachments[0].motion.keys.resize(kEntries);
  EXPECT_GE(added(scene), 4.0 * kEntries * (sizeof(std::uint32_t) + sizeof(MotionKey)));
  scene = plain;
  scene.colliders.resize(1);
  scene.colliders[0].motion.keys.resize(kEntries);
  EXPECT_GE(added(scene), 4.0 * kEntries * sizeof(MotionKey));
  Scene mesh = plain, textured = plain;
  Mesh shape;
  shape.shape.positions.resize(kEntries);
  mesh.cloths[0].mesh = std::make_shared<const Mesh>(shape);
  shape.shape.uvs.resize(kEntries);
  shape.shape.uvTriangles.resize(kEntries);
  textured.cloths[0].mesh = std::make_shared<const Mesh>(shape);
  EXPECT_GE(added(textured) - added(mesh), 2.0 * kEntries * (sizeof(Uv) + sizeof(Triangle)));
}

// The scene that stopped every other scene for good before scenes had a price.
TEST(Price, HostileSceneCostsManyTimesTheDevice) {
  Scene scene = sheetScene(512, SolverKind::constraint);
  scene.cloths[0].solver.iterations = 10'000;
  scene.cloths[0].solver.tolerance = 0;
  scene.substeps = 64;
  EXPECT_GT(secondsOf(scene) * scene.simulationRate, 10'000);
}

TEST(Price, MeshOfQuadsCostsAboutAsMuchAsTheGrid) {
  const Scene grid = sheetScene(40, SolverKind::constraint);
  Scene mesh = grid;
  mesh.cloths[0] = asMesh(grid.cloths[0]);
  ASSERT_EQ(mesh.nodeCount(), grid.nodeCount());
  EXPECT_NEAR(secondsOf(mesh) / secondsOf(grid), 2, 0.5);  // kMeshFactor
  EXPECT_GT(PriceModel(mesh).bytes(mesh), PriceModel(grid).bytes(grid));
}

TEST(Price, MemoryOfAssembledSystemGrowsWithPairsOfSprings) {
  Scene scene = sheetScene(64, SolverKind::constraint);
  const double free = PriceModel(scene).bytes(scene);
  scene.cloths[0].solver.path = ConstraintPath::assembled;
  EXPECT_GT(PriceModel(scene).bytes(scene), free + 4096 * 64 * 20.0);
}

}  // namespace
}  // namespace clothstream::model

// SPDX-License-Identifier: MIT
// Cloth that collides with itself and with other cloth.
#include "server/reference/self_collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/simulation/self_collision/self_collision_stage.h"
#include "tests/simulation/intersections.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;
using simulation::TickInputs;
using simulation::TickStatus;

constexpr float kSpacing = 0.02f;   // m, of calm cloths
constexpr float kDistance = 0.02f;  // m, of two balls of 1 cm that touch

class SelfCollision : public GpuTest {};

model::Cloth withBalls(model::Cloth cloth, float radius = kDistance / 2, float friction = 0.3f) {
  cloth.selfCollision = model::SelfCollision{.radius = radius, .friction = friction};
  return cloth;
}

// A cloth in the XZ plane, rotated about Y.
model::Cloth flat(model::Cloth cloth, float y, float degrees = 0) {
  const model::Quaternion turn = turned(degrees, model::Vec3::UnitY()) * turned(-90, model::Vec3::UnitX());
  const model::Vec3 middle = turn * model::Vec3(0, -cloth.grid.height / 2, 0);
  cloth.grid.pose = {model::Vec3(0, y, 0) - middle, turn};
  return cloth;
}

model::Scene withoutGravity(model::Scene scene) {
  scene.environment.gravity = model::Vec3::Zero();
  return scene;
}

simulation::MovingCollider floorAt(float y) {
  const model::Pose pose{model::Vec3(0, y, 0), model::Quaternion::Identity()};
  return {model::Plane{}, pose, pose, 1};
}

std::vector<reference::Vec3> inDouble(std::span<const model::Vec3> vectors) {
  std::vector<reference::Vec3> result;
  for (const model::Vec3& v : vectors) result.push_back(v.cast<double>());
  return result;
}

// Smallest distance of a colliding pair, relative to the distance at which it touches; at most 1.
double nearest(const model::Scene& scene, const NodeState& state) {
  const std::vector<reference::Vec3> positions = inDouble(state.positions);
  double least = 1;
  for (const auto& pair : reference::SelfCollision(scene).pairs(positions))
    least = std::min(least, (positions[pair.a] - positions[pair.b]).norm() / pair.distance);
  return least;
}

double speedOf(const NodeState& state) {
  double sum = 0;
  for (const model::Vec3& v : state.velocities) sum += v.squaredNorm();
  return std::sqrt(sum / static_cast<double>(state.velocities.size()));
}

// Folds the cloth to and fro into panels of `panel` rows that lie above each other, the first at height y.
NodeState folded(const model::Scene& scene, std::uint32_t panel, float gap, float y) {
  NodeState state = simulation::restState(scene.cloths);
  const model::Grid& grid = scene.cloths[0].grid;
  for (std::uint32_t row = 0; row < grid.rows; ++row)
    for (std::uint32_t column = 0; column < grid.columns; ++column) {
      const std::uint32_t fold = row / panel, along = row % panel;
      model::Vec3& p = state.positions[row * grid.columns + column];
      p.y() = y + gap * static_cast<float>(fold);
      p.z() = kSpacing * static_cast<float>(fold % 2 == 0 ? along : panel - 1 - along);
    }
  return state;
}

// ---- Lists of neighbours

// Runs only the self-collision stage, on a given state.
class Lists {
 public:
  Lists(const model::Scene& scene, const NodeState& state, std::uint32_t workgroupSize = 64)
      : nodes_(scene.nodeCount()),
        cloths_(upload(simulation::clothRecords(scene.cloths, scene.substepSeconds()))),
        positions_(upload(texels(state.positions))),
        velocities_(upload(texels(state.velocities))),
        stage_(device(), scene,
               {.cloths = cloths_,
                .colliders = none_,
                .nearColliders = none_,
                .contactImpulses = none_,
                .stretches = none_,
                .positions = {&positions_, &positions_},
                .velocities = {&velocities_, &velocities_}},
               workgroupSize),
        readback_(device(), vulkan::BufferPurpose::readback, stage_.neighbours().bytes()) {
    const simulation::TickInputs inputs{scene.environment, {}};
    const simulation::Tick tick{
        .inputs = inputs, .cloths = {}, .substeps = scene.substeps, .substepSeconds = scene.substepSeconds()};
    recorder_.begin();
    stage_.uploadTables(recorder_);
    stage_.recordInputs(recorder_, tick);
    recorder_.barrier();
    stage_.recordSubstep(recorder_, {.tick = tick});
    recorder_.barrier();
    stage_.recordReport(recorder_, tick);
    recorder_.copy(stage_.neighbours(), readback_, readback_.bytes());
    submitAndWait(device(), recorder_);
  }

  std::vector<float> of(std::uint32_t node) const {
    const auto floats = readback_.mapped<const float>().subspan(std::size_t{node} * shared::kNeighbourStride);
    return {floats.begin() + 4, floats.begin() + 4 + static_cast<std::ptrdiff_t>(floats[0])};
  }
  shared::CrowdReport report() const { return stage_.report(0); }

 private:
  static std::vector<shared::vec4> texels(const std::vector<model::Vec3>& vectors) {
    std::vector<shared::vec4> result;
    for (const model::Vec3& v : vectors) result.push_back({v.x(), v.y(), v.z(), 1});
    return result;
  }
  template <typename Record>
  vulkan::Buffer upload(const std::vector<Record>& records) {
    const std::size_t bytes = records.size() * sizeof(Record);
    const vulkan::Buffer from(device(), vulkan::BufferPurpose::upload, bytes);
    std::ranges::copy(records, from.mapped<Record>().begin());
    vulkan::Buffer to(device(), vulkan::BufferPurpose::texels, bytes);
    recorder_.begin();
    recorder_.copy(from, to, bytes);
    submitAndWait(device(), recorder_);
    return to;
  }

  std::uint32_t nodes_;
  vulkan::Recorder recorder_{device()};
  vulkan::Buffer none_{device(), vulkan::BufferPurpose::texels, 4096};
  vulkan::Buffer cloths_, positions_, velocities_;
  simulation::SelfCollisionStage stage_;
  vulkan::Buffer readback_;
};

// Expected lists by brute force over all pairs: nodes plus one, negative for a node of another cloth.
std::vector<std::set<float>> expectedLists(const model::Scene& scene, const NodeState& state) {
  const double ahead = 1.25 * 3 * scene.substepSeconds();  // three substeps follow the one that makes them
  const std::vector<reference::Vec3> positions = inDouble(state.positions);
  const std::vector<std::uint32_t> offsets = simulation::clothOffsets(scene.cloths);
  const auto clothOf = [&](std::uint32_t node) {
    return std::upper_bound(offsets.begin(), offsets.end(), node) - offsets.begin();
  };
  std::vector<std::set<float>> lists(positions.size());
  // No pair is listed from farther than three times the largest reach.
  for (const auto& pair : reference::SelfCollision(scene).pairs(positions, 3)) {
    const double relative = (state.velocities[pair.a] - state.velocities[pair.b]).cast<double>().norm();
    const double limit = 1.25 * pair.distance + ahead * relative;
    const double distance = (positions[pair.a] - positions[pair.b]).norm();
    // Nearer to the limit than rounding may decide: the tests' seeds have none. Differences of near positions
    // round to 2^-25 of 0.1 m, our square root by 7e-7 of what velocities add, 2 cm here.
    EXPECT_GT(std::abs(distance - limit), 2e-8);
    if (distance > limit) continue;
    const float sign = clothOf(pair.a) == clothOf(pair.b) ? 1.0f : -1.0f;
    lists[pair.a].insert(sign * static_cast<float>(pair.b + 1));
    lists[pair.b].insert(sign * static_cast<float>(pair.a + 1));
  }
  return lists;
}

model::Scene twoCrumpled() {
  return sceneOf({withBalls(calmCloth(20, 31)), calmCloth(3, 3), withBalls(discCloth(9), 0.008f)});
}

// Every node anywhere in a box of this size.
NodeState scattered(const model::Scene& scene, std::uint32_t seed, const model::Vec3& box, float speed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return model::Vec3(unit(random), unit(random), unit(random)); };
  NodeState state = simulation::restState(scene.cloths);
  for (model::Vec3& position : state.positions) position = box.cwiseProduct(vector()) / 2;
  for (model::Vec3& velocity : state.velocities) velocity = speed * vector();
  return state;
}

TEST_F(SelfCollision, ListsMatchBruteForceInAFixedOrder) {
  const model::Scene scene = twoCrumpled();
  // Dense; spread so far that cells share entries of the table; and fast.
  const std::pair<model::Vec3, float> cases[] = {{model::Vec3(0.3f, 0.2f, 0.3f), 0.1f},
                                                 {model::Vec3(60, 0.05f, 0.1f), 0.1f},
                                                 {model::Vec3(0.5f, 0.5f, 0.5f), 2}};
  for (const auto& [box, speed] : cases) {
    const NodeState state = scattered(scene, 11, box, speed);
    const std::vector<std::set<float>> expected = expectedLists(scene, state);
    const Lists lists(scene, state), narrow(scene, state, 8), wide(scene, state, 128);
    EXPECT_EQ(lists.report().lists, 0u);
    std::size_t listed = 0;
    for (std::uint32_t node = 0; node < expected.size(); ++node) {
      if (node >= 620 && node < 629) continue;  // of the cloth without balls
      const std::vector<float> list = lists.of(node);
      EXPECT_THAT(list, testing::UnorderedElementsAreArray(expected[node])) << "node " << node;
      EXPECT_EQ(narrow.of(node), list);
      EXPECT_EQ(wide.of(node), list);
      listed += list.size();
    }
    EXPECT_GT(listed, 50u);
  }
}

TEST_F(SelfCollision, FullListsAreCountedAndKeepAFixedOrder) {
  const model::Scene scene = sceneOf({withBalls(calmCloth(30, 31))});
  const NodeState state = scattered(scene, 12, model::Vec3(0.1f, 0.1f, 0.1f), 0);
  std::uint32_t full = 0;
  for (const std::set<float>& list : expectedLists(scene, state))
    full += list.size() > shared::kMaxNeighbours ? 1 : 0;
  EXPECT_GT(full, 10u);
  EXPECT_LT(full, scene.nodeCount());
  const Lists lists(scene, state), narrow(scene, state, 8);
  EXPECT_EQ(lists.report().lists, full);
  EXPECT_GT(lists.report().balls, 10u);
  EXPECT_EQ(lists.report().balls, narrow.report().balls);
  for (std::uint32_t node = 0; node < scene.nodeCount(); ++node) EXPECT_EQ(lists.of(node), narrow.of(node));
}

TEST_F(SelfCollision, SkippedCrowdsAreReportedAndHarmless) {
  const model::Scene scene = sceneOf({withBalls(calmCloth(40, 40))});
  NodeState state = scattered(scene, 13, model::Vec3(1e-3f, 1e-3f, 1e-3f), 0);
  Running running(scene);
  running.restore(state);
  const TickStatus status = running.tick(inputsOf(scene));
  EXPECT_GE(status.crowded, scene.nodeCount());
  EXPECT_TRUE(status.healthy);
  // Positions and velocities that are not finite are reported, too.
  state.positions[5].x() = std::numeric_limits<float>::quiet_NaN();
  state.positions[70].y() = std::numeric_limits<float>::infinity();
  state.velocities[90].z() = -std::numeric_limits<float>::infinity();
  running.restore(state);
  EXPECT_FALSE(running.tick(inputsOf(scene)).healthy);
}

// ---- Effects of contacts

// From a random state on the device and in the reference; farther apart than the tolerance without contacts.
void expectLikeReference(const model::Scene& scene, double tolerance) {
  std::mt19937 random(5);
  const NodeState start = randomState(scene, random, 0.004f, 0.5f);
  const TickInputs inputs = inputsOf(scene, {floorAt(-0.008f)});
  Running running(scene);
  running.restore(start);
  running.tick(inputs);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputs));
  EXPECT_LT(largestDistance(running.state(), reference), tolerance);
  EXPECT_LT(largestSpeedDifference(running.state(), reference), 720 * tolerance);

  model::Scene through = scene;
  for (model::Cloth& cloth : through.cloths) cloth.selfCollision.reset();
  Running without(through);
  without.restore(start);
  without.tick(inputs);
  EXPECT_GT(largestDistance(without.state(), reference), 10 * tolerance);
}

// Three cloths in one heap, of several radii and frictions.
model::Scene heap(model::SolverKind kind) {
  model::Cloth lower = withBalls(flat(calmCloth(14, 17), 0), 0.01f, 0.5f);
  model::Cloth upper = withBalls(flat(calmCloth(13, 12), 0.012f, 20), 0.007f, 0.1f);
  model::Cloth disc = withBalls(discCloth(6), 0.009f);
  lower.solver.kind = disc.solver.kind = kind;
  lower.pins = {topRow(lower)};
  return sceneOf({lower, upper, disc});
}

// Twenty iterations, each of which adds the rounding of a position (2^-25 of 0.3 m) to an overlap, half of
// which comes out as speed, 360 1/s times as large; what speeds differ by, friction and springs carry on.
TEST_F(SelfCollision, MovesNodesAsTheReferenceWithForces) {
  expectLikeReference(heap(model::SolverKind::massSpring), 5e-6);
}

// The solve converges to float precision, because a tick of contacts amplifies its remaining error a
// hundredfold.
TEST_F(SelfCollision, MovesNodesAsTheReferenceWithAdaptiveConstraints) {
  model::Scene scene = heap(model::SolverKind::acad);
  for (model::Cloth& cloth : scene.cloths) {
    cloth.solver.iterations = 2000;
    cloth.solver.tolerance = 1e-6f;
  }
  expectLikeReference(scene, 5e-6);
}

// Only one substep, because the remaining error of a solve grows fast from this state. It is 1e-5 of the
// errors of some thousand springs of 0.014 m each: 5e-6 m, and more at a single node.
TEST_F(SelfCollision, MovesNodesAsTheReferenceWithConstraints) {
  model::Scene scene = heap(model::SolverKind::constraint);
  scene.simulationRate = 720;
  scene.substeps = 1;
  for (model::Cloth& cloth : scene.cloths) {
    cloth.solver.iterations = 2000;
    cloth.solver.tolerance = 1e-5f;
  }
  expectLikeReference(scene, 2e-5);
}

TEST_F(SelfCollision, ASheetAtRestIsNoNeighbourOfItself) {
  // The largest balls that are allowed. Their neighbours are up to two nodes away.
  model::Scene scene = withoutGravity(sceneOf({calmCloth(9, 9)}));
  Running without(scene);
  scene.cloths[0] = withBalls(scene.cloths[0], kSpacing);
  Running with(scene);
  std::mt19937 random(6);
  const NodeState start = randomState(scene, random, 0.0005f, 0.02f);
  without.restore(start);
  with.restore(start);
  for (int tick = 0; tick < 20; ++tick)
    EXPECT_EQ(with.tick(inputsOf(scene)).stateHash, without.tick(inputsOf(scene)).stateHash);
}

TEST_F(SelfCollision, DoesNotChangeClothWithoutSelfCollision) {
  const model::Cloth other = flat(calmCloth(12, 12), 0.005f, 30);
  const model::Scene alone = sceneOf({other});
  const model::Scene both = sceneOf({withBalls(flat(calmCloth(12, 12), 0)), other});
  Running one(alone), two(both);
  for (int tick = 0; tick < 20; ++tick) {
    one.tick(inputsOf(alone, {floorAt(-0.1f)}));
    two.tick(inputsOf(both, {floorAt(-0.1f)}));
  }
  const NodeState expected = one.state(), state = two.state();
  EXPECT_TRUE(std::equal(expected.positions.begin(), expected.positions.end(), state.positions.end() - 144));
}

TEST_F(SelfCollision, KeepsMomentum) {
  // A small sheet flies into a larger, heavier one, with friction between them.
  model::Cloth large = withBalls(flat(calmCloth(20, 20), 0)),
               small = withBalls(flat(calmCloth(9, 9), 0.05f, 35));
  large.damping = small.damping = 0;
  large.mass *= 3;
  const model::Scene scene = withoutGravity(sceneOf({large, small}));
  NodeState state = simulation::restState(scene.cloths);
  for (std::size_t i = 400; i < state.velocities.size(); ++i)
    state.velocities[i] = model::Vec3(0.5f, -2, 0.2f);
  const std::vector<float> inverse = simulation::inverseMasses(scene.cloths);
  const auto momentum = [&](const NodeState& s, std::size_t first, std::size_t end) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = first; i < end; ++i) sum += s.velocities[i].cast<double>() / double{inverse[i]};
    return sum;
  };
  const Eigen::Vector3d before = momentum(state, 0, 481);
  Running running(scene);
  running.restore(state);
  for (int tick = 0; tick < 20; ++tick) running.tick(inputsOf(scene));
  const NodeState after = running.state();
  // Each of 200 substeps rounds each velocity a few times, to 2^-25 of about 1 m/s, in random directions. If
  // all had the same direction, the sum would be 200 * 5 * 3e-8 = 3e-5 of it.
  EXPECT_LT((momentum(after, 0, 481) - before).norm(), 3e-5 * before.norm());
  EXPECT_GT(momentum(after, 0, 400).norm(), 0.3 * before.norm());  // they met
  EXPECT_EQ(intersections(scene, after.positions), 0u);
}

TEST_F(SelfCollision, AFallingSheetComesToRestOnASheet) {
  model::Cloth lower = withBalls(flat(calmCloth(30, 30), 0.03f));
  model::Cloth upper = withBalls(flat(calmCloth(20, 20), 0.3f, 20));
  const model::Scene scene = sceneOf({lower, upper});
  Running running(scene);
  for (int tick = 0; tick < 216; ++tick) {
    const TickStatus status = running.tick(inputsOf(scene, {floorAt(0)}));
    ASSERT_EQ(status.crowded, 0u);
  }
  const NodeState state = running.state();
  // They overlap by what carries the weight: in a substep gravity gives g h, 0.014 m/s, which half of an
  // overlap over h, in two iterations, takes again: below 1e-4 m.
  const double distance = kDistance - 1e-4;
  EXPECT_GT(nearest(scene, state), distance / kDistance);
  // A ball lies no deeper than in the hollow of four whose diagonal is the longest: sqrt(d^2 - L^2 / 4)
  // above.
  double longest = 0;
  for (std::size_t node = 0; node + 31 < 900; ++node) {
    if (node % 30 == 29) continue;
    const auto& at = state.positions;
    longest = std::max(
        {longest, double{(at[node] - at[node + 31]).norm()}, double{(at[node + 1] - at[node + 30]).norm()}});
  }
  EXPECT_LT(longest, 1.1 * std::sqrt(2) * kSpacing);
  const double hollow = std::sqrt(distance * distance - longest * longest / 4);
  for (std::size_t i = 0; i < 900; ++i) EXPECT_NEAR(state.positions[i].y(), 0.005, 1e-4);
  for (std::size_t i = 900; i < state.positions.size(); ++i)
    EXPECT_GT(state.positions[i].y(), 0.005 + hollow - 1e-4);
  EXPECT_EQ(intersections(scene, state.positions), 0u);
  EXPECT_LT(speedOf(state), 0.005);
}

TEST_F(SelfCollision, FoldsOnTheFloorStayAStack) {
  model::Cloth cloth = calmCloth(60, 20);
  cloth.bend = {2, 0.01f};
  for (const bool balls : {true, false}) {
    const model::Scene scene = sceneOf({balls ? withBalls(cloth) : cloth});
    Running running(scene);
    running.restore(folded(scene, 12, kDistance, 0.2f));
    for (int tick = 0; tick < 216; ++tick) {
      const TickStatus status = running.tick(inputsOf(scene, {floorAt(0)}));
      ASSERT_EQ(status.crowded, 0u);
    }
    const NodeState state = running.state();
    // In the middle of the panels, each column: how far one lies above the one below it.
    double least = 1;
    for (std::uint32_t panel = 0; panel + 1 < 5; ++panel)
      for (std::uint32_t column = 0; column < 20; ++column) {
        const std::size_t below = (12 * panel + 6) * 20 + column, above = below + 12 * std::size_t{20};
        least = std::min(least, double{state.positions[above].y() - state.positions[below].y()});
      }
    if (balls) {
      // In a hollow at least half of the distance remains, because panels slope.
      EXPECT_GT(least, 0.5 * std::sqrt(0.5) * kDistance);
      EXPECT_EQ(intersections(scene, state.positions), 0u);
      EXPECT_GT(nearest(scene, state), 0.85);
      EXPECT_LT(speedOf(state), 0.01);
    } else {
      EXPECT_LT(least, 0.001);
    }
  }
}

// Boxes push the curtain together from both sides.
TEST_F(SelfCollision, APushedCurtainFoldsWithoutPassingThroughItself) {
  model::Cloth cloth = calmCloth(24, 60);
  cloth.structural = {100, 0.05f};
  cloth.shear = {20, 0.02f};
  cloth.bend = {1, 0.01f};
  cloth.pins = {
      {.firstRow = 0, .lastRow = 0, .rowStep = 1, .firstColumn = 29, .lastColumn = 30, .columnStep = 1}};
  cloth.grid.pose.orientation = turned(4, model::Vec3::UnitY());
  for (const bool balls : {true, false}) {
    model::Scene scene = sceneOf({balls ? withBalls(cloth) : cloth});
    scene.environment.gravity = model::Vec3(0, -2, 0);
    Running running(scene);
    const auto boxes = [&](int tick) {
      const auto at = [](int t) { return 0.75f - std::min(0.003f * static_cast<float>(t), 0.55f); };
      std::vector<simulation::MovingCollider> both;
      for (const float side : {-1.0f, 1.0f})
        both.push_back({model::Box{model::Vec3(0.2f, 2, 2)},
                        {model::Vec3(side * at(tick), 0, 0), model::Quaternion::Identity()},
                        {model::Vec3(side * at(tick + 1), 0, 0), model::Quaternion::Identity()},
                        0.2f});
      return both;
    };
    for (int tick = 0; tick < 216; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene, boxes(tick))).healthy);
    const NodeState state = running.state();
    if (balls) {
      EXPECT_EQ(intersections(scene, state.positions), 0u);
      EXPECT_GT(nearest(scene, state), 0.9);
    } else {
      EXPECT_GT(intersections(scene, state.positions), 100u);
    }
  }
}

// A small sheet lies on a sheet that is pinned everywhere. Tilted gravity acts like a slope of that angle.
double slideOn(double slope, float friction, int ticks) {
  model::Cloth lower = withBalls(flat(calmCloth(40, 80), 0), kSpacing, friction);
  lower.pins = {
      {.firstRow = 0, .lastRow = 39, .rowStep = 1, .firstColumn = 0, .lastColumn = 79, .columnStep = 1}};
  model::Cloth upper = withBalls(flat(calmCloth(12, 12), 2 * kSpacing, 27), kSpacing, friction);
  upper.grid.pose.position.x() -= 0.6f;
  upper.damping = 0;
  model::Scene scene = sceneOf({lower, upper});
  scene.environment.gravity =
      9.81f * model::Vec3(static_cast<float>(std::sin(slope)), static_cast<float>(-std::cos(slope)), 0);
  Running running(scene);
  const auto middle = [&] {
    const NodeState state = running.state();
    double sum = 0;
    for (std::size_t i = 3200; i < state.positions.size(); ++i) sum += state.positions[i].x();
    return sum / 144;
  };
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsOf(scene));  // the sheet settles
  const double start = middle();
  for (int tick = 0; tick < ticks; ++tick) running.tick(inputsOf(scene));
  return middle() - start;
}

// Coulomb friction: the sheet sticks if friction is at least the slope's tangent. Otherwise it accelerates by
// at most g (sin a - mu cos a), because the hollows between balls can only slow it down.
TEST_F(SelfCollision, FrictionHoldsASheetOnASheetUpToItsAngle) {
  const double slope = std::atan(0.45);
  // The sheet creeps while it rocks in the hollows. No ball leaves its hollow in half a second.
  EXPECT_LT(std::abs(slideOn(slope, 0.5f, 36)), kSpacing / 4);
  // From the end of its first half second to that of the second.
  const double most = 0.5 * 9.81 * (std::sin(slope) - 0.2 * std::cos(slope)) * (1 - 0.25);
  const double slid = slideOn(slope, 0.2f, 36);
  EXPECT_LT(slid, most);
  EXPECT_GT(slid, most / 4);
}

// ---- The same bits

TEST_F(SelfCollision, GivesTheSameHashesInLongRuns) {
  model::Cloth sheet = withBalls(calmCloth(30, 20));
  sheet.bend = {1, 0.01f};
  sheet.grid.pose = {model::Vec3(0, 0.7f, 0), turned(4, model::Vec3::UnitX())};
  model::Cloth rag = withBalls(discCloth(6), 0.008f);
  const model::Scene scene = sceneOf({sheet, rag});
  const TickInputs inputs = inputsOf(scene, {floorAt(-0.05f)});
  Running narrow(scene, {.rowsPerInvocation = 1, .workgroupSize = 32, .advanceKernel = {}});
  Running wide(scene, {.rowsPerInvocation = 7, .workgroupSize = 128, .advanceKernel = {}});
  Running usual(scene), again(scene);
  for (int tick = 0; tick < longRunTicks(); ++tick) {
    const TickStatus status = usual.tick(inputs);
    ASSERT_TRUE(status.healthy) << "tick " << tick;
    ASSERT_EQ(again.tick(inputs).stateHash, status.stateHash) << "tick " << tick;
    if (tick >= 100) continue;
    ASSERT_EQ(narrow.tick(inputs).stateHash, status.stateHash) << "tick " << tick;
    ASSERT_EQ(wide.tick(inputs).stateHash, status.stateHash) << "tick " << tick;
  }
  // The same from a saved state.
  Running other(scene);
  other.restore(usual.save());
  EXPECT_EQ(other.tick(inputs).stateHash, usual.tick(inputs).stateHash);
  EXPECT_LT(nearest(scene, usual.state()), 1);
}

}  // namespace
}  // namespace clothstream::tests

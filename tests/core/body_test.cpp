// SPDX-License-Identifier: MIT
// Bodies that follow a head and hands.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/body/body_solver.h"
#include "clients/core/body/humanoid.h"
#include "clients/core/body/limb.h"
#include "clients/core/core.h"
#include "tests/core/body_figure.h"

namespace clothstream::client::body {

static void PrintTo(const Point& point, std::ostream* out) {
  *out << "(" << point.x << ", " << point.y << ", " << point.z << ")";
}

namespace {

using ::testing::DoubleNear;
using ::testing::IsEmpty;

constexpr double kFrame = 1.0 / 90;     // s, of a headset
constexpr double kEyes = 0.936 * 1.75;  // m, of the figure above the floor
constexpr double kDegree = 3.14159265358979323846 / 180;

Humanoid humanoid(const Hull& mesh = client::tests::figure()) {
  std::optional<Humanoid> found = findHumanoid(mesh);
  EXPECT_TRUE(found.has_value());
  return found ? std::move(*found) : Humanoid{};
}

double angle(const Point& a, const Point& b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

// Head that looks along a heading, radians about +Y, and down by a pitch.
Frame headAt(const Point& eyes, double heading = 0, double pitch = 0) {
  return {about({0, 1, 0}, heading) * about({1, 0, 0}, -pitch), eyes};
}

Point partOf(const BodySolver& solver, cs_body_part part) {
  const std::optional<Frame> frame = solver.partAt(part);
  EXPECT_TRUE(frame.has_value());
  return frame ? frame->position : Point{};
}

void expectNear(const Point& a, const Point& b, double tolerance, const std::string& what) {
  EXPECT_LT(length(a - b), tolerance)
      << what << ": " << ::testing::PrintToString(a) << " and " << ::testing::PrintToString(b);
}

// Five seconds of a person who stands still, so that nothing moves any more.
void settle(BodySolver& solver, const Tracked& tracked) {
  for (int i = 0; i < 450; ++i) solver.update(tracked, kFrame);
}

// Bones keep their lengths; joints that are no bones of a person keep their place in their parent.
void expectSameLengths(const BodySolver& solver) {
  const Humanoid& body = solver.humanoid();
  for (std::size_t joint = 0; joint < body.rest.size(); ++joint) {
    if (!body.parents[joint]) continue;
    const std::size_t up = *body.parents[joint];
    EXPECT_NEAR(length(solver.joints()[joint].position - solver.joints()[up].position),
                length(body.rest[joint].position - body.rest[up].position), 1e-6)
        << "joint " << joint;
  }
}

TEST(BoneNames, AreKnownInTheConventionsOfSeveralPrograms) {
  const auto is = [](const char* name, BoneKind kind, std::optional<Side> side) {
    const std::optional<BoneName> bone = boneOf(name);
    ASSERT_TRUE(bone.has_value()) << name;
    EXPECT_EQ(bone->kind, kind) << name;
    EXPECT_EQ(bone->side, side) << name;
  };
  for (const char* name : {"hips", "mixamorig:Hips", "J_Bip_C_Hips", "pelvis", "DEF-hips"})
    is(name, BoneKind::hips, std::nullopt);
  for (const char* name : {"head", "mixamorig:Head", "mixamorigHead", "J_Bip_C_Head", "Head"})
    is(name, BoneKind::head, std::nullopt);
  for (const char* name : {"left-arm", "mixamorig:LeftArm", "leftUpperArm", "J_Bip_L_UpperArm", "upper_arm.L",
                           "upperarm_l", "leftarm"})
    is(name, BoneKind::upperArm, Side::left);
  for (const char* name : {"right-forearm", "mixamorig:RightForeArm", "rightLowerArm", "J_Bip_R_LowerArm",
                           "forearm.R", "lowerarm_r"})
    is(name, BoneKind::forearm, Side::right);
  for (const char* name : {"left-thigh", "mixamorig:LeftUpLeg", "leftUpperLeg", "thigh_l", "thigh.L"})
    is(name, BoneKind::thigh, Side::left);
  for (const char* name : {"right-shin", "mixamorig:RightLeg", "rightLowerLeg", "calf_r", "shin.R"})
    is(name, BoneKind::shin, Side::right);
  is("mixamorig12:LeftFoot", BoneKind::foot, Side::left);
  is("J_Bip_R_Hand", BoneKind::hand, Side::right);
  for (const char* name :
       {"", ":", "HeadTop_End", "LeftHandIndex1", "LeftToeBase", "arm", "left-hips", "LeftShoulder", "tail"})
    EXPECT_FALSE(boneOf(name).has_value()) << name;
}

TEST(Humanoids, AreFoundBySkeletonAndMeasured) {
  const Humanoid body = humanoid();
  EXPECT_EQ(body.hips, 0u);
  EXPECT_EQ(body.head, 4u);
  EXPECT_EQ(body.neck, 3u);
  EXPECT_THAT(body.spine, ::testing::ElementsAre(0u, 1u, 2u, 3u));
  EXPECT_LT(body.rest[body.arms[0].upper].position.x, 0) << "the left side of a figure that looks along -Z";
  ASSERT_TRUE(body.legs.has_value());
  EXPECT_NEAR(body.height, 1.75, 1e-6);
  EXPECT_NEAR(body.rest[body.head].position.y + body.eyes.y, kEyes, 1e-6);
  EXPECT_NEAR(body.forearms[0], 0.25, 1e-5);
}

// The feet of the scene `walker` show that it looks along -Z, but its names call the arm at +X left.
TEST(Humanoids, HaveTheSidesOfTheirShapeWhateverTheNamesSay) {
  std::vector<client::tests::FigureJoint> joints = client::tests::figureJoints();
  for (client::tests::FigureJoint& joint : joints) {
    if (joint.name.starts_with("left"))
      joint.name = "right" + joint.name.substr(4);
    else if (joint.name.starts_with("right"))
      joint.name = "left" + joint.name.substr(5);
  }
  const Humanoid body = humanoid(client::tests::figureOf(joints));
  EXPECT_LT(body.rest[body.arms[0].upper].position.x, 0);
  EXPECT_LT(body.rest[(*body.legs)[0].upper].position.x, 0);
  EXPECT_LT(body.eyes.z, 0) << "the eyes look along -Z";
}

// Files of other programs look along +Z. In the body's own frame they look along -Z.
TEST(Humanoids, LookAlongMinusZInTheirOwnFrame) {
  std::vector<client::tests::FigureJoint> joints = client::tests::figureJoints();
  for (client::tests::FigureJoint& joint : joints) {
    joint.x = -joint.x;
    joint.z = -joint.z;
  }
  const Humanoid body = humanoid(client::tests::figureOf(joints, 1));
  EXPECT_LT(body.rest[body.arms[0].upper].position.x, 0);
  EXPECT_LT(body.eyes.z, 0);
  const Point front = body.toCollider * Point{0, 0, -1};
  EXPECT_NEAR(front.z, 1, 1e-12);
}

TEST(Humanoids, NeedHipsHeadAndArms) {
  for (const char* missing : {"hips", "head", "left-arm", "right-forearm"}) {
    std::vector<client::tests::FigureJoint> joints = client::tests::figureJoints();
    std::ranges::find(joints, missing, &client::tests::FigureJoint::name)->name = "other";
    EXPECT_FALSE(findHumanoid(client::tests::figureOf(joints)).has_value()) << missing;
  }
  for (const char* spare : {"left-hand", "right-foot", "neck"}) {
    std::vector<client::tests::FigureJoint> joints = client::tests::figureJoints();
    std::ranges::find(joints, spare, &client::tests::FigureJoint::name)->name = "other";
    EXPECT_TRUE(findHumanoid(client::tests::figureOf(joints)).has_value()) << spare;
  }
  Hull unnamed = client::tests::figure();
  unnamed.skin.names.clear();
  EXPECT_FALSE(findHumanoid(unnamed).has_value());
  EXPECT_FALSE(findHumanoid({}).has_value());
}

TEST(Humanoids, AreSeenFromTheNeckDownByThemselves) {
  const Hull mesh = client::tests::figure();
  const Humanoid body = humanoid(mesh);
  const std::vector<std::uint32_t> corners = trianglesBelowNeck(body, mesh);
  // Three triangles of the head are hidden, and one of the neck.
  EXPECT_EQ(corners.size(), mesh.triangles.size() - 3u * 4);
  for (const std::uint32_t corner : corners) EXPECT_LT(mesh.vertices[3 * corner + 1], 1.4f);
}

TEST(BodySolver, StandsAsAtRestUnderARestingHead) {
  BodySolver solver(humanoid());
  const Humanoid& body = solver.humanoid();
  const Point eyes = body.rest[body.head].position + body.eyes;
  EXPECT_TRUE(solver.update({.head = headAt(eyes)}, 0));
  EXPECT_FALSE(solver.update({.head = headAt(eyes)}, kFrame));
  // The knees are bent a little, so the body is lower by at most 0.5 % of its legs.
  for (const std::size_t joint : body.spine)
    expectNear(solver.joints()[joint].position, body.rest[joint].position, 0.005, "spine");
  for (const LimbJoints& leg : *body.legs)
    expectNear(solver.joints()[*leg.end].position, body.rest[*leg.end].position, 0.001, "ankle");
  expectSameLengths(solver);
}

TEST(BodySolver, StandsWhereThePersonStandsAndLooksWhereItLooks) {
  BodySolver solver(humanoid());
  const Point eyes{2, 0.3 + kEyes, -3};
  settle(solver, {.head = headAt(eyes, 90 * kDegree), .floor = 0.3});
  // It looks along -X, so its left side is at +Z.
  const Point left = partOf(solver, CS_BODY_LEFT_ANKLE), right = partOf(solver, CS_BODY_RIGHT_ANKLE);
  EXPECT_NEAR(left.z - right.z, 0.17, 0.01);
  EXPECT_NEAR(left.y, 0.3 + 0.075, 1e-6);
  expectNear(partOf(solver, CS_BODY_HEAD), eyes, 0.005, "eyes");
  EXPECT_GT(partOf(solver, CS_BODY_HIPS).x, eyes.x) << "the eyes are before the hips";
}

TEST(BodySolver, WritesJointsRelativeToTheirParentsAndToTheCollider) {
  BodySolver solver(humanoid());
  solver.update({.head = headAt({1, kEyes - 0.2, 2}, 1)}, 0);
  const Frame collider{about(direction({1, 2, 3}, {}), 0.7), {4, 5, 6}};
  std::vector<float> numbers;
  solver.writeLocal(collider, numbers);
  const Humanoid& body = solver.humanoid();
  ASSERT_EQ(numbers.size(), 7 * body.rest.size());
  std::vector<Frame> frames;
  for (std::size_t joint = 0; joint < body.rest.size(); ++joint) {
    const Frame above = body.parents[joint] ? frames[*body.parents[joint]] : collider;
    frames.push_back(above * frameOf(numbers.data() + 7 * joint));
    // Single precision of numbers up to 10, over five joints.
    expectNear(frames.back().position, solver.joints()[joint].position, 1e-5, "joint");
  }
}

TEST(BodySolver, BendsTheKneesForwardsWhenTheHeadGoesDown) {
  BodySolver solver(humanoid());
  for (double down = 0; down < 0.45; down += 0.01) {
    solver.update({.head = headAt({0, kEyes - down, 0})}, kFrame);
    expectNear(partOf(solver, CS_BODY_HEAD), {0, kEyes - down, 0}, 0.005, "eyes");
    expectSameLengths(solver);
  }
  const Humanoid& body = solver.humanoid();
  for (const LimbJoints& leg : *body.legs) {
    const Point knee = solver.joints()[leg.lower].position, ankle = solver.joints()[*leg.end].position;
    EXPECT_LT(knee.z, ankle.z - 0.15) << "knees are before the feet";
    EXPECT_NEAR(ankle.y, 0.075, 1e-6);
  }
}

TEST(BodySolver, LeansWhenTheHeadGoesForwardsAndDown) {
  BodySolver solver(humanoid());
  for (double part = 0; part < 1; part += 0.01)
    solver.update({.head = headAt({0, kEyes - 0.3 * part, -0.35 * part}, 0, part)}, kFrame);
  EXPECT_GT(partOf(solver, CS_BODY_HIPS).z, partOf(solver, CS_BODY_HEAD).z + 0.3) << "the hips stay behind";
  EXPECT_NEAR(partOf(solver, CS_BODY_LEFT_ANKLE).z, 0.08, 0.15) << "the feet stay as well";
}

TEST(BodySolver, StaysOnTheFloorUnderTallPeopleAndAboveLowHeads) {
  BodySolver solver(humanoid());
  settle(solver, {.head = headAt({0, kEyes + 0.3, 0})});
  EXPECT_NEAR(partOf(solver, CS_BODY_RIGHT_ANKLE).y, 0.075, 1e-6);
  EXPECT_NEAR(partOf(solver, CS_BODY_HEAD).y, kEyes, 0.01);
  settle(solver, {.head = headAt({0, 0.1, 0})});
  EXPECT_GT(partOf(solver, CS_BODY_HIPS).y, 0.2);
  expectSameLengths(solver);
}

TEST(BodySolver, TurnsTheHipsAfterTheHead) {
  BodySolver solver(humanoid());
  const auto heading = [&] {
    const Point across = partOf(solver, CS_BODY_RIGHT_ANKLE) - partOf(solver, CS_BODY_LEFT_ANKLE);
    return std::atan2(-across.z, across.x);
  };
  settle(solver, {.head = headAt({0, kEyes, 0})});
  solver.update({.head = headAt({0, kEyes, 0}, 0.5)}, kFrame);
  EXPECT_NEAR(heading(), 0, 0.02) << "the head turns alone at first";
  settle(solver, {.head = headAt({0, kEyes, 0}, 2.5)});
  EXPECT_NEAR(heading(), 2.5, 0.75) << "feet step when they are turned away by 40 degrees";
}

TEST(BodySolver, StepsAfterAPersonWhoWalks) {
  BodySolver solver(humanoid());
  int steps = 0;
  std::array<bool, 2> wasUp{};
  for (double z = 0; z > -4; z -= 0.9 * kFrame) {
    solver.update({.head = headAt({0, kEyes, z})}, kFrame);
    const std::array feet{partOf(solver, CS_BODY_LEFT_ANKLE), partOf(solver, CS_BODY_RIGHT_ANKLE)};
    for (std::size_t side = 0; side < 2; ++side) {
      const bool isUp = feet[side].y > 0.075 + Footing::kStepHeight / 2;
      steps += isUp && !wasUp[side] ? 1 : 0;
      wasUp[side] = isUp;
      EXPECT_LT(std::abs(feet[side].z - z), 0.75) << "the feet stay below the body";
    }
  }
  // A way of 4 m takes 4.4 s, and a step 0.3 s.
  EXPECT_GT(steps, 6);
  EXPECT_LE(steps, 15);
  expectSameLengths(solver);
}

TEST(Footing, StandingFeetDoNotSlideAndOneFootStepsAtATime) {
  Footing footing;
  const auto homes = [](double z) {
    return std::array{Foothold{{-0.1, 0.08, z}, 0}, Foothold{{0.1, 0.08, z}, 0}};
  };
  std::array<Foothold, 2> before = footing.update(homes(0), kFrame);
  int stood = 0;
  std::array<int, 2> low{};  // frames since the foot has landed
  for (double z = 0; z > -3; z -= 0.9 * kFrame) {
    const std::array<Foothold, 2> now = footing.update(homes(z), kFrame);
    for (std::size_t side = 0; side < 2; ++side) {
      low[side] = now[side].ankle.y > 0.08 ? 0 : low[side] + 1;
      if (low[side] < 3) continue;
      ++stood;
      EXPECT_EQ(now[side].ankle.z, before[side].ankle.z);
    }
    EXPECT_TRUE(now[0].ankle.y == 0.08 || now[1].ankle.y == 0.08);
    before = now;
  }
  EXPECT_GT(stood, 300);
}

TEST(BodySolver, JumpsWithAHeadThatJumps) {
  BodySolver solver(humanoid());
  settle(solver, {.head = headAt({0, kEyes, 0})});
  EXPECT_FALSE(solver.update({.head = headAt({0.9, kEyes, 0})}, kFrame));
  EXPECT_TRUE(solver.update({.head = headAt({3, kEyes, 0})}, kFrame));
  EXPECT_NEAR(partOf(solver, CS_BODY_LEFT_ANKLE).x, 3 - 0.085, 0.02) << "the feet are below the body at once";
}

TEST(BodySolver, ReachesTowardsAHandThatIsTooFar) {
  BodySolver solver(humanoid());
  const Point far{-0.2, 1.3, -3};
  settle(solver, {.head = headAt({0, kEyes, 0}), .hands = {Frame{{}, far}, {}}});
  const Point shoulder = solver.joints()[solver.humanoid().arms[0].upper].position;
  const Point wrist = partOf(solver, CS_BODY_LEFT_HAND);
  EXPECT_NEAR(length(wrist - shoulder), 0.53, 0.002);
  EXPECT_LT(angle(wrist - shoulder, far - shoulder), 1e-6);
}

TEST(BodySolver, ElbowsFollowBodyTracking) {
  BodySolver solver(humanoid());
  Tracked tracked{.head = headAt({0, kEyes, 0}), .hands = {Frame{{}, {-0.15, 1.2, -0.35}}, {}}};
  settle(solver, tracked);
  const double low = partOf(solver, CS_BODY_LEFT_ELBOW).y;
  tracked.elbows[0] = Point{-0.6, 1.35, -0.1};
  settle(solver, tracked);
  EXPECT_GT(partOf(solver, CS_BODY_LEFT_ELBOW).y, low + 0.1);
  expectNear(partOf(solver, CS_BODY_LEFT_HAND), {-0.15, 1.2, -0.35}, 0.002, "wrist");
}

TEST(BodySolver, HandsAndFeetOfBodyTrackingAreReached) {
  BodySolver solver(humanoid());
  Tracked tracked{.head = headAt({0, kEyes - 0.3, 0})};
  tracked.hips = Point{0, 0.75, 0.2};
  tracked.ankles = {Point{-0.2, 0.1, 0.05}, Point{0.15, 0.3, -0.1}};
  settle(solver, tracked);
  expectNear(partOf(solver, CS_BODY_LEFT_ANKLE), *tracked.ankles[0], 0.002, "left ankle");
  expectNear(partOf(solver, CS_BODY_RIGHT_ANKLE), *tracked.ankles[1], 0.002, "right ankle");
  EXPECT_GT(partOf(solver, CS_BODY_HIPS).z, 0.1) << "the spine leans to the tracked hips";
}

// Poses of a person who walks, turns, bends down and gestures, at a time in seconds. The hands pass in front,
// at the sides, behind the back, overhead and at the face.
Tracked script(double time) {
  const double heading = 1.2 * std::sin(0.31 * time) + 0.4 * std::sin(1.3 * time);
  const double down = 0.22 * (1 - std::cos(0.4 * time));
  const Point eyes{1.5 * std::sin(0.2 * time), kEyes - down, 1.2 * std::cos(0.23 * time) - 0.4 * down};
  Tracked tracked{.head = headAt(eyes, heading, 0.5 * std::sin(0.7 * time) + down)};
  for (std::size_t side = 0; side < 2; ++side) {
    const double sign = side == 0 ? -1 : 1, phase = side == 0 ? 0 : 1.7;
    // Relative to a place between the shoulders.
    const double swing = 0.9 * time + phase, lift = 1.37 * time + phase;
    const Point hand{sign * (0.2 + 0.22 * std::sin(1.1 * swing)),
                     -0.08 + 0.26 * std::sin(0.5 * lift) - 0.05 * std::cos(swing),
                     -0.14 + 0.27 * std::sin(0.8 * lift)};
    const Rotation palm =
        about(direction({std::sin(time), 1, std::cos(time)}, {}), 1.5 * std::sin(0.6 * lift));
    tracked.hands[side] =
        Frame{about({0, 1, 0}, heading) * palm, eyes - Point{0, 0.3, 0} + about({0, 1, 0}, heading) * hand};
  }
  return tracked;
}

// A minute of a headset's frames. Wrists are within 2 cm of the tracked ones while these are within the reach
// of the arm (farthestReach and nearestReach). Elbows do not flip: seen from the torso, the direction of the
// upper arm turns from one frame to the next no farther than three angles together: that of the way from
// shoulder to wrist, the change of the angle between this way and the upper arm, and the swivel about the
// way, which HingeSide limits to kSwivelRate / 90 = 2.5 degrees. The two former are of the person's motion.
// In this script all three together are below 12 degrees; a flip is one of up to 180.
TEST(BodySolver, HandsReachTheTrackedOnesAndElbowsDoNotFlipInAMinute) {
  BodySolver solver(humanoid());
  const Humanoid& body = solver.humanoid();
  const std::size_t chest = *body.parents[body.arms[0].upper];
  struct Before {
    Point way, upper;
    double inner = 0;
  };
  std::array<std::optional<Before>, 2> before;
  double fastest = 0, worst = 0;
  int reached = 0, missed = 0;
  for (int frame = 0; frame < 60 * 90; ++frame) {
    const Tracked tracked = script(kFrame * frame);
    solver.update(tracked, frame == 0 ? 0 : kFrame);
    for (std::size_t side = 0; side < 2; ++side) {
      const LimbJoints& arm = body.arms[side];
      const LimbLengths lengths{0.28, 0.25};
      const Point shoulder = solver.joints()[arm.upper].position, elbow = solver.joints()[arm.lower].position;
      const Point wrist = solver.joints()[*arm.end].position, wanted = tracked.hands[side]->position;
      const double distance = length(wanted - shoulder);
      if (distance < farthestReach(lengths) && distance > nearestReach(lengths)) {
        ++reached;
        worst = std::max(worst, length(wrist - wanted));
      } else {
        ++missed;
      }
      const Rotation torso = inverse(solver.joints()[chest].rotation);
      const Point way = torso * direction(wanted - shoulder, {}),
                  upper = torso * direction(elbow - shoulder, {});
      const Before now{way, upper, angle(way, upper)};
      if (const auto& last = before[side]) {
        const double turned = angle(last->upper, upper);
        fastest = std::max(fastest, turned);
        EXPECT_LT(turned, angle(last->way, way) + std::abs(now.inner - last->inner) +
                              HingeSide::kSwivelRate * kFrame + 1e-6)
            << "frame " << frame << ", side " << side;
      }
      before[side] = now;
    }
    if (frame % 90 == 0) expectSameLengths(solver);
  }
  EXPECT_LT(worst, 0.02);
  EXPECT_LT(fastest, 12 * kDegree) << fastest / kDegree << " degrees";
  EXPECT_GT(reached, 2 * missed) << "the script is within reach most of the time";
  EXPECT_GT(missed, 20) << "and beyond it sometimes";
}

// The way passes through the direction of the pole, where the preferred side jumps from one side to the
// other.
TEST(HingeSide, PassesItsPreferenceWithoutAJump) {
  HingeSide side;
  const Point pole = direction({0.4, -1, 0.5}, {});
  const Point aside = direction(across({1, 0, 0}, pole), {});
  std::optional<Point> before;
  for (double turn = -0.6; turn < 0.6; turn += 0.02) {
    const Point way = std::cos(turn) * pole + std::sin(turn) * aside;
    const Point now = side.update(way, pole, kFrame);
    EXPECT_NEAR(dot(now, way), 0, 1e-9);
    EXPECT_NEAR(length(now), 1, 1e-9);
    if (before) {
      EXPECT_LT(angle(*before, now), 0.02 + HingeSide::kSwivelRate * kFrame);
    }
    before = now;
  }
}

}  // namespace
}  // namespace clothstream::client::body

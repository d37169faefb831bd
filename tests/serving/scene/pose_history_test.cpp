// SPDX-License-Identifier: MIT
// Pose of a hand at the time of a tick.
#include "server/scene/pose_history.h"

#include <cmath>
#include <map>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using namespace schedule;

using model::Vec3;
using tests::handAt;
using namespace std::chrono_literals;

constexpr std::uint64_t kAda = 7;

class PoseHistoryTest : public ::testing::Test {
 protected:
  // Posts hand 1 and a grab at x, `ms` after the start of the test.
  void say(double ms, float place, std::uint64_t participant = kAda) {
    say(ms, handAt(1, place), participant);
  }
  void say(double ms, const model::ParticipantCollider& hand, std::uint64_t participant = kAda) {
    post(ms, {.colliders = {hand}, .grabs = {{.id = 4, .pose = hand.pose}}}, participant);
  }
  void post(double ms, model::ParticipantPoses poses, std::uint64_t participant = kAda) {
    inbox.postPoses(participant, std::move(poses), at(ms),
                    {.trueAt = at(ms), .clientTimeUs = static_cast<std::uint64_t>(1e6 + ms * 1000)});
  }
  // Posts a pose without a time.
  void sayNow(float place) { inbox.postPoses(kAda, {.colliders = {handAt(1, place)}}, begin); }

  // Places the poses for a tick at this time.
  void tick(double ms) {
    placed.clear();
    inbox.drain(inputs);
    for (Poses& poses : inputs.poses) history.add(std::move(poses));
    history.place(at(ms), [&](std::uint64_t participant, const model::ParticipantPoses& poses) {
      placed[participant] = poses;
    });
  }
  // Returns the x of the hand at this time. Expects the same x of the grab.
  float xAt(double ms) {
    tick(ms);
    if (placed.contains(kAda) && !placed[kAda].colliders.empty()) {
      x = placed[kAda].colliders.front().pose.position.x();
      if (!placed[kAda].grabs.empty()) {
        EXPECT_EQ(placed[kAda].grabs.front().pose.position.x(), x);
      }
    }
    return x;
  }
  Clock::time_point at(double ms) const { return begin + std::chrono::microseconds(std::llround(ms * 1000)); }

  const Clock::time_point begin = Clock::time_point{} + 1000s;
  Inbox inbox;
  Inputs inputs;
  PoseHistory history;
  std::map<std::uint64_t, model::ParticipantPoses> placed;
  float x = std::nanf("");  // newest result of xAt()
};

TEST_F(PoseHistoryTest, InterpolatesBetweenPoses) {
  say(0, 0);
  say(10, 0.1f);
  say(20, 0.3f);
  EXPECT_FLOAT_EQ(xAt(0), 0);
  EXPECT_NEAR(xAt(5), 0.05f, 1e-6f);
  EXPECT_NEAR(xAt(10), 0.1f, 1e-6f);
  EXPECT_NEAR(xAt(17.5), 0.25f, 1e-6f);
  EXPECT_NEAR(xAt(20), 0.3f, 1e-6f);
}

TEST_F(PoseHistoryTest, InterpolatesRotationTheShorterWay) {
  const auto turned = [](float degrees) {
    model::ParticipantCollider hand = handAt(1, 0);
    hand.pose.orientation =
        model::Quaternion(Eigen::AngleAxisf(degrees * std::numbers::pi_v<float> / 180, Vec3::UnitY()));
    return hand;
  };
  say(0, turned(20));
  model::ParticipantCollider other = turned(40);
  other.pose.orientation.coeffs() *= -1;  // the same rotation
  say(10, other);
  const auto degrees = [&](double ms) {
    tick(ms);
    const model::Quaternion q = placed[kAda].colliders.front().pose.orientation;
    EXPECT_NEAR(q.norm(), 1, 1e-6f);
    return 2 * std::atan2(std::abs(q.y()), std::abs(q.w())) * 180 / std::numbers::pi_v<float>;
  };
  EXPECT_NEAR(degrees(5), 30, 0.1f);
  EXPECT_NEAR(degrees(10), 40, 0.01f);
  EXPECT_GT(degrees(15), 44);  // extrapolated
  EXPECT_LT(degrees(30), 75);
}

// The poses of a hand at 1 m/s arrive 12 ms after their time. The extrapolated hand is within 8 mm of its
// true position. Without times it would be 12 to 25 mm behind.
TEST_F(PoseHistoryTest, ExtrapolatesOverTheArrivalDelay) {
  double next = 0;
  for (double now = 100; now < 500; now += 8) {
    for (; next + 12 <= now; next += 13) say(next, static_cast<float>(next / 1000));
    EXPECT_NEAR(xAt(now), now / 1000, 0.008);
    EXPECT_LT(std::abs(x - now / 1000), now / 1000 - (next - 13) / 1000);
  }
}

TEST_F(PoseHistoryTest, ExtrapolatesThenReturnsToTheNewestPose) {
  say(0, 0);
  say(10, 0.01f);  // 1 m/s
  EXPECT_NEAR(xAt(20), 0.02f, 0.002f);
  EXPECT_NEAR(xAt(30), 0.03f, 0.006f);
  // The largest distance is at a third of the time. From then on the hand returns.
  EXPECT_NEAR(xAt(60), 0.01f + 0.15f * 4 / 27, 1e-5f);
  EXPECT_LT(xAt(61), 0.01f + 0.15f * 4 / 27);
  float before = x;
  for (double now = 65; now < 160; now += 5) {
    EXPECT_LE(xAt(now), before);
    before = x;
  }
  EXPECT_EQ(xAt(160), 0.01f);
  tick(170);
  EXPECT_TRUE(placed.empty()) << "nothing changes any more";
  say(200, 0.5f);
  EXPECT_EQ(xAt(200), 0.5f);
}

TEST_F(PoseHistoryTest, DoesNotExtrapolateDistantOrFastPoses) {
  say(0, 0);
  say(101, 0.1f);
  EXPECT_EQ(xAt(111), 0.1f);
  say(110, 0.1f + 30 * 0.009f + 0.001f);  // above 30 m/s: a jump
  EXPECT_FLOAT_EQ(xAt(115), 0.371f);
  // A jump is not visible before its time.
  say(125, 5);
  EXPECT_FLOAT_EQ(xAt(124), 0.371f);
  EXPECT_EQ(xAt(125), 5);
}

TEST_F(PoseHistoryTest, NewestPoseActsAtOnce) {
  say(0, 0);
  say(30, 0.3f);  // its time is in the future
  EXPECT_NEAR(xAt(10), 0.1f, 1e-6f);
  say(20, 0.9f);  // late
  EXPECT_NEAR(xAt(20), 0.2f, 1e-6f);
  // Sent later with an earlier time: the client corrected its estimate of the server's clock.
  inbox.postPoses(kAda, {.colliders = {handAt(1, 0.5f)}}, at(21),
                  {.trueAt = at(21), .clientTimeUs = 1'040'000});
  EXPECT_EQ(xAt(21), 0.5f);
  // The first pose acts at once, although its time is in the future.
  say(90, 8, 2);
  tick(50);
  EXPECT_EQ(placed[2].colliders.front().pose.position.x(), 8);
}

TEST_F(PoseHistoryTest, IgnoresLatePosesAndReplacesRepeatedOnes) {
  for (const double ms : {0.0, 10.0, 20.0, 30.0}) say(ms, static_cast<float>(ms / 100));
  EXPECT_NEAR(xAt(25), 0.25f, 1e-6f);
  say(20, 9);
  say(10, 9);
  say(30, 0.3f);
  EXPECT_NEAR(xAt(28), 0.28f, 1e-6f);
  EXPECT_NEAR(xAt(30), 0.3f, 1e-6f);
  EXPECT_NEAR(xAt(35), 0.35f, 0.004f);  // at 10 m/s
  // A pose of a client whose clock was set back far is not late.
  inbox.postPoses(kAda, {.colliders = {handAt(1, 2)}}, at(60), {.trueAt = at(60), .clientTimeUs = 5});
  EXPECT_EQ(xAt(60), 2);
}

TEST_F(PoseHistoryTest, PosesWithoutATimeActAtOnce) {
  sayNow(1);
  EXPECT_EQ(xAt(3), 1);
  sayNow(2);
  EXPECT_EQ(xAt(13), 2);
  tick(23);
  EXPECT_TRUE(placed.empty());
  say(30, 3);
  EXPECT_EQ(xAt(30), 3);
  sayNow(4);
  EXPECT_EQ(xAt(31), 4);
}

TEST_F(PoseHistoryTest, CollidersAppearAndVanishAtTheirTime) {
  post(0, {.grabs = {{.id = 1}}});
  post(10, {.grabs = {{.id = 1}, {.id = 2}}});
  post(20, {});
  const auto grabs = [&](double ms) {
    tick(ms);
    std::vector<std::uint32_t> ids;
    for (const model::Grab& grab : placed[kAda].grabs) ids.push_back(grab.id);
    return ids;
  };
  EXPECT_THAT(grabs(9), testing::ElementsAre(1));
  EXPECT_THAT(grabs(10), testing::ElementsAre(1, 2));
  EXPECT_THAT(grabs(20), testing::ElementsAre());
}

TEST_F(PoseHistoryTest, AttachmentsAndContactRequestsActAtOnce) {
  post(0, {.colliders = {handAt(1, 0)}});
  post(50, {.colliders = {handAt(1, 0)}, .attachments = {{.attachment = 3}}, .wantsContacts = true});
  tick(1);
  ASSERT_EQ(placed[kAda].attachments.size(), 1u);
  EXPECT_EQ(placed[kAda].attachments[0].attachment, 3u);
  EXPECT_TRUE(placed[kAda].wantsContacts);
  tick(2);
  EXPECT_TRUE(placed[kAda].attachments.empty()) << "they stay where they are put";
}

TEST_F(PoseHistoryTest, WindsMoveAndEndAtTheirTime) {
  const auto hold = [&](double ms, float place) {
    post(ms, {.winds = {{{.pose = {.position = Vec3(place, 0, 0)}, .speed = 3}, 1}}});
  };
  hold(0, 0);
  hold(50, 0.5f);
  post(80, {});
  tick(25);
  ASSERT_EQ(placed[kAda].winds.size(), 1u);
  EXPECT_NEAR(placed[kAda].winds[0].pose.position.x(), 0.25f, 1e-5f);
  EXPECT_EQ(placed[kAda].winds[0].speed, 3);
  tick(80);
  EXPECT_TRUE(placed[kAda].winds.empty());
}

TEST_F(PoseHistoryTest, ManyPosesAndParticipantsStaySeparate) {
  for (int i = 0; i <= 1000; ++i) {
    say(i, static_cast<float>(i) / 1000);
    say(i, -static_cast<float>(i) / 1000, 8);
  }
  tick(990);
  EXPECT_NEAR(placed[kAda].colliders.front().pose.position.x(), 0.99f, 1e-5f);
  EXPECT_NEAR(placed[8].colliders.front().pose.position.x(), -0.99f, 1e-5f);
  inbox.postPoses(8, {}, at(991));
  tick(991);
  EXPECT_TRUE(placed[8].colliders.empty());
  tick(992);
  EXPECT_FALSE(placed.contains(8));
}

}  // namespace
}  // namespace clothstream::scene

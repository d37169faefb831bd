// SPDX-License-Identifier: MIT
// Poses of a human body from what a headset knows: the head, and hands if they are tracked.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "clients/core/body/footing.h"
#include "clients/core/body/frame.h"
#include "clients/core/body/humanoid.h"
#include "clients/core/body/limb.h"

namespace clothstream::client::body {

// Known parts of a person, in the scene: metres, y upwards. Places of body tracking are optional.
struct Tracked {
  Frame head{};  // between the eyes; looks along -Z
  // Wrists; the fingers point along -Z, the back of the hand to +Y.
  std::array<std::optional<Frame>, 2> hands{};
  std::optional<Point> hips{};
  std::array<std::optional<Point>, 2> elbows{}, ankles{};
  double floor = 0;  // height of the floor, m
};

// Bends a skeleton to a person. The bones keep their lengths.
//
// - The spine leads down from the head. The hips follow the head when it leaves a dead zone, which grows as
//   the head goes down, and turn with it. The head is where it is tracked as long as the knees can bend or
//   stretch for it. Above a body that is too small, the eyes are above its head.
// - Wrists are where the hands are tracked, within 0.2 % of the length of the arm, between nearestReach() and
//   farthestReach() from the shoulder. A hand that is too far is reached towards. Without a tracked hand the
//   arm hangs.
// - Feet stand, and step when the hips have moved away.
//
// Allocates nothing after construction.
class BodySolver {
 public:
  // Radians by which the head turns before the hips must follow, and part of the rest that they follow in a
  // second.
  static constexpr double kTurnDeadZone = 0.6, kTurnRate = 1;
  // Horizontal distance that the head moves before the hips must follow, m, for a body of 1.7 m, and its
  // growth for each metre that the head goes down.
  static constexpr double kMoveDeadZone = 0.12, kMoveGrowth = 0.7;
  // A head that moves farther than this from one update to the next, m, has jumped.
  static constexpr double kJump = 1;

  explicit BodySolver(Humanoid humanoid);

  const Humanoid& humanoid() const { return humanoid_; }

  // Returns whether the body jumped: first update, or a head that jumped. `seconds` is the time since the
  // last update; more than 0.1 counts as that.
  bool update(const Tracked& tracked, double seconds);
  // Frames of all joints in the scene.
  std::span<const Frame> joints() const { return joints_; }
  // Frame in the scene of a part of the body, by its cs_body_part: as Tracked has it for the head and the
  // hands, and with the orientation of the bone for others. nullopt for other values, and for legs that the
  // body does not have.
  std::optional<Frame> partAt(std::uint32_t part) const;
  // Writes seven numbers for each joint, relative to its parent, for a collider that is at `collider` in the
  // scene.
  void writeLocal(const Frame& collider, std::vector<float>& numbers) const;

 private:
  void turnAndMove(const Tracked& tracked, double seconds);
  void placeTorso(const Tracked& tracked);
  void placeArm(const Tracked& tracked, std::size_t side, double seconds);
  void placeLegs(const Tracked& tracked, double seconds);
  // Wrist to reach for: the tracked one, or that of a hanging arm, with a way of kHandSeconds between the
  // two.
  Point wristOf(const Tracked& tracked, std::size_t side, const Point& shoulder, double reach,
                double seconds);
  // Sets the turn of a joint from its rest, and its place as its parent moves it.
  void place(std::size_t joint, const Rotation& turned);
  void place(std::size_t joint, const Rotation& turned, const Point& position);
  // Places a joint and those above it that are not placed yet as their parents move them. What is above the
  // hips, and joints of other roots, move with the hips.
  void settle(std::size_t joint);
  Point positionOf(std::size_t joint);
  Point restOf(std::size_t joint) const { return humanoid_.rest[joint].position; }

  static constexpr double kHandSeconds = 0.3;

  Humanoid humanoid_;
  std::vector<bool> aboveHips_, placed_;  // of each joint, as the following
  std::vector<Rotation> turned_;          // from the rest
  std::vector<Frame> joints_;
  Point spine_;                              // from hips to head at rest
  double scale_ = 1;                         // height of the body relative to 1.7 m
  double highestHips_ = 0, lowestHips_ = 0;  // m above the floor

  bool begun_ = false;
  Point head_;              // joint of the head, as tracked
  double headHeading_ = 0;  // radians about +Y; 0 looks along -Z
  double heading_ = 0;      // of the hips
  Point lean_;              // horizontal part of the way from hips to head, m
  Point hips_;              // place on the floor above which the hips are
  struct Hand {
    bool isTracked = false;
    Point wrist;                    // relative to the shoulder
    Point offset;                   // of the wrist from where it should be, when tracking began or ended
    double seconds = kHandSeconds;  // since then
  };
  std::array<Hand, 2> hands_;
  std::array<HingeSide, 2> elbows_;
  std::array<Frame, 2> wrists_;  // as Tracked has the hands
  Footing footing_;
};

}  // namespace clothstream::client::body

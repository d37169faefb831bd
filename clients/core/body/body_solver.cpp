// SPDX-License-Identifier: MIT
#include "clients/core/body/body_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "clients/core/core.h"
#include "clients/core/wire/skin.h"

namespace clothstream::client::body {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr Point kUp{0, 1, 0}, kForward{0, 0, -1};
constexpr double kMostSeconds = 0.1;

double wrappedAngle(double angle) {
  return std::atan2(std::sin(angle), std::cos(angle));
}

// Direction to the left or right.
double signOf(std::size_t side) {
  return side == static_cast<std::size_t>(Side::left) ? -1 : 1;
}

// Side on which an elbow is when nothing else says it, in the frame of the torso: down, outwards and back.
Point elbowPole(std::size_t side) {
  return direction({0.4 * signOf(side), -1, 0.5}, kUp);
}

// Heading of a head, also one that looks straight up or down: then its crown says where the front is.
double headingOf(const Rotation& head) {
  const Point look = head * kForward, crown = head * kUp;
  const Point front = horizontal(look) - look.y * horizontal(crown);
  return std::atan2(-front.x, -front.z);
}

// Part of the twist of a hand that its forearm takes: half, as radius and ulna do, up to 120 degrees, and
// then less, so that it is continuous at 180 degrees.
double forearmTwist(double twist) {
  const double size = std::abs(twist);
  return std::copysign(std::min(size / 2, kPi - size), twist);
}

double twistAbout(const Point& axis, const Rotation& q) {
  return wrappedAngle(2 * std::atan2(dot({q.x, q.y, q.z}, axis), q.w));
}

// Rotation of a bone that points along `rest` at rest, with its hinge on the side `restPole`.
Rotation turnedFrom(const Point& rest, const Point& restPole, const Point& now, const Point& pole) {
  return basis(now, pole) * inverse(basis(rest, restPole));
}

}  // namespace

BodySolver::BodySolver(Humanoid humanoid) : humanoid_(std::move(humanoid)) {
  const std::size_t count = humanoid_.rest.size();
  aboveHips_.resize(count);
  placed_.resize(count);
  turned_.resize(count);
  joints_ = humanoid_.rest;
  for (std::optional<std::size_t> joint = humanoid_.parents[humanoid_.hips]; joint;
       joint = humanoid_.parents[*joint])
    aboveHips_[*joint] = true;
  spine_ = restOf(humanoid_.head) - restOf(humanoid_.hips);
  scale_ = humanoid_.height / 1.7;
  highestHips_ = std::numeric_limits<double>::max();
  lowestHips_ = -highestHips_;
  if (!humanoid_.legs) return;
  for (const LimbJoints& leg : *humanoid_.legs) {
    const Point hips = restOf(humanoid_.hips), thigh = restOf(leg.upper), ankle = restOf(*leg.end);
    const LimbLengths lengths{length(restOf(leg.lower) - thigh), length(ankle - restOf(leg.lower))};
    // Knees stay bent by some degrees, or small motions of the head would show in them.
    constexpr double kStanding = 0.995;
    const double above = ankle.y - humanoid_.floor + hips.y - thigh.y,
                 aside = length(horizontal(thigh - ankle));
    const double standing = kStanding * (lengths.upper + lengths.lower);
    highestHips_ =
        std::min(highestHips_, above + std::sqrt(std::max(standing * standing - aside * aside, 0.0)));
    lowestHips_ = std::max(lowestHips_, above + nearestReach(lengths));
  }
  lowestHips_ = std::min(lowestHips_, highestHips_);
}

bool BodySolver::update(const Tracked& tracked, double seconds) {
  seconds = std::clamp(seconds, 0.0, kMostSeconds);
  const Point head = tracked.head * (-1.0 * humanoid_.eyes);
  if (begun_ && length(head - head_) > kJump) begun_ = false;
  head_ = head;
  const bool jumped = !begun_;
  if (jumped)
    for (std::size_t side = 0; side < 2; ++side) {
      elbows_[side].forget();
      hands_[side] = {};
      hands_[side].isTracked = tracked.hands[side].has_value();
    }
  if (jumped) footing_.forget();
  std::fill(placed_.begin(), placed_.end(), false);
  turnAndMove(tracked, seconds);
  placeTorso(tracked);
  for (std::size_t side = 0; side < 2; ++side) placeArm(tracked, side, seconds);
  if (humanoid_.legs) placeLegs(tracked, seconds);
  for (std::size_t joint = 0; joint < joints_.size(); ++joint) settle(joint);
  begun_ = true;
  return jumped;
}

void BodySolver::turnAndMove(const Tracked& tracked, double seconds) {
  headHeading_ = headingOf(tracked.head.rotation);
  const double size = length(spine_);
  if (!begun_) heading_ = headHeading_;
  double turn = wrappedAngle(headHeading_ - heading_);
  turn -= turn * std::min(kTurnRate * seconds, 1.0);
  heading_ = headHeading_ - std::clamp(turn, -kTurnDeadZone, kTurnDeadZone);

  const Point upright = about(kUp, heading_) * horizontal(spine_);
  const double lowered = std::max(tracked.floor + restOf(humanoid_.head).y - humanoid_.floor - head_.y, 0.0);
  Point lean;
  if (tracked.hips) {
    lean = size * horizontal(direction(head_ - *tracked.hips, kUp)) - upright;
  } else if (begun_) {
    // The hips of a person who stands upright come below the head after a while.
    const double straightens = std::clamp(1 - lowered / (0.3 * scale_), 0.0, 1.0) * seconds;
    lean = (1 - straightens) * (horizontal(head_) - hips_ - upright);
  }
  const double most = tracked.hips ? size : kMoveDeadZone * scale_ + kMoveGrowth * lowered;
  if (const double far = length(lean); far > most) lean = most / far * lean;
  lean_ = upright + lean;
  if (const double far = length(lean_); far > 0.9 * size) lean_ = 0.9 * size / far * lean_;
  hips_ = horizontal(head_) - lean_;
}

void BodySolver::placeTorso(const Tracked& tracked) {
  const double size = length(spine_);
  const Point way = (1 / size) * (lean_ + std::sqrt(size * size - dot(lean_, lean_)) * kUp);
  const Rotation heading = about(kUp, heading_);
  const Rotation bent = between(direction(heading * spine_, kUp), way);
  const double twist = wrappedAngle(headHeading_ - heading_);
  const std::vector<std::size_t>& spine = humanoid_.spine;
  const auto count = static_cast<double>(spine.size());
  // The hips bend less than the mean, the chest more. Without a joint between hips and head, both are one.
  Point offset;
  for (std::size_t i = 0; i < spine.size(); ++i) {
    const auto number = static_cast<double>(i);
    const double share = spine.size() == 1 ? 1 : 0.4 + number / (count - 1);
    turned_[spine[i]] = part(bent, share) * about(kUp, heading_ + 0.4 * twist * number / count);
    const std::size_t next = i + 1 < spine.size() ? spine[i + 1] : humanoid_.head;
    offset = offset + turned_[spine[i]] * (restOf(next) - restOf(spine[i]));
  }
  Point hips = head_ - offset;
  hips.y = std::clamp(hips.y, tracked.floor + lowestHips_, tracked.floor + highestHips_);
  place(humanoid_.hips, turned_[humanoid_.hips], hips);
  for (std::size_t i = 1; i < spine.size(); ++i) place(spine[i], turned_[spine[i]]);
  place(humanoid_.head, tracked.head.rotation);
}

Point BodySolver::wristOf(const Tracked& tracked, std::size_t side, const Point& shoulder, double reach,
                          double seconds) {
  Hand& hand = hands_[side];
  const Point hanging =
      0.96 * reach * (about(kUp, heading_) * direction({0.14 * signOf(side), -1, -0.16}, kUp));
  const Point wanted = tracked.hands[side] ? tracked.hands[side]->position - shoulder : hanging;
  if (const bool isTracked = tracked.hands[side].has_value(); isTracked != hand.isTracked) {
    hand.isTracked = isTracked;
    hand.offset = hand.wrist - wanted;
    hand.seconds = 0;
  } else {
    hand.seconds = std::min(hand.seconds + seconds, kHandSeconds);
  }
  const double left = 1 - hand.seconds / kHandSeconds;
  hand.wrist = wanted + left * left * (3 - 2 * left) * hand.offset;
  return shoulder + hand.wrist;
}

void BodySolver::placeArm(const Tracked& tracked, std::size_t side, double seconds) {
  const LimbJoints& arm = humanoid_.arms[side];
  const Point shoulder = positionOf(arm.upper);
  const std::optional<std::size_t> parent = humanoid_.parents[arm.upper];
  const Rotation torso = turned_[*parent];
  const Point restUpper = restOf(arm.lower) - restOf(arm.upper);
  const LimbLengths lengths{length(restUpper), humanoid_.forearms[side]};
  const Point upper = direction(restUpper, kUp);
  const Point lower = arm.end ? direction(restOf(*arm.end) - restOf(arm.lower), upper) : upper;

  const Point wrist = wristOf(tracked, side, shoulder, farthestReach(lengths), seconds);
  const Point way = direction(wrist - shoulder, torso * upper);
  const Point pole = elbowPole(side);
  const Point preferred = tracked.elbows[side] ? inverse(torso) * (*tracked.elbows[side] - shoulder) : pole;
  const Point elbowSide = torso * elbows_[side].update(inverse(torso) * way, preferred, seconds);
  const LimbPose pose = bend(shoulder, wrist, way, elbowSide, lengths);

  const Point toElbow = direction(pose.hinge - shoulder, way),
              toWrist = direction(pose.end - pose.hinge, way);
  place(arm.upper, turnedFrom(upper, pole, toElbow, elbowSide));
  const Rotation forearm = turnedFrom(lower, pole, toWrist, elbowSide);
  // At rest the fingers continue the forearm, and the backs of the hands are up and outwards.
  const Rotation restHand = basis(lower, {0.3 * signOf(side), 1, 0}) * inverse(basis(kForward, kUp));
  const Rotation hand = tracked.hands[side] ? tracked.hands[side]->rotation * inverse(restHand) : forearm;
  const double twist = twistAbout(lower, inverse(forearm) * hand);
  place(arm.lower, forearm * about(lower, forearmTwist(twist)));
  if (arm.end) place(*arm.end, hand);
  wrists_[side] = {hand * restHand, pose.end};
}

void BodySolver::placeLegs(const Tracked& tracked, double seconds) {
  const std::array<LimbJoints, 2>& legs = *humanoid_.legs;
  const Rotation heading = about(kUp, heading_);
  std::array<Foothold, 2> homes;
  for (std::size_t side = 0; side < 2; ++side) {
    const Point aside = restOf(*legs[side].end) - restOf(humanoid_.hips);
    homes[side] = {horizontal(joints_[humanoid_.hips].position) + heading * horizontal(aside), heading_};
    homes[side].ankle.y = tracked.floor + restOf(*legs[side].end).y - humanoid_.floor;
  }
  const std::array<Foothold, 2>& stands = footing_.update(homes, seconds);
  for (std::size_t side = 0; side < 2; ++side) {
    const LimbJoints& leg = legs[side];
    const Point thigh = positionOf(leg.upper);
    const Point ankle = tracked.ankles[side].value_or(stands[side].ankle);
    const double toes = tracked.ankles[side] ? heading_ : stands[side].heading;
    const Point restUpper = restOf(leg.lower) - restOf(leg.upper),
                restLower = restOf(*leg.end) - restOf(leg.lower);
    const Point upper = direction(restUpper, -1.0 * kUp), lower = direction(restLower, -1.0 * kUp);
    const Point way = direction(ankle - thigh, -1.0 * kUp);
    // Knees point between the hips' and the foot's front.
    const Point front = about(kUp, heading_ + wrappedAngle(toes - heading_) / 2) * kForward;
    const Point pole = direction(across(front, way), heading * kForward);
    const LimbPose pose = bend(thigh, ankle, way, pole, {length(restUpper), length(restLower)});
    place(leg.upper, turnedFrom(upper, kForward, direction(pose.hinge - thigh, way), pole));
    place(leg.lower, turnedFrom(lower, kForward, direction(pose.end - pose.hinge, way), pole));
    place(*leg.end, about(kUp, toes));
  }
}

void BodySolver::place(std::size_t joint, const Rotation& turned, const Point& position) {
  turned_[joint] = turned;
  joints_[joint] = {turned * humanoid_.rest[joint].rotation, position};
  placed_[joint] = true;
}

void BodySolver::place(std::size_t joint, const Rotation& turned) {
  place(joint, turned, positionOf(joint));
}

Point BodySolver::positionOf(std::size_t joint) {
  const std::size_t by =
      humanoid_.parents[joint] && !aboveHips_[joint] ? *humanoid_.parents[joint] : humanoid_.hips;
  settle(by);
  return joints_[by].position + turned_[by] * (restOf(joint) - restOf(by));
}

void BodySolver::settle(std::size_t joint) {
  if (placed_[joint]) return;
  const Point position = positionOf(joint);
  const std::size_t by =
      humanoid_.parents[joint] && !aboveHips_[joint] ? *humanoid_.parents[joint] : humanoid_.hips;
  place(joint, turned_[by], position);
}

std::optional<Frame> BodySolver::partAt(std::uint32_t part) const {
  const auto& [left, right] = humanoid_.arms;
  const auto bone = [&](std::size_t joint) { return Frame{turned_[joint], joints_[joint].position}; };
  switch (part) {
    case CS_BODY_HEAD:
      return Frame{turned_[humanoid_.head], bone(humanoid_.head) * humanoid_.eyes};
    case CS_BODY_LEFT_HAND:
      return wrists_[0];
    case CS_BODY_RIGHT_HAND:
      return wrists_[1];
    case CS_BODY_HIPS:
      return bone(humanoid_.hips);
    case CS_BODY_LEFT_ELBOW:
      return bone(left.lower);
    case CS_BODY_RIGHT_ELBOW:
      return bone(right.lower);
    case CS_BODY_LEFT_ANKLE:
    case CS_BODY_RIGHT_ANKLE:
      if (!humanoid_.legs) return std::nullopt;
      return bone(*(*humanoid_.legs)[part == CS_BODY_LEFT_ANKLE ? 0 : 1].end);
    default:
      return std::nullopt;
  }
}

void BodySolver::writeLocal(const Frame& collider, std::vector<float>& numbers) const {
  numbers.resize(kJointNumbers * joints_.size());
  const Frame toCollider = inverse(collider);
  for (std::size_t joint = 0; joint < joints_.size(); ++joint) {
    const std::optional<std::size_t> parent = humanoid_.parents[joint];
    const Frame above = parent ? inverse(joints_[*parent]) : toCollider;
    write(above * joints_[joint], numbers.data() + kJointNumbers * joint);
  }
}

}  // namespace clothstream::client::body

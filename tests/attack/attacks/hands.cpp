// SPDX-License-Identifier: MIT
// Attacks by what participants move: hands, colliders, grabs, attachments and joints.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

constexpr std::chrono::milliseconds kTick{14};
constexpr float kFar = 990;  // m
constexpr double kHalfPi = 1.5707963;

v1::Pose poseAt(float x, float y, float z) {
  v1::Pose pose;
  pose.mutable_position()->set_x(x);
  pose.mutable_position()->set_y(y);
  pose.mutable_position()->set_z(z);
  pose.mutable_orientation()->set_w(1);
  return pose;
}

// Boxes of two metres around this place.
v1::ClientMessage boxesAt(float x, float y) {
  v1::ClientMessage message;
  for (std::uint32_t id = 1; id <= 60; ++id) {
    v1::ParticipantCollider& box = *message.mutable_collider_poses()->add_colliders();
    box.set_id(id);
    *box.mutable_pose() = poseAt(x, y, 0.001f * static_cast<float>(id));
    v1::Vec3& size = *box.mutable_box()->mutable_size();
    size.set_x(2);
    size.set_y(2);
    size.set_z(0.1f);
  }
  return message;
}

// A hand that is open and flat, with the joints of WebXR.
v1::ClientMessage handAt(float x, float y, float z) {
  v1::ClientMessage message;
  v1::HandJoints& hand = *message.mutable_collider_poses()->add_hands();
  hand.set_side(v1::HAND_SIDE_LEFT);
  for (int joint = 0; joint < 25; ++joint) {
    hand.add_positions(x + 0.02f * static_cast<float>(joint / 5));
    hand.add_positions(y + 0.03f * static_cast<float>(joint % 5));
    hand.add_positions(z);
    hand.add_radii(0.01f);
  }
  return message;
}

// Takes the room for colliders, with `boxes`, while another participant comes with a hand. The boxes come
// back after each connection is lost.
std::string crowdOut(const Target& target, const v1::ClientMessage& boxes) {
  const auto stub = stubOf(target);
  auto greedy = std::make_unique<Joined>(*stub, "");
  greedy->send(boxes);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  Joined other(*stub, "");
  std::uint64_t sent = 0;
  for (const auto end = Clock::now() + target.time; Clock::now() < end; ++sent) {
    if (sent % 100 == 50) {
      greedy = std::make_unique<Joined>(*stub, "");
      greedy->send(boxes);
    }
    greedy->send(boxes);
    other.send(handAt(0.3f * std::sin(static_cast<float>(sent) / 20), 1.2f, 0.1f));
    std::this_thread::sleep_for(kTick);
  }
  const std::string error = other.lastError();
  return error.empty() ? "the hand acts" : "the hand is refused: " + brief(error);
}

std::string farBoxes(const Target& target) {
  return crowdOut(target, boxesAt(kFar, kFar));
}

std::string nearBoxes(const Target& target) {
  return crowdOut(target, boxesAt(0, 1.5f));
}

// An owner sets the wind. Returns what is left of it after an attack by `move`, which gets the number of each
// message, and how often the scene went back to its start.
std::string disturb(const Target& target, const std::function<v1::ClientMessage(int)>& move) {
  const auto stub = stubOf(target);
  Joined owner(*stub, "");
  owner.send(windOf(2));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  Joined intruder(*stub, "");
  int sent = 0;
  for (const auto end = Clock::now() + target.time; Clock::now() < end; ++sent) {
    intruder.send(move(sent));
    std::this_thread::sleep_for(kTick);
  }
  grpc::ClientContext context;
  v1::GetSceneRequest request;
  request.set_name(kVictimScene);
  v1::GetSceneResponse response;
  stub->GetScene(&context, request, &response);
  return fmt::format("{} messages sent; the scene went back {}; the wind {}", sent,
                     owner.rolledBack() == 0 ? "never" : "again and again",
                     response.scene().environment().wind().x() == 2 ? "stays" : "is lost");
}

v1::ClientMessage strongGrabs(int number) {
  v1::ClientMessage message;
  for (std::uint32_t id = 1; id <= 10; ++id) {
    v1::Grab& grab = *message.mutable_collider_poses()->add_grabs();
    grab.set_id(id);
    const bool there = (number + static_cast<int>(id)) % 2 == 0;
    *grab.mutable_pose() = poseAt(-1 + 0.2f * static_cast<float>(id), 1.4f,
                                  number == 0 ? 0.0f
                                  : there     ? 4.0f
                                              : -4.0f);
    grab.set_radius(0.1f);
    grab.set_reach(1);
    grab.set_max_force(1e6f);
    grab.set_slip_distance(10);
  }
  return message;
}

// The same ids in other places, and other ids in the same place.
v1::ClientMessage teleportingBalls(int number) {
  v1::ClientMessage message;
  for (std::uint32_t id = 1; id <= 20; ++id) {
    v1::ParticipantCollider& ball = *message.mutable_collider_poses()->add_colliders();
    ball.set_id(id + (number % 3 == 0 ? 100 : 0));
    const float side = (number + static_cast<int>(id)) % 2 == 0 ? 1.0f : -1.0f;
    *ball.mutable_pose() = poseAt(-1 + 0.1f * static_cast<float>(id), 1.2f, 0.3f * side);
    ball.mutable_sphere()->set_radius(id % 2 == 0 ? 0.4f : 3.0f);
  }
  return message;
}

// A bar of 10 m that turns by a quarter.
v1::ClientMessage spinningBar(int number) {
  v1::ClientMessage message;
  v1::ParticipantCollider& bar = *message.mutable_collider_poses()->add_colliders();
  bar.set_id(1);
  *bar.mutable_pose() = poseAt(0, 1.4f, 0.2f);
  const double angle = kHalfPi / 2 * number;
  bar.mutable_pose()->mutable_orientation()->set_w(static_cast<float>(std::cos(angle)));
  bar.mutable_pose()->mutable_orientation()->set_y(static_cast<float>(std::sin(angle)));
  v1::Vec3& size = *bar.mutable_box()->mutable_size();
  size.set_x(10);
  size.set_y(0.2f);
  size.set_z(0.2f);
  return message;
}

std::string pullHard(const Target& target) {
  return disturb(target, strongGrabs);
}
std::string teleport(const Target& target) {
  return disturb(target, teleportingBalls);
}
std::string spin(const Target& target) {
  return disturb(target, spinningBar);
}

// Turns every joint of an avatar to and fro.
std::string shakeJoints(const Target& target) {
  const auto stub = stubOf(target);
  grpc::ClientContext context;
  v1::GetSceneRequest request;
  request.set_name("walker");
  v1::GetSceneResponse response;
  stub->GetScene(&context, request, &response);
  const v1::Collider* avatar = nullptr;
  for (const v1::Collider& collider : response.scene().colliders())
    if (collider.mesh().skin().joints_size() > 0) avatar = &collider;
  if (avatar == nullptr) return "there is no avatar";
  Joined joined(*stub, "walker");
  int sent = 0;
  for (const auto end = Clock::now() + target.time; Clock::now() < end; ++sent) {
    v1::ClientMessage message;
    v1::ColliderJoints& joints = *message.mutable_collider_poses()->add_joints();
    joints.set_collider(avatar->name());
    for (const v1::Joint& joint : avatar->mesh().skin().joints()) {
      v1::Pose& pose = *joints.add_joints();
      pose = joint.rest();
      const double angle = sent % 2 == 0 ? 0.5 : -0.5;
      pose.mutable_orientation()->set_w(static_cast<float>(std::cos(angle)));
      pose.mutable_orientation()->set_x(static_cast<float>(std::sin(angle)));
    }
    if (!joined.send(message)) break;
    std::this_thread::sleep_for(kTick);
  }
  return fmt::format("{} messages sent; the scene {}", sent, joined.open() ? "goes on" : "has ended");
}

constexpr const char* kUndisturbed = "[0-9]+ messages sent; the scene went back never; the wind stays";

constexpr Attack kAttacksHands[] = {
    {"far_boxes", "hold 60 boxes far from all cloth, and come back with them", &farBoxes, "the hand acts"},
    {"near_boxes", "hold 60 boxes in the victim's cloth, and come back with them", &nearBoxes,
     "the hand acts"},
    {"strong_grabs", "pull the victim's cloth to and fro by ten grabs of 1,000,000 N", &pullHard,
     kUndisturbed},
    {"teleporting_balls", "put large balls into the victim's cloth, each time elsewhere", &teleport,
     kUndisturbed},
    {"spinning_bar", "turn a bar of 10 m in the victim's cloth by a quarter in each tick", &spin,
     kUndisturbed},
    {"joints", "turn all joints of an avatar of the operator to and fro, 72 times a second", &shakeJoints,
     "[0-9]+ messages sent; the scene goes on", "--scene-file server/scenes/walker.json"},
};

}  // namespace

std::span<const Attack> handAttacks() {
  return kAttacksHands;
}

}  // namespace clothstream::attack

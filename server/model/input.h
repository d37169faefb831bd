// SPDX-License-Identifier: MIT
// What participants put into a scene while it runs, as plain data. All values validated before.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

// A shape that belongs to a participant: a hand, a part of a finger, a head.
struct ParticipantCollider {
  std::uint32_t id = 0;  // unique among this participant's; the same id moves the same collider
  Pose pose;
  Shape shape = Sphere{};  // sphere, capsule or box
};

// A participant's grab on cloth, as scene.proto's Grab says. Metres, newtons.
struct Grab {
  std::uint32_t id = 0;  // unique among this participant's; the same id is the same grab
  Pose pose = {};
  float radius = 0.03f, reach = 0.1f;
  float maxForce = 20;
  float slipDistance = 0.1f;
};

struct AttachmentPose {
  std::size_t attachment = 0;  // of all of the scene's, in the order of its cloths
  Pose pose = {};
};

// What a participant does at one time.
struct ParticipantPoses {
  std::vector<ParticipantCollider> colliders = {};
  std::vector<Grab> grabs = {};
  std::vector<AttachmentPose> attachments = {};
  bool wantsContacts = false;  // to be told what colliders do to cloth
};

struct ClothChange {
  std::string name = {};  // empty: every cloth
  std::optional<Spring> structural = {}, shear = {}, bend = {};
  std::optional<float> damping = {}, drag = {}, lift = {}, friction = {}, thickness = {};
  std::optional<Solver> solver = {};
  std::optional<std::string> material = {};  // one of materials(); what is given above goes before it
  std::optional<float> arealMass = {};       // kg/m^2
  // Of cloths that have self-collision, and of those that have tethers.
  std::optional<float> ballRadius = {}, ballFriction = {}, tetherSlack = {};
  std::optional<float> dihedralBending = {};
};

struct ColliderChange {
  std::string name = {};
  // Either ends the collider's own motion.
  std::optional<Vec3> position = {};
  std::optional<Quaternion> orientation = {};
  // Of shapes that have them.
  std::optional<float> radius = {}, length = {};
  std::optional<Vec3> size = {};
  std::optional<float> friction = {};
};

// Takes effect at a tick's start, all of it.
struct ParameterChange {
  std::optional<Vec3> gravity = {}, wind = {};
  std::optional<float> airDensity = {};
  std::vector<ClothChange> cloths = {};
  std::vector<ColliderChange> colliders = {};
  std::optional<Gust> gust = {};
};

// The names in the change must exist in the scene.
void applyChange(Scene& scene, const ParameterChange& change);

}  // namespace clothstream::model

// SPDX-License-Identifier: MIT
// Input of participants to a running scene, as plain data. All values are validated before they get here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/parameters/cloth_parameters.h"
#include "proto/parameters/environment_parameters.h"
#include "server/model/local_wind.h"
#include "server/model/scene.h"

namespace clothstream::model {

// Collider of a participant, such as a hand, a part of a finger or a head.
struct ParticipantCollider {
  std::uint32_t id = 0;  // unique for this participant; the same id moves the same collider
  Pose pose;
  Shape shape = Sphere{};  // sphere, capsule or box
};

// Point of a cloth, on one of its triangles.
struct ClothPoint {
  std::uint32_t cloth = 0;      // index in the scene
  std::uint32_t triangle = 0;   // index in the cloth (triangleAt())
  float second = 0, third = 0;  // barycentric coordinates of the triangle's second and third node
};

// Point that a participant saw and takes hold of.
struct GrabPlace {
  ClothPoint point;
  std::uint64_t seenTick = 0;  // tick of the frame that the participant saw
};

// Grab of a participant on cloth; session.proto describes Grab. Metres, newtons.
struct Grab {
  std::uint32_t id = 0;  // unique for this participant; the same id is the same grab
  Pose pose = {};
  float radius = 0.03f, reach = 0.1f;
  float maxForce = 20;
  float slipDistance = 0.1f;
  std::optional<GrabPlace> place = {};  // absent: it grabs what is near its pose
};

struct AttachmentPose {
  std::size_t attachment = 0;  // index into all attachments of the scene, in the order of its cloths
  Pose pose = {};
  bool jumps = false;  // however short the way is
};

// New poses of the joints of a collider that is a mesh with joints.
struct ColliderJoints {
  std::size_t collider = 0;  // index among the colliders of the scene
  std::vector<Pose> joints;  // of all joints, relative to their parents
  bool jumps = false;        // in one tick, however far the way is
};

// Everything that a participant moves, at one time.
struct ParticipantPoses {
  std::vector<ParticipantCollider> colliders = {};
  std::vector<Grab> grabs = {};
  std::vector<HeldWind> winds = {};
  std::vector<AttachmentPose> attachments = {};
  std::vector<ColliderJoints> joints = {};
  bool wantsContacts = false;     // subscribes to contact events
  bool wantsConstraints = false;  // wants reports that name the active constraints

  // Whether it has something that acts until the participant says otherwise.
  bool acts() const { return !(colliders.empty() && grabs.empty() && winds.empty()); }
};

// Absent values leave the cloth as it is. A material sets its own numbers first, then `numbers` apply.
// It selects xpbd, except that a cloth with implicit Euler keeps that solver.
struct ClothChange {
  std::string name = {};  // empty: every cloth
  parameters::ClothNumbers numbers = {};
  std::optional<Solver> solver = {};
  std::optional<std::string> material = {};  // name of one of materials()
  std::optional<float> arealMass = {};       // kg/m^2
};

struct ColliderChange {
  std::string name = {};
  // Position and orientation both end the collider's own motion.
  std::optional<Vec3> position = {};
  std::optional<Quaternion> orientation = {};
  // Sizes apply to shapes that have them.
  std::optional<float> radius = {}, length = {};
  std::optional<Vec3> size = {};
  std::optional<float> friction = {};
};

// The whole change takes effect at the start of one tick.
struct ParameterChange {
  parameters::EnvironmentChange environment = {};
  std::vector<ClothChange> cloths = {};
  std::vector<ColliderChange> colliders = {};
};

// The names in the change must exist in the scene.
void applyChange(Scene& scene, const ParameterChange& change);
void applyChange(Environment& environment, const parameters::EnvironmentChange& change);

}  // namespace clothstream::model

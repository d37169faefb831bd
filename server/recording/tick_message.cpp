// SPDX-License-Identifier: MIT
// Writes and reads the inputs of a tick field by field.
#include "server/recording/tick_message.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/local_wind.h"
#include "server/messages/scene_message.h"
#include "server/messages/shapes.h"
#include "server/messages/skin_message.h"
#include "server/messages/vectors.h"
#include "server/model/cloth_skin.h"

namespace clothstream::recording {
namespace {

v1::Recovery toMessage(scene::Recovery recovery) {
  switch (recovery) {
    case scene::Recovery::rollback:
      return v1::RECOVERY_ROLLBACK;
    case scene::Recovery::reset:
      return v1::RECOVERY_RESET;
    case scene::Recovery::none:
      break;
  }
  return v1::RECOVERY_NONE;
}

// Scene without the geometry of its cloths.
void writeCloths(const model::Scene& scene, v1::RecordedTick& message) {
  model::Scene bare;
  for (const model::Cloth& cloth : scene.cloths) {
    model::Cloth& one = bare.cloths.emplace_back(cloth);
    one.mesh.reset();
    one.pins.clear();
    one.pinnedVertices.clear();
    one.pinnedRegions.clear();
    one.attachments.clear();
    one.skin.reset();
  }
  v1::Scene parameters = messages::toMessage(bare);
  for (std::size_t i = 0; i < bare.cloths.size(); ++i) {
    v1::ClothParameters& to = *message.add_cloths();
    to.mutable_cloth()->Swap(parameters.mutable_cloths(static_cast<int>(i)));
    to.mutable_cloth()->clear_grid();
    if (const auto& correctionFraction = bare.cloths[i].solver.correctionFraction)
      to.set_taken_back(*correctionFraction);
  }
}

void writeColliders(const scene::AppliedTick& tick, v1::RecordedTick& message) {
  for (std::size_t i = 0; i < tick.inputs.colliders.size(); ++i) {
    const simulation::MovingCollider& collider = tick.inputs.colliders[i];
    v1::AppliedCollider& to = *message.add_colliders();
    messages::write(collider.start, *to.mutable_start());
    messages::write(collider.end, *to.mutable_end());
    to.set_friction(collider.friction);
    const scene::ColliderSet::Identity identity = tick.colliders.identity(i);
    to.set_participant_id(identity.participant);
    to.set_id(identity.id);
    messages::write(collider.shape, to);
    messages::writePoses(collider.jointsStart, *to.mutable_joints_start());
    messages::writePoses(collider.jointsEnd, *to.mutable_joints_end());
    if (!collider.jumped) continue;
    messages::write(collider.before, *to.mutable_before());
    messages::writePoses(collider.jointsBefore, *to.mutable_joints_before());
  }
}

void writeGrab(const simulation::Grab& grab, v1::AppliedGrip& message) {
  if (grab.state == simulation::Grab::State::free) return;
  message.set_state(grab.state == simulation::Grab::State::takes ? v1::APPLIED_GRIP_STATE_TAKES
                                                                 : v1::APPLIED_GRIP_STATE_HOLDS);
  messages::write(grab.start, *message.mutable_start());
  messages::write(grab.end, *message.mutable_end());
  message.set_radius(grab.radius);
  message.set_reach(grab.reach);
  message.set_max_force(grab.maxForce);
  message.set_slip_distance(grab.slipDistance);
  message.set_left_at_start(grab.leftAtStart);
  message.set_left_at_end(grab.leftAtEnd);
  if (!grab.place) return;
  message.mutable_place_nodes()->Assign(grab.place->nodes.begin(), grab.place->nodes.end());
  message.mutable_place_weights()->Assign(grab.place->weights.begin(), grab.place->weights.end());
}

// Reads numbers unchanged: quaternions are not normalised again. Remembers whether any number is impossible.
class Numbers {
 public:
  float number(float value, float least, float most) {
    if (!(value >= least && value <= most)) good_ = false;
    return value;
  }
  float number(float value) { return number(value, -kFar, kFar); }
  model::Vec3 vec3(const v1::Vec3& message) {
    return {number(message.x()), number(message.y()), number(message.z())};
  }
  model::Pose pose(const v1::Pose& message) {
    const v1::Quaternion& q = message.orientation();
    model::Pose pose{vec3(message.position()), {number(q.w()), number(q.x()), number(q.y()), number(q.z())}};
    if (std::abs(pose.orientation.norm() - 1) > messages::limits::kUnitTolerance) good_ = false;
    return pose;
  }
  std::uint32_t integer(std::uint32_t value, std::uint32_t end) {
    if (value >= end) good_ = false;
    return value;
  }
  void require(bool condition) { good_ = good_ && condition; }
  bool good() const { return good_; }

 private:
  static constexpr float kFar = 1e6f;
  bool good_ = true;
};

constexpr float kMaxSize = 1e4f;  // m

float sizeOf(Numbers& numbers, float value) {
  return numbers.number(value, 0, kMaxSize);
}

model::Capsule capsuleOf(Numbers& numbers, const v1::Capsule& message) {
  model::Capsule capsule{.radius = sizeOf(numbers, message.radius()),
                         .length = sizeOf(numbers, message.length())};
  if (message.has_top_radius()) capsule.topRadius = sizeOf(numbers, message.top_radius());
  return capsule;
}

model::Shape shapeOf(Numbers& numbers, const v1::AppliedCollider& message, const model::Scene& scene,
                     bool& known) {
  switch (message.shape_case()) {
    case v1::AppliedCollider::kSphere:
      return model::Sphere{sizeOf(numbers, message.sphere().radius())};
    case v1::AppliedCollider::kCapsule:
      return capsuleOf(numbers, message.capsule());
    case v1::AppliedCollider::kPlane:
      return model::Plane{};
    case v1::AppliedCollider::kBox: {
      const v1::Vec3& box = message.box().size();
      return model::Box{{sizeOf(numbers, box.x()), sizeOf(numbers, box.y()), sizeOf(numbers, box.z())}};
    }
    case v1::AppliedCollider::SHAPE_NOT_SET:
      break;
  }
  known = false;
  if (message.participant_id() == 0 && message.id() < scene.colliders.size()) {
    known = std::visit(
        model::ShapeVisitor{
            [](const model::Sphere&) { return false; }, [](const model::Capsule&) { return false; },
            [](const model::Plane&) { return false; }, [](const model::Box&) { return false; },
            [](const model::Hull&) { return true; }, [](const model::Solid&) { return true; }},
        scene.colliders[message.id()].shape);
  }
  return known ? scene.colliders[message.id()].shape : model::Shape{};
}

// Joints of a mesh, which has `count`.
std::vector<model::Pose> jointsOf(Numbers& numbers, const google::protobuf::RepeatedField<float>& message,
                                  std::size_t count) {
  const bool complete = static_cast<std::size_t>(message.size()) == 7 * count;
  numbers.require(complete);
  std::vector<model::Pose> poses;
  if (!complete) return poses;
  for (const float* at = message.data(); poses.size() < count; at += 7) {
    v1::Pose pose;
    messages::write(model::Vec3(at[0], at[1], at[2]), *pose.mutable_position());
    messages::write(model::Quaternion(at[6], at[3], at[4], at[5]), *pose.mutable_orientation());
    poses.push_back(numbers.pose(pose));
  }
  return poses;
}

model::LocalWind windOf(Numbers& numbers, const v1::LocalWind& message) {
  constexpr float kLeast = 0.01f;  // m; kernels divide by sizes
  const auto size = [&](float value) { return numbers.number(value, kLeast, kMaxSize); };
  model::LocalWind wind{.pose = numbers.pose(message.pose()), .speed = numbers.number(message.speed())};
  switch (message.kind_case()) {
    case v1::LocalWind::kFan:
      wind.kind = model::Fan{.radius = size(message.fan().radius()),
                             .spread = numbers.number(message.fan().spread(), 0, 1),
                             .range = size(message.fan().range())};
      break;
    case v1::LocalWind::kVortex:
      wind.kind =
          model::Vortex{.radius = size(message.vortex().radius()), .reach = size(message.vortex().reach())};
      break;
    case v1::LocalWind::KIND_NOT_SET:
      numbers.require(false);
  }
  return wind;
}

std::size_t jointCountOf(const model::Shape& shape) {
  const auto* solid = std::get_if<model::Solid>(&shape);
  return solid != nullptr && (*solid)->skin ? (*solid)->skin->joints.size() : 0;
}

// Whether one of the colliders is this mesh.
bool has(const std::vector<simulation::MovingCollider>& colliders, const model::Shape& mesh) {
  return std::ranges::any_of(colliders, [&](const simulation::MovingCollider& collider) {
    return simulation::isSolid(collider) &&
           std::get<model::Solid>(collider.shape) == std::get<model::Solid>(mesh);
  });
}

std::optional<simulation::WeightedNodes> placeOf(Numbers& numbers, const v1::AppliedGrip& message,
                                                 std::uint32_t nodeCount) {
  if (message.place_nodes().empty() && message.place_weights().empty()) return std::nullopt;
  simulation::WeightedNodes place;
  const bool complete = message.place_nodes_size() == 3 && message.place_weights_size() == 3;
  numbers.require(complete);
  for (int i = 0; complete && i < 3; ++i) {
    place.nodes[static_cast<std::size_t>(i)] = numbers.integer(message.place_nodes(i), nodeCount);
    place.weights[static_cast<std::size_t>(i)] = numbers.number(message.place_weights(i));
  }
  return place;
}

simulation::Grab grabOf(Numbers& numbers, const v1::AppliedGrip& message, std::uint32_t nodeCount) {
  if (message.state() == v1::APPLIED_GRIP_STATE_FREE) return {};
  return {.state = message.state() == v1::APPLIED_GRIP_STATE_TAKES ? simulation::Grab::State::takes
                                                                   : simulation::Grab::State::holds,
          .start = numbers.pose(message.start()),
          .end = numbers.pose(message.end()),
          .radius = numbers.number(message.radius(), 0, kMaxSize),
          .reach = numbers.number(message.reach(), 0, kMaxSize),
          .maxForce = numbers.number(message.max_force()),
          .slipDistance = numbers.number(message.slip_distance()),
          .place = placeOf(numbers, message, nodeCount),
          .leftAtStart = numbers.number(message.left_at_start(), 0, 1),
          .leftAtEnd = numbers.number(message.left_at_end(), 0, 1)};
}

}  // namespace

void write(const scene::AppliedTick& tick, v1::RecordedTick& message) {
  message.Clear();
  message.set_tick(tick.tick);
  message.set_state_hash(tick.status.stateHash);
  message.set_unhealthy(!tick.status.healthy);
  message.set_recovery(toMessage(tick.recovery));
  message.set_keeps_state(tick.keepsState);
  if (tick.clothsChanged) writeCloths(tick.scene, message);
  if (tick.substeps != tick.scene.substeps) message.set_substeps(tick.substeps);
  messages::write(tick.inputs.environment.gravity, *message.mutable_gravity());
  messages::write(tick.inputs.environment.wind, *message.mutable_wind());
  message.set_air_density(tick.inputs.environment.airDensity);
  for (const model::LocalWind& wind : tick.inputs.winds) messages::write(wind, *message.add_winds());
  writeColliders(tick, message);
  for (const model::Pose& pose : tick.inputs.attachments) messages::write(pose, *message.add_attachments());
  for (const model::Carry& carry : tick.inputs.carries) {
    v1::AppliedCarry& to = *message.add_carries();
    to.set_cloth(carry.cloth);
    messages::write(carry.from, *to.mutable_from());
    messages::write(carry.to, *to.mutable_to());
  }
  for (const simulation::Grab& grab : tick.inputs.grabs) writeGrab(grab, *message.add_grips());
  message.set_surfaces_left_out(static_cast<std::uint32_t>(tick.inputs.surfaces.size()));
}

tl::expected<simulation::TickInputs, std::string> toInputs(const v1::RecordedTick& message,
                                                           const model::Scene& scene) {
  const auto wrong = [&](const char* what) {
    return tl::unexpected(fmt::format("tick {}: {}", message.tick(), what));
  };
  std::size_t attachments = 0;
  for (const model::Cloth& cloth : scene.cloths) attachments += cloth.attachments.size();
  if (static_cast<std::size_t>(message.attachments_size()) != attachments)
    return wrong("its attachments are not those of the scene");
  if (static_cast<std::size_t>(message.colliders_size()) > simulation::kMaxColliders ||
      static_cast<std::size_t>(message.grips_size()) > simulation::kMaxGrabs ||
      static_cast<std::size_t>(message.winds_size()) > model::kMaxLocalWinds)
    return wrong("it has too many colliders, grabs or local winds");
  if (message.substeps() > scene.substeps) return wrong("it has more substeps than the scene");
  Numbers numbers;
  simulation::TickInputs inputs;
  inputs.environment.gravity = numbers.vec3(message.gravity());
  inputs.environment.wind = numbers.vec3(message.wind());
  inputs.environment.airDensity = numbers.number(message.air_density());
  for (const v1::LocalWind& wind : message.winds()) inputs.winds.push_back(windOf(numbers, wind));
  for (const v1::AppliedCollider& collider : message.colliders()) {
    bool known = true;
    const model::Shape shape = shapeOf(numbers, collider, scene, known);
    if (!known) return wrong("one of its colliders has no shape");
    inputs.colliders.push_back({shape, numbers.pose(collider.start()), numbers.pose(collider.end()),
                                numbers.number(collider.friction()),
                                jointsOf(numbers, collider.joints_start(), jointCountOf(shape)),
                                jointsOf(numbers, collider.joints_end(), jointCountOf(shape))});
    if (!collider.has_before()) continue;
    simulation::MovingCollider& jumping = inputs.colliders.back();
    jumping.jumped = true;
    jumping.before = numbers.pose(collider.before());
    jumping.jointsBefore = jointsOf(numbers, collider.joints_before(), jointCountOf(shape));
  }
  for (const model::Cloth& cloth : scene.cloths)
    if (cloth.skin && !has(inputs.colliders, scene.colliders[model::skinCollider(scene, cloth)].shape))
      return wrong("it lacks the collider whose joints a cloth follows");
  for (const v1::Pose& pose : message.attachments()) inputs.attachments.push_back(numbers.pose(pose));
  if (static_cast<std::size_t>(message.carries_size()) > scene.cloths.size())
    return wrong("it carries more cloths than the scene has");
  for (const v1::AppliedCarry& carry : message.carries())
    inputs.carries.push_back({numbers.integer(carry.cloth(), static_cast<std::uint32_t>(scene.cloths.size())),
                              numbers.pose(carry.from()), numbers.pose(carry.to())});
  for (const v1::AppliedGrip& grab : message.grips())
    inputs.grabs.push_back(grabOf(numbers, grab, scene.nodeCount()));
  if (!numbers.good()) return wrong("one of its numbers is out of range");
  return inputs;
}

tl::expected<std::vector<model::Cloth>, std::string> toCloths(const v1::RecordedTick& message,
                                                              const v1::Scene& definition) {
  if (message.cloths_size() != definition.cloths_size())
    return tl::unexpected(fmt::format("tick {}: it has {} cloths, but the scene has {}", message.tick(),
                                      message.cloths_size(), definition.cloths_size()));
  v1::Scene changed = definition;
  for (int i = 0; i < message.cloths_size(); ++i) {
    v1::Cloth cloth = message.cloths(i).cloth();
    v1::Cloth& whole = *changed.mutable_cloths(i);
    cloth.set_name(whole.name());
    cloth.mutable_pins()->Swap(whole.mutable_pins());
    cloth.mutable_pinned_vertices()->Swap(whole.mutable_pinned_vertices());
    cloth.mutable_pinned_regions()->Swap(whole.mutable_pinned_regions());
    cloth.mutable_attachments()->Swap(whole.mutable_attachments());
    cloth.clear_skin();
    if (whole.has_skin()) cloth.mutable_skin()->Swap(whole.mutable_skin());
    if (whole.has_mesh())
      cloth.mutable_mesh()->Swap(whole.mutable_mesh());
    else
      cloth.mutable_grid()->Swap(whole.mutable_grid());
    whole.Swap(&cloth);
  }
  messages::Result<model::Scene> scene = messages::toScene(changed);
  if (!scene) return tl::unexpected(fmt::format("tick {}: {}", message.tick(), scene.error().text));
  for (int i = 0; i < message.cloths_size(); ++i)
    if (message.cloths(i).has_taken_back())
      scene->cloths[static_cast<std::size_t>(i)].solver.correctionFraction = message.cloths(i).taken_back();
  return std::move(scene->cloths);
}

}  // namespace clothstream::recording

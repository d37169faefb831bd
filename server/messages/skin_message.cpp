// SPDX-License-Identifier: MIT
#include "server/messages/skin_message.h"

#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

// Deviations of the sum of a vertex's weights from 1: that is allowed, and that rounding leaves.
constexpr double kWeightTolerance = 0.01, kNormalised = 1e-6;

// A pose whose orientation was normalised before keeps its bits.
model::Pose toExactPose(Checks& checks, const Path& path, const v1::Pose& message) {
  model::Pose pose = toPose(checks, path, message);
  const v1::Quaternion& q = message.orientation();
  const Eigen::Quaterniond given(q.w(), q.x(), q.y(), q.z());
  if (std::abs(given.norm() - 1) < kNormalised) pose.orientation = given.cast<float>();
  return pose;
}

model::Joint toJoint(Checks& checks, const Path& path, const v1::Joint& message, std::uint32_t index) {
  model::Joint joint{.name = checks.text(path / "name", message.name()),
                     .parent = {},
                     .rest = toExactPose(checks, path / "rest", message.rest())};
  if (!message.has_parent()) return joint;
  if (message.parent() >= index)
    checks.fail(path / "parent", fmt::format("{}", message.parent()),
                fmt::format("must be less than the joint's own index, {}", index));
  joint.parent = message.parent();
  return joint;
}

std::vector<model::JointKey> toKeys(Checks& checks, const Path& path, const v1::JointAnimation& message,
                                    std::size_t jointCount) {
  const auto count = static_cast<std::size_t>(message.keys_size());
  checks.count(path / "keys", count, 2, limits::kMaxMotionKeys);
  if (count * jointCount > limits::kMaxAnimationPoses)
    checks.fail(path / "keys", "",
                fmt::format("have {} poses of joints; must have at most {}", count * jointCount,
                            limits::kMaxAnimationPoses));
  std::vector<model::JointKey> keys;
  for (int i = 0; i < message.keys_size() && !checks.failed(); ++i) {
    const v1::JointKey& from = message.keys(i);
    const Path at = path.at("keys", i);
    const float time = checks.number(at / "time", from.time(), limits::kMotionTime);
    if (i == 0 ? time != 0 : time <= keys.back().time)
      checks.fail(at / "time", fmt::format("{}", time),
                  i == 0 ? "must be 0 for the first key" : "must be above that of the key before");
    keys.push_back({time, toJoints(checks, at / "joints", from.joints(), jointCount)});
  }
  return keys;
}

}  // namespace

model::VertexJoints toVertexJoints(Checks& checks, const Path& path,
                                   const google::protobuf::RepeatedField<std::uint32_t>& indices,
                                   const google::protobuf::RepeatedField<float>& weights, std::size_t vertex,
                                   std::size_t jointCount) {
  model::VertexJoints joints;
  const auto first = static_cast<int>(model::kVertexJoints * vertex);
  double sum = 0;
  for (std::size_t k = 0; k < model::kVertexJoints; ++k) {
    const int index = first + static_cast<int>(k);
    joints.joints[k] = static_cast<std::uint8_t>(checks.integer(
        path.at("vertexJoints", index), indices[index], 0, static_cast<std::uint32_t>(jointCount) - 1));
    joints.weights[k] = checks.number(path.at("vertexWeights", index), weights[index], Range{0, 1});
    sum += double{joints.weights[k]};
  }
  if (!checks.failed() && std::abs(sum - 1) > kWeightTolerance)
    checks.fail(path.at("vertexWeights", first), "",
                fmt::format("and the next three add up to {:.4g}; must add up to 1", sum));
  // Weights that were normalised before keep their bits, so that a recorded scene is the same.
  if (std::abs(sum - 1) > kNormalised)
    for (float& weight : joints.weights) weight = static_cast<float>(double{weight} / sum);
  return joints;
}

std::vector<model::Pose> toJoints(Checks& checks, const Path& path,
                                  const google::protobuf::RepeatedPtrField<v1::Pose>& message,
                                  std::size_t jointCount) {
  checks.count(path, static_cast<std::size_t>(message.size()), jointCount, jointCount);
  std::vector<model::Pose> poses;
  for (int i = 0; i < message.size() && !checks.failed(); ++i)
    poses.push_back(toExactPose(checks, path.at("", i), message[i]));
  return poses;
}

std::optional<model::Skin> toSkin(Checks& checks, const Path& path, const v1::Skin& message,
                                  std::size_t vertexCount, std::span<const std::uint32_t> sources) {
  const auto count = [&](std::string_view field, int elements, std::size_t least, std::size_t most) {
    checks.count(path / field, static_cast<std::size_t>(elements), least, most);
  };
  count("joints", message.joints_size(), 1, limits::kMaxJoints);
  const std::size_t numbers = model::kVertexJoints * vertexCount;
  count("vertexJoints", message.vertex_joints_size(), numbers, numbers);
  count("vertexWeights", message.vertex_weights_size(), numbers, numbers);
  if (checks.failed()) return std::nullopt;
  model::Skin skin;
  for (int i = 0; i < message.joints_size(); ++i)
    skin.joints.push_back(
        toJoint(checks, path.at("joints", i), message.joints(i), static_cast<std::uint32_t>(i)));
  for (std::size_t i = 0; i < sources.size() && !checks.failed(); ++i)
    skin.vertices.push_back(toVertexJoints(checks, path, message.vertex_joints(), message.vertex_weights(),
                                           sources[i], skin.joints.size()));
  if (message.has_animation())
    skin.keys = toKeys(checks, path / "animation", message.animation(), skin.joints.size());
  if (checks.failed()) return std::nullopt;
  return skin;
}

void write(const model::Skin& skin, v1::Skin& message) {
  for (const model::Joint& joint : skin.joints) {
    v1::Joint& to = *message.add_joints();
    to.set_name(joint.name);
    if (joint.parent) to.set_parent(*joint.parent);
    write(joint.rest, *to.mutable_rest());
  }
  for (const model::VertexJoints& vertex : skin.vertices) {
    message.mutable_vertex_joints()->Add(vertex.joints.begin(), vertex.joints.end());
    message.mutable_vertex_weights()->Add(vertex.weights.begin(), vertex.weights.end());
  }
  for (const model::JointKey& key : skin.keys) {
    v1::JointKey& to = *message.mutable_animation()->add_keys();
    to.set_time(key.time);
    for (const model::Pose& pose : key.joints) write(pose, *to.add_joints());
  }
}

void writePoses(std::span<const model::Pose> poses, google::protobuf::RepeatedField<float>& numbers) {
  for (const model::Pose& pose : poses) {
    numbers.Add(pose.position.data(), pose.position.data() + 3);
    const Eigen::Vector4f& q = pose.orientation.coeffs();  // x y z w
    numbers.Add(q.data(), q.data() + 4);
  }
}

void writeJoints(const model::Skin& skin, std::span<const model::Pose> local,
                 google::protobuf::RepeatedField<float>& numbers) {
  std::array<model::Pose, model::kMaxJoints> poses;
  model::compose(skin, local, std::span(poses).first(local.size()));
  writePoses(std::span(poses).first(local.size()), numbers);
}

}  // namespace clothstream::messages

// SPDX-License-Identifier: MIT
#include "server/model/skin.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace clothstream::model {
namespace {

using Four = std::array<double, 4>;  // quaternion x y z w

Four fourOf(const Quaternion& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}

Four unit(const Four& q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

Four product(const Four& a, const Four& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] + a[1] * b[3] + a[2] * b[0] - a[0] * b[2],
          a[3] * b[2] + a[2] * b[3] + a[0] * b[1] - a[1] * b[0],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

using Frame = JointFrame;

Frame frameOf(const Pose& pose) {
  return {unit(fourOf(pose.orientation)),
          {double{pose.position[0]}, double{pose.position[1]}, double{pose.position[2]}}};
}

// Rows of the rotation's matrix, then the translation in the fourth column.
Transform matrixOf(const Frame& frame) {
  const auto [x, y, z, w] = frame.rotation;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),     frame.position[0],
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),     frame.position[1],
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y), frame.position[2]};
}

std::array<double, 3> applied(const Transform& t, const std::array<double, 3>& p) {
  std::array<double, 3> result{};
  for (std::size_t row = 0; row < 3; ++row)
    result[row] = t[4 * row] * p[0] + t[4 * row + 1] * p[1] + t[4 * row + 2] * p[2] + t[4 * row + 3];
  return result;
}

// `inner` is given in the frame `outer`.
Frame inFrame(const Frame& outer, const Frame& inner) {
  return {unit(product(outer.rotation, inner.rotation)), applied(matrixOf(outer), inner.position)};
}

Frame inverse(const Frame& frame) {
  Frame back{{-frame.rotation[0], -frame.rotation[1], -frame.rotation[2], frame.rotation[3]}, {}};
  const std::array<double, 3> moved = applied(matrixOf(back), frame.position);
  back.position = {-moved[0], -moved[1], -moved[2]};
  return back;
}

using Frames = std::array<Frame, kMaxJoints>;

void composeFrames(const Skin& skin, std::span<const Pose> local, Frames& frames) {
  assert(local.size() == skin.joints.size() && local.size() <= frames.size());
  for (std::size_t i = 0; i < local.size(); ++i) {
    const Frame own = frameOf(local[i]);
    frames[i] = skin.joints[i].parent ? inFrame(frames[*skin.joints[i].parent], own) : own;
  }
}

Pose poseOf(const Frame& frame) {
  Pose pose;
  for (int i = 0; i < 4; ++i)
    pose.orientation.coeffs()[i] = static_cast<float>(frame.rotation[static_cast<std::size_t>(i)]);
  for (int i = 0; i < 3; ++i)
    pose.position[i] = static_cast<float>(frame.position[static_cast<std::size_t>(i)]);
  return pose;
}

}  // namespace

Pose between(const Pose& a, const Pose& b, double part) {
  const Four from = fourOf(a.orientation), to = fourOf(b.orientation);
  const double dot = from[0] * to[0] + from[1] * to[1] + from[2] * to[2] + from[3] * to[3];
  const double sign = dot < 0 ? -1 : 1;
  Frame frame{};
  for (std::size_t i = 0; i < 4; ++i) frame.rotation[i] = from[i] + (sign * to[i] - from[i]) * part;
  frame.rotation = unit(frame.rotation);
  for (std::size_t i = 0; i < 3; ++i) {
    const double start = a.position[static_cast<int>(i)];
    frame.position[i] = start + (double{b.position[static_cast<int>(i)]} - start) * part;
  }
  return poseOf(frame);
}

void compose(const Skin& skin, std::span<const Pose> local, std::vector<Pose>& poses) {
  poses.resize(local.size());
  compose(skin, local, std::span(poses));
}

void compose(const Skin& skin, std::span<const Pose> local, std::span<Pose> poses) {
  assert(poses.size() == local.size());
  Frames frames;
  composeFrames(skin, local, frames);
  for (std::size_t i = 0; i < local.size(); ++i) poses[i] = poseOf(frames[i]);
}

std::vector<Pose> restJoints(const Skin& skin) {
  std::vector<Pose> poses;
  for (const Joint& joint : skin.joints) poses.push_back(joint.rest);
  return poses;
}

void jointsAt(const Skin& skin, double seconds, std::vector<Pose>& local) {
  local.clear();
  if (skin.keys.empty()) {
    for (const Joint& joint : skin.joints) local.push_back(joint.rest);
    return;
  }
  const double period = skin.keys.back().time;
  const double time = seconds - period * std::floor(seconds / period);
  std::size_t next = 1;
  while (next + 1 < skin.keys.size() && time >= skin.keys[next].time) ++next;
  const JointKey &from = skin.keys[next - 1], &to = skin.keys[next];
  const double part = (time - from.time) / (double{to.time} - from.time);
  for (std::size_t i = 0; i < skin.joints.size(); ++i)
    local.push_back(between(from.joints[i], to.joints[i], part));
}

std::vector<JointFrame> inverseRests(const Skin& skin) {
  Frames frames;
  composeFrames(skin, restJoints(skin), frames);
  std::vector<JointFrame> inverses;
  for (std::size_t i = 0; i < skin.joints.size(); ++i) inverses.push_back(inverse(frames[i]));
  return inverses;
}

void jointTransforms(std::span<const JointFrame> inverseRests, std::span<const Pose> poses,
                     std::span<Transform> transforms) {
  assert(poses.size() == inverseRests.size() && transforms.size() == poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    transforms[i] = matrixOf(inFrame(frameOf(poses[i]), inverseRests[i]));
}

void jointTransforms(std::span<const JointFrame> inverseRests, std::span<const Pose> poses, const Pose& frame,
                     std::span<Transform> transforms) {
  assert(poses.size() == inverseRests.size() && transforms.size() == poses.size());
  const Frame outer = frameOf(frame);
  for (std::size_t i = 0; i < poses.size(); ++i)
    transforms[i] = matrixOf(inFrame(inFrame(outer, frameOf(poses[i])), inverseRests[i]));
}

std::vector<Transform> jointTransforms(const Skin& skin, std::span<const Pose> poses) {
  std::vector<Transform> transforms(poses.size());
  jointTransforms(inverseRests(skin), poses, transforms);
  return transforms;
}

Eigen::Vector3d transformed(const Transform& transform, const Eigen::Vector3d& point) {
  const std::array<double, 3> p = applied(transform, {point.x(), point.y(), point.z()});
  return {p[0], p[1], p[2]};
}

SkinBounds skinBounds(std::span<const VertexJoints> joints, std::size_t jointCount,
                      std::span<const Vec3> vertices) {
  const float far = std::numeric_limits<float>::max();
  SkinBounds bounds{{jointCount, {Vec3::Constant(far), Vec3::Constant(-far)}}};
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (std::size_t k = 0; k < kVertexJoints; ++k) {
      if (joints[i].weights[k] == 0) continue;
      SkinBounds::Box& box = bounds.boxes[joints[i].joints[k]];
      box.low = box.low.cwiseMin(vertices[i]);
      box.high = box.high.cwiseMax(vertices[i]);
    }
  return bounds;
}

SkinMotion motionBetween(const SkinBounds& bounds, std::span<const Transform> start,
                         std::span<const Transform> end) {
  constexpr double kRounding = 1.00001;
  double reach = 0, farthest = 0;
  for (std::size_t i = 0; i < bounds.boxes.size(); ++i) {
    const SkinBounds::Box& box = bounds.boxes[i];
    if (box.low.x() > box.high.x()) continue;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d point((corner & 1u) != 0 ? box.high.x() : box.low.x(),
                                  (corner & 2u) != 0 ? box.high.y() : box.low.y(),
                                  (corner & 4u) != 0 ? box.high.z() : box.low.z());
      const Eigen::Vector3d from = transformed(start[i], point), to = transformed(end[i], point);
      reach = std::max({reach, from.norm(), to.norm()});
      farthest = std::max(farthest, (to - from).norm());
    }
  }
  return {static_cast<float>(kRounding * reach), static_cast<float>(kRounding * farthest)};
}

Eigen::Vector3d skinned(const VertexJoints& vertex, std::span<const Transform> transforms,
                        const Eigen::Vector3d& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < kVertexJoints; ++k)
    sum += double{vertex.weights[k]} * transformed(transforms[vertex.joints[k]], point);
  return sum;
}

}  // namespace clothstream::model

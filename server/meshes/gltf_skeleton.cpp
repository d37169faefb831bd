// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_skeleton.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/gltf_accessor.h"
#include "server/meshes/gltf_channels.h"
#include "server/meshes/gltf_name.h"
#include "server/meshes/gltf_primitive.h"

namespace clothstream::meshes {
namespace {

template <typename T>
using Expected = tl::expected<T, std::string>;

// Joints and the nodes above them.
constexpr std::size_t kMaxNodes = 1024;
constexpr int kNoParent = -1;
// Deviations of a matrix from a rotation with a scale, and of the scales of joints, relative.
constexpr double kSimilar = 1e-3;
// Largest rotation between two keys, as the cosine of half the angle (30 degrees): the normalised mean of two
// quaternions then differs by less than 0.04 degrees from the arc.
constexpr double kLargestTurn = 0.9659;
constexpr double kShortest = 1e-4;  // s; a step between closer keys is no rotation
constexpr float kStillSeconds = 1;  // period of an animation without motion
// A straight path leaves a cubic one by t (1 - t) (a + b t), for a part t of the way. If that is at most 1 at
// t = 1/4, 1/2 and 3/4, it is below 1.1 everywhere.
constexpr double kSampled = 0.9;
// Distances of skins that share joints, in metres and as the distance of two quaternions.
constexpr double kSamePlace = 1e-3, kSameTurn = 1e-3;

std::optional<Similarity> similarityOf(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const double determinant = linear.determinant();
  if (!(determinant > 0) || !std::isfinite(determinant)) return std::nullopt;
  const double scale = std::cbrt(determinant);
  const Eigen::Matrix3d turn = linear / scale;
  if (!((turn.transpose() * turn - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kSimilar))
    return std::nullopt;
  return Similarity{matrix.topRightCorner<3, 1>(), Eigen::Quaterniond(turn).normalized(), scale};
}

bool hasNoRotation(const tinygltf::Node& node) {
  return node.matrix.size() != 16 && node.rotation.size() == 4 &&
         !(Eigen::Map<const Eigen::Vector4d>(node.rotation.data()).norm() > kSimilar);
}

// Nothing if the node is mirrored, or scaled differently along its axes. It must have a rotation.
std::optional<Similarity> poseOf(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) return similarityOf(Eigen::Map<const Eigen::Matrix4d>(node.matrix.data()));
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  if (node.translation.size() == 3)
    transform.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
  if (node.rotation.size() == 4) {
    const Eigen::Quaterniond q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
    transform.rotate(q.normalized());
  }
  if (node.scale.size() == 3) transform.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
  return similarityOf(transform.matrix());
}

model::Pose rigid(const Similarity& pose) {
  return {pose.translation.cast<float>(), pose.rotation.cast<float>()};
}

// False if the orientation is no rotation, as where a cubic path passes through 0.
bool isFinite(const model::Pose& pose) {
  return pose.position.allFinite() && std::abs(pose.orientation.norm() - 1) < 0.01f;
}

// Distance of two rotations as quaternions: half the angle between them, if it is small.
double turnBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return std::min((a.coeffs() - b.coeffs()).norm(), (a.coeffs() + b.coeffs()).norm());
}

// `skin` is one of the model.
std::string nameOf(const tinygltf::Model& model, const tinygltf::Skin& skin) {
  return namedPart("skin", skin.name, static_cast<std::size_t>(&skin - model.skins.data()));
}

class SkeletonReader {
 public:
  SkeletonReader(const tinygltf::Model& model, std::vector<const tinygltf::Skin*> skins,
                 const JointRequest& request)
      : model_(model), skins_(std::move(skins)), request_(request) {}

  Expected<GltfSkeleton> read() {
    for (const auto step :
         {&SkeletonReader::listJoints, &SkeletonReader::findNodes, &SkeletonReader::readPoses,
          &SkeletonReader::orderJoints, &SkeletonReader::bind, &SkeletonReader::animate})
      if (auto done = (this->*step)(); !done) return tl::unexpected(std::move(done.error()));
    return std::move(result_);
  }

 private:
  using Done = Expected<void>;

  // An error of one skin of several.
  tl::unexpected<std::string> refuse(const tinygltf::Skin& skin, const std::string& text) const {
    return tl::unexpected(skins_.size() == 1 ? std::string(text)
                                             : fmt::format("{}: {}", nameOf(model_, skin), text));
  }

  // Lists each joint once, in the order of the skins.
  Done listJoints() {
    std::unordered_set<int> listed;
    for (const tinygltf::Skin* skin : skins_) {
      if (skin->joints.empty() || skin->joints.size() > request_.joints)
        return refuse(*skin,
                      fmt::format("has {} joints; must have 1 to {}", skin->joints.size(), request_.joints));
      std::unordered_set<int> own;
      for (const int joint : skin->joints) {
        if (!own.insert(joint).second)
          return refuse(*skin, fmt::format("has node {} twice as a joint", joint));
        if (listed.insert(joint).second) joints_.push_back(joint);
      }
    }
    if (joints_.size() > request_.joints)
      return tl::unexpected(
          fmt::format("have {} joints in all; must have at most {}: remove joints that move no "
                      "vertex",
                      joints_.size(), request_.joints));
    return {};
  }

  // Lists the joints and the nodes above them, parents first.
  Done findNodes() {
    std::vector<int> parents(model_.nodes.size(), kNoParent);
    for (std::size_t i = 0; i < model_.nodes.size(); ++i)
      for (const int child : model_.nodes[i].children) {
        if (!elementAt(model_.nodes, child))
          return tl::unexpected(fmt::format("node {} does not exist", child));
        int& parent = parents[static_cast<std::size_t>(child)];
        if (parent != kNoParent) return tl::unexpected(fmt::format("node {} has two parents", child));
        parent = static_cast<int>(i);
      }
    for (const int joint : joints_) {
      if (!elementAt(model_.nodes, joint))
        return tl::unexpected(fmt::format("node {} does not exist", joint));
      std::vector<int> branch;
      for (int node = joint; node != kNoParent && !places_.contains(node);
           node = parents[static_cast<std::size_t>(node)]) {
        branch.push_back(node);
        if (branch.size() + nodes_.size() > kMaxNodes)
          return tl::unexpected(fmt::format("has more than {} nodes above its joints", kMaxNodes));
        if (std::ranges::count(branch, node) > 1)
          return tl::unexpected(fmt::format("node {} is its own ancestor", node));
      }
      for (; !branch.empty(); branch.pop_back()) {
        const int node = branch.back(), parent = parents[static_cast<std::size_t>(node)];
        places_.emplace(node, nodes_.size());
        nodes_.push_back(node);
        parents_.push_back(parent == kNoParent ? std::nullopt : std::optional(places_.at(parent)));
      }
    }
    return {};
  }

  Done readPoses() {
    for (const int node : nodes_) {
      const tinygltf::Node& from = model_.nodes[static_cast<std::size_t>(node)];
      if (hasNoRotation(from))
        return tl::unexpected(
            fmt::format("node {} has a rotation of length 0: export it as a quaternion of length 1", node));
      const std::optional<Similarity> pose = poseOf(from);
      if (!pose)
        return tl::unexpected(
            fmt::format("node {} is mirrored, or scaled differently along its axes: apply its scale", node));
      poses_.push_back(*pose);
    }
    return {};
  }

  // Numbers the joints in the order of the file, but parents before children.
  Done orderJoints() {
    constexpr std::size_t kNone = ~std::size_t{0};
    std::vector<std::size_t> number(nodes_.size(), kNone);
    std::vector<bool> isJoint(nodes_.size(), false);
    for (const int joint : joints_) isJoint[places_.at(joint)] = true;
    const auto parentOf = [&](std::size_t place) {
      std::optional<std::size_t> above = parents_[place];
      while (above && !isJoint[*above]) above = parents_[*above];
      return above;
    };
    while (jointPlaces_.size() < joints_.size())
      for (const int joint : joints_) {
        const std::size_t place = places_.at(joint);
        const std::optional<std::size_t> parent = parentOf(place);
        if (number[place] != kNone || (parent && number[*parent] == kNone)) continue;
        number[place] = jointPlaces_.size();
        jointPlaces_.push_back(place);
        model::Joint& to = result_.skin.joints.emplace_back();
        to.name = model_.nodes[static_cast<std::size_t>(joint)].name;
        if (parent) to.parent = static_cast<std::uint32_t>(number[*parent]);
      }
    for (const tinygltf::Skin* skin : skins_) {
      SkinBinding& binding = result_.bindings.emplace_back();
      for (const int joint : skin->joints)
        binding.numberOf.push_back(static_cast<std::uint8_t>(number[places_.at(joint)]));
    }
    return {};
  }

  // Poses at which a skin binds its joints to its vertices, which are scaled by `scale`.
  struct Bound {
    std::vector<Similarity> rests;
    double scale = 1;
  };

  // A joint with the matrix G moves the point v to G N v, where N is its inverse bind matrix. With the scales
  // g and n, the point a v with a = g n moves rigidly: from the pose that has the rotation of the inverse of
  // N and a times its translation, to the rotation and translation of G.
  Expected<Bound> boundOf(const tinygltf::Skin& skin, const SkinBinding& binding,
                          const std::vector<Similarity>& globals) const {
    std::vector<float> matrices;
    if (skin.inverseBindMatrices >= 0) {
      auto read = readFloats(model_, skin.inverseBindMatrices, TINYGLTF_TYPE_MAT4, request_.joints,
                             "inverse bind matrices");
      if (!read) return refuse(skin, read.error());
      matrices = std::move(*read);
      if (matrices.size() < 16 * skin.joints.size())
        return refuse(skin, fmt::format("has {} inverse bind matrices for {} joints", matrices.size() / 16,
                                        skin.joints.size()));
    }
    Bound bound;
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
      Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
      if (!matrices.empty()) matrix = Eigen::Map<const Eigen::Matrix4f>(&matrices[16 * i]).cast<double>();
      const std::optional<Similarity> back = similarityOf(matrix);
      if (!back)
        return refuse(skin,
                      fmt::format("inverse bind matrix {} mirrors, or scales differently along the axes", i));
      const double scale = globals[jointPlaces_[binding.numberOf[i]]].scale * back->scale;
      if (i == 0) bound.scale = scale;
      if (!(std::abs(scale - bound.scale) < kSimilar * bound.scale))
        return refuse(skin, fmt::format("joint {} has another scale than joint 0: apply the scale", i));
      Similarity& rest = bound.rests.emplace_back(back->inverse());
      rest.translation *= bound.scale;
      rest.scale = 1;
    }
    return bound;
  }

  // Sets the poses at which the joints rest, and where the vertices of the skins are then. Meshes of one file
  // may be bound in different frames. The first joint that a skin shares with those before it decides how its
  // vertices move to their frame, and all other shared joints must agree.
  Done bind() {
    const std::vector<Similarity> globals = globalsOf(poses_);
    std::vector<Similarity> rests(jointPlaces_.size());
    std::vector<const tinygltf::Skin*> boundBy(jointPlaces_.size(), nullptr);
    for (std::size_t s = 0; s < skins_.size(); ++s) {
      const tinygltf::Skin& skin = *skins_[s];
      SkinBinding& binding = result_.bindings[s];
      const Expected<Bound> bound = boundOf(skin, binding, globals);
      if (!bound) return tl::unexpected(bound.error());
      Similarity move;
      const auto shared =
          std::ranges::find_if(binding.numberOf, [&](std::uint8_t number) { return boundBy[number]; });
      if (shared != binding.numberOf.end())
        move = rests[*shared] *
               bound->rests[static_cast<std::size_t>(shared - binding.numberOf.begin())].inverse();
      for (std::size_t i = 0; i < skin.joints.size(); ++i) {
        const std::size_t number = binding.numberOf[i];
        const Similarity rest = move * bound->rests[i];
        if (boundBy[number] && !((rest.translation - rests[number].translation).norm() < kSamePlace &&
                                 turnBetween(rest.rotation, rests[number].rotation) < kSameTurn))
          return refuse(skin,
                        fmt::format("binds joint {} at another place than {}: join their meshes, or export "
                                    "both in the same pose",
                                    i, nameOf(model_, *boundBy[number])));
        if (boundBy[number]) continue;
        rests[number] = shared == binding.numberOf.end() ? bound->rests[i] : rest;
        boundBy[number] = &skin;
      }
      binding.vertices =
          Eigen::Translation3d(move.translation) * move.rotation * Eigen::Scaling(bound->scale);
    }
    for (std::size_t i = 0; i < rests.size(); ++i) {
      result_.skin.joints[i].rest = rigid(local(rests, i));
      if (!isFinite(result_.skin.joints[i].rest))
        return tl::unexpected(fmt::format("inverse bind matrix {} is too large", i));
    }
    return {};
  }

  Done animate() {
    if (!request_.animated) return {};
    std::vector<GltfChannel> channels;
    const tinygltf::Animation* animation = nullptr;
    if (!request_.animation.empty()) {
      const auto found = std::ranges::find(model_.animations, request_.animation, &tinygltf::Animation::name);
      if (found == model_.animations.end())
        return tl::unexpected(
            fmt::format("has no animation \"{}\"; must be one of {}", request_.animation, animationNames()));
      animation = &*found;
    } else if (!model_.animations.empty()) {
      animation = &model_.animations.front();
    }
    if (animation) {
      auto read = readChannels(model_, *animation, nodes_, poses_, request_.keys);
      if (!read) return tl::unexpected(std::move(read.error()));
      channels = std::move(*read);
    }
    return sample(channels);
  }

  std::string animationNames() const {
    constexpr std::size_t kMost = 20;
    std::string names;
    for (std::size_t i = 0; i < std::min(kMost, model_.animations.size()); ++i)
      names += (names.empty() ? "" : ", ") + model_.animations[i].name.substr(0, 64);
    return names.empty() ? "none, because the file has no animations" : names;
  }

  // Times of all channels. A step gets a key just before it.
  static std::vector<float> timesOf(const std::vector<GltfChannel>& channels) {
    std::vector<float> times;
    for (const GltfChannel& channel : channels)
      for (std::size_t i = 0; i < channel.times.size(); ++i) {
        if (channel.curve == GltfChannel::Curve::steps && i > 0)
          times.push_back(std::nextafter(channel.times[i], 0.0f));
        times.push_back(channel.times[i]);
      }
    std::ranges::sort(times);
    const auto repeated = std::ranges::unique(times);
    times.erase(repeated.begin(), repeated.end());
    return times;
  }

  Done sample(const std::vector<GltfChannel>& channels) {
    std::vector<float> times = timesOf(channels);
    std::vector<model::JointKey>& keys = result_.skin.keys;
    if (times.size() < 2) {
      // Nothing moves, but the nodes may have other poses than the bound ones.
      keys = {keyAt(channels, times.empty() ? 0 : times[0]), {}};
      keys[0].time = 0;
      keys[1] = {kStillSeconds, keys[0].joints};
    } else {
      const bool isCurved = std::ranges::any_of(
          channels, [](const GltfChannel& channel) { return channel.curve == GltfChannel::Curve::cubic; });
      for (std::size_t i = 0; i < times.size(); ++i) {
        model::JointKey key = keyAt(channels, times[i]);
        if (i > 0 && isCurved)
          addCurve(channels, times[0], keyAt(channels, times[i - 1]),
                   keyAt(channels, middleOf(times[i - 1], times[i])), key);
        else if (i > 0)
          addBetween(channels, times[i - 1], key);
        key.time = times[i] - times[0];
        keys.push_back(std::move(key));
        if (hasTooManyKeys())
          return tl::unexpected(
              fmt::format("has an animation of more than {} keys, or of more than {} poses of joints: export "
                          "it with fewer keys",
                          request_.keys, request_.poses));
      }
    }
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (i > 0 && !(keys[i].time > keys[i - 1].time))
        return tl::unexpected(
            std::string("has keys that are too close to each other: begin the animation at 0 s"));
      if (!std::ranges::all_of(keys[i].joints, isFinite))
        return tl::unexpected(std::string("has poses of joints that are not finite"));
    }
    return {};
  }

  bool hasTooManyKeys() const {
    const std::size_t keys = result_.skin.keys.size();
    return keys > request_.keys || keys * jointPlaces_.size() > request_.poses;
  }

  static float middleOf(float a, float b) { return static_cast<float>((double{a} + double{b}) / 2); }

  // Whether joints that move in a straight line between two keys are close enough to `real` at its time.
  static bool isNear(const model::JointKey& from, const model::JointKey& to, const model::JointKey& real) {
    const double part = (double{real.time} - from.time) / (double{to.time} - from.time);
    const double mostTurn = kSampled * kCurveDegrees * (std::acos(-1.0) / 180) / 2;
    for (std::size_t i = 0; i < real.joints.size(); ++i) {
      const model::Pose straight = model::between(from.joints[i], to.joints[i], part);
      const double away = double{(straight.position - real.joints[i].position).norm()};
      const double turn =
          turnBetween(straight.orientation.cast<double>(), real.joints[i].orientation.cast<double>());
      if (!(away <= kSampled * kCurveMetres && turn <= mostTurn)) return false;
    }
    return true;
  }

  // Adds keys between two, which have times of the file, until the path is followed. `first` is the time of
  // the first key.
  void addCurve(const std::vector<GltfChannel>& channels, float first, const model::JointKey& from,
                const model::JointKey& middle, const model::JointKey& to) {
    const bool isShort =
        double{to.time} - from.time < kShortest || !(from.time < middle.time && middle.time < to.time);
    if (isShort || hasTooManyKeys()) return;
    const model::JointKey before = keyAt(channels, middleOf(from.time, middle.time)),
                          after = keyAt(channels, middleOf(middle.time, to.time));
    if (isNear(from, to, before) && isNear(from, to, middle) && isNear(from, to, after)) return;
    addCurve(channels, first, from, before, middle);
    result_.skin.keys.push_back({middle.time - first, middle.joints});
    addCurve(channels, first, middle, after, to);
  }

  // Adds keys between the newest one, at the time `from` of the file, and `to`.
  void addBetween(const std::vector<GltfChannel>& channels, float from, const model::JointKey& to) {
    const model::JointKey before = result_.skin.keys.back();
    double cosine = 1;
    for (std::size_t i = 0; i < to.joints.size(); ++i)
      cosine = std::min(cosine, std::abs(double{before.joints[i].orientation.dot(to.joints[i].orientation)}));
    const double seconds = double{to.time} - from;
    if (cosine >= kLargestTurn || seconds < kShortest) return;
    const int pieces = static_cast<int>(std::ceil(std::acos(cosine) / std::acos(kLargestTurn)));
    for (int i = 1; i < pieces; ++i) {
      model::JointKey key = keyAt(channels, from + seconds * i / pieces);
      key.time = static_cast<float>(before.time + seconds * i / pieces);
      result_.skin.keys.push_back(std::move(key));
    }
  }

  // Its time is that of the file.
  model::JointKey keyAt(const std::vector<GltfChannel>& channels, double seconds) const {
    std::vector<Similarity> poses = poses_;
    for (const GltfChannel& channel : channels) channel.apply(seconds, poses[channel.node]);
    const std::vector<Similarity> globals = globalsOf(poses);
    std::vector<Similarity> joints;
    for (const std::size_t place : jointPlaces_) joints.push_back(globals[place]);
    model::JointKey key{static_cast<float>(seconds), {}};
    for (std::size_t i = 0; i < joints.size(); ++i) {
      joints[i].scale = 1;
      key.joints.push_back(rigid(local(joints, i)));
    }
    return key;
  }

  // `poses` are in the frame of the file, and joints before this one have no scale.
  Similarity local(const std::vector<Similarity>& poses, std::size_t joint) const {
    const std::optional<std::uint32_t> parent = result_.skin.joints[joint].parent;
    return parent ? poses[*parent].inverse() * poses[joint] : poses[joint];
  }

  std::vector<Similarity> globalsOf(const std::vector<Similarity>& poses) const {
    std::vector<Similarity> globals;
    for (std::size_t i = 0; i < poses.size(); ++i)
      globals.push_back(parents_[i] ? globals[*parents_[i]] * poses[i] : poses[i]);
    return globals;
  }

  const tinygltf::Model& model_;
  std::vector<const tinygltf::Skin*> skins_;
  const JointRequest& request_;
  std::vector<int> joints_;  // nodes, each once
  // Nodes, parents first; the place of each in this list, of its parent, and its pose relative to that.
  std::vector<int> nodes_;
  std::unordered_map<int, std::size_t> places_;
  std::vector<std::optional<std::size_t>> parents_;
  std::vector<Similarity> poses_;
  std::vector<std::size_t> jointPlaces_;  // of the joints, in the order of the result
  GltfSkeleton result_;
};

}  // namespace

Expected<GltfSkeleton> readSkeleton(const tinygltf::Model& model, std::span<const int> skins,
                                    const JointRequest& request) {
  std::vector<const tinygltf::Skin*> found;
  for (const int skin : skins) {
    found.push_back(elementAt(model.skins, skin));
    if (!found.back()) return tl::unexpected(fmt::format("skin {} does not exist", skin));
  }
  const std::string who =
      found.size() == 1 ? nameOf(model, *found[0]) : fmt::format("its {} skins", found.size());
  return SkeletonReader(model, std::move(found), request).read().map_error([&](const std::string& text) {
    return fmt::format("{}: {}", who, text);
  });
}

}  // namespace clothstream::meshes

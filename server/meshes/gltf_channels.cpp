// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_channels.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "proto/text/excerpt.h"
#include "server/meshes/gltf_accessor.h"
#include "server/meshes/gltf_name.h"
#include "server/meshes/gltf_primitive.h"

namespace clothstream::meshes {
namespace {

template <typename T>
using Expected = tl::expected<T, std::string>;

// Deviation of a scale from that of its node that counts as no change, relative.
constexpr double kSameScale = 1e-3;

Expected<std::vector<float>> readTimes(const tinygltf::Model& model, int accessor, std::size_t most) {
  auto times = readFloats(model, accessor, TINYGLTF_TYPE_SCALAR, most, "keys");
  if (!times) return times;
  if (times->front() < 0) return tl::unexpected(std::string("has a key before 0 s"));
  for (std::size_t i = 1; i < times->size(); ++i)
    if ((*times)[i] <= (*times)[i - 1])
      return tl::unexpected(fmt::format("has times of keys that do not increase, at key {}", i));
  return times;
}

using Curve = GltfChannel::Curve;

// Elements of a sampler's output for each key: with a cubic curve slopes before and after the value.
std::size_t elementsOfKey(Curve curve) {
  return curve == Curve::cubic ? 3 : 1;
}
std::size_t componentsOf(GltfChannel::Path path) {
  return path == GltfChannel::Path::rotation ? 4 : 3;
}

Expected<Curve> curveOf(const std::string& interpolation) {
  if (interpolation == "LINEAR") return Curve::lines;
  if (interpolation == "STEP") return Curve::steps;
  if (interpolation == "CUBICSPLINE") return Curve::cubic;
  return tl::unexpected(fmt::format(
      "has the interpolation \"{}\", which glTF does not have: export it with LINEAR, STEP or CUBICSPLINE",
      excerpt(interpolation, 20)));
}

// `step` is the distance of two quaternions, and the first one is at `first`.
bool areUnit(const std::vector<float>& quaternions, std::size_t first, std::size_t step) {
  for (std::size_t i = first; i < quaternions.size(); i += step) {
    const Eigen::Map<const Eigen::Vector4f> q(&quaternions[i]);
    if (std::abs(q.norm() - 1) > 0.01f) return false;
  }
  return true;
}

// A scale along each axis at each key must be that of the node. A cubic curve stays there if no slope moves
// it by more in a second.
Expected<void> checkScale(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                          double scale, std::size_t keys) {
  const Expected<Curve> curve = curveOf(sampler.interpolation);
  if (!curve) return tl::unexpected(curve.error());
  const std::size_t elements = elementsOfKey(*curve);
  const auto values = readFloats(model, sampler.output, TINYGLTF_TYPE_VEC3, elements * keys, "scales");
  if (!values) return tl::unexpected(values.error());
  for (std::size_t i = 0; i < values->size(); ++i) {
    const bool isSlope = *curve == Curve::cubic && i / 3 % elements != 1;
    if (std::abs(double{(*values)[i]} - (isSlope ? 0 : scale)) > kSameScale * scale)
      return tl::unexpected(std::string(
          "changes the scale, which is not supported: remove these keys, or move joints instead of scaling "
          "them"));
  }
  return {};
}

Expected<GltfChannel> readChannel(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                                  GltfChannel::Path path, std::size_t node, std::size_t keys) {
  const Expected<Curve> curve = curveOf(sampler.interpolation);
  if (!curve) return tl::unexpected(curve.error());
  const std::size_t elements = elementsOfKey(*curve), components = componentsOf(path);
  const bool turns = path == GltfChannel::Path::rotation;
  auto times = readTimes(model, sampler.input, keys);
  if (!times) return tl::unexpected(std::move(times.error()));
  auto values = readFloats(model, sampler.output, turns ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3,
                           elements * keys, "values");
  if (!values) return tl::unexpected(std::move(values.error()));
  const std::size_t count = values->size() / components;
  if (count != elements * times->size())
    return tl::unexpected(fmt::format("has {} values for {} keys{}", count, times->size(),
                                      elements == 1 ? "" : "; a key of CUBICSPLINE has three"));
  if (turns && !areUnit(*values, elements == 1 ? 0 : components, elements * components))
    return tl::unexpected(std::string("has rotations that are not quaternions of length 1"));
  return GltfChannel{
      .node = node, .path = path, .curve = *curve, .times = std::move(*times), .values = std::move(*values)};
}

}  // namespace

void GltfChannel::apply(double seconds, Similarity& pose) const {
  const auto after = static_cast<std::size_t>(std::ranges::upper_bound(times, seconds) - times.begin());
  const std::size_t from = after == 0 ? 0 : after - 1,
                    to = std::min(from + (after == 0 ? 0 : 1), times.size() - 1);
  const double length = double{times[to]} - times[from];
  const double part = curve == Curve::steps || length <= 0 ? 0 : (seconds - times[from]) / length;
  if (curve == Curve::cubic) {
    const Eigen::Vector4d value = onCubic(from, to, part, length);
    if (path == Path::translation)
      pose.translation = value.head<3>();
    else
      pose.rotation = Eigen::Quaterniond(value).normalized();
  } else if (path == Path::translation) {
    const auto at = [&](std::size_t key) {
      return Eigen::Vector3d(values[3 * key], values[3 * key + 1], values[3 * key + 2]);
    };
    pose.translation = at(from) + part * (at(to) - at(from));
  } else {
    const auto at = [&](std::size_t key) {
      const float* q = &values[4 * key];
      return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
    };
    pose.rotation = at(from).slerp(part, at(to)).normalized();
  }
}

// glTF 2.0, appendix C.5. A translation has 0 as its fourth number.
Eigen::Vector4d GltfChannel::onCubic(std::size_t from, std::size_t to, double part, double length) const {
  const std::size_t components = componentsOf(path);
  const auto at = [&](std::size_t key, std::size_t element) {
    Eigen::Vector4d four = Eigen::Vector4d::Zero();
    for (std::size_t c = 0; c < components; ++c)
      four[static_cast<Eigen::Index>(c)] = values[components * (elementsOfKey(curve) * key + element) + c];
    return four;
  };
  const double t = part, t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * at(from, 1) + length * (t3 - 2 * t2 + t) * at(from, 2) +
         (3 * t2 - 2 * t3) * at(to, 1) + length * (t3 - t2) * at(to, 0);
}

Expected<std::vector<GltfChannel>> readChannels(const tinygltf::Model& model,
                                                const tinygltf::Animation& animation,
                                                const std::vector<int>& nodes,
                                                const std::vector<Similarity>& poses, std::size_t keys) {
  const std::string who =
      namedPart("animation", animation.name, static_cast<std::size_t>(&animation - model.animations.data()));
  std::vector<GltfChannel> channels;
  std::set<std::pair<std::size_t, std::string>> known;
  std::unordered_map<int, std::size_t> placeOf;
  for (std::size_t i = 0; i < nodes.size(); ++i) placeOf.emplace(nodes[i], i);
  for (std::size_t i = 0; i < animation.channels.size(); ++i) {
    const tinygltf::AnimationChannel& channel = animation.channels[i];
    const auto found = placeOf.find(channel.target_node);
    if (found == placeOf.end()) continue;
    const std::size_t node = found->second;
    const auto refuse = [&](const std::string& text) {
      return tl::unexpected(fmt::format("{}, channel {} {}", who, i, text));
    };
    const tinygltf::AnimationSampler* sampler = elementAt(animation.samplers, channel.sampler);
    if (!sampler) return refuse(fmt::format("has the sampler {}, which does not exist", channel.sampler));
    if (!known.emplace(node, channel.target_path).second)
      return refuse(fmt::format("is the second one for the {} of node {}", excerpt(channel.target_path, 20),
                                channel.target_node));
    if (channel.target_path == "scale") {
      if (auto done = checkScale(model, *sampler, poses[node].scale, keys); !done)
        return refuse(done.error());
      continue;
    }
    if (channel.target_path != "translation" && channel.target_path != "rotation")
      return refuse(fmt::format("changes \"{}\", which is not supported: remove these keys",
                                excerpt(channel.target_path, 20)));
    auto read = readChannel(
        model, *sampler,
        channel.target_path == "rotation" ? GltfChannel::Path::rotation : GltfChannel::Path::translation,
        node, keys);
    if (!read) return refuse(read.error());
    channels.push_back(std::move(*read));
  }
  return channels;
}

}  // namespace clothstream::meshes

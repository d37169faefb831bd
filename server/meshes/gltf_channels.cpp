// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_channels.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/gltf_accessor.h"
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

bool areUnit(const std::vector<float>& quaternions) {
  for (std::size_t i = 0; i < quaternions.size(); i += 4) {
    const Eigen::Map<const Eigen::Vector4f> q(&quaternions[i]);
    if (std::abs(q.norm() - 1) > 0.01f) return false;
  }
  return true;
}

// A scale along each axis at each key must be that of the node.
Expected<void> checkScale(const tinygltf::Model& model, int accessor, double scale, std::size_t keys) {
  const auto values = readFloats(model, accessor, TINYGLTF_TYPE_VEC3, keys, "scales");
  if (!values) return tl::unexpected(values.error());
  for (const float value : *values)
    if (std::abs(double{value} - scale) > kSameScale * scale)
      return tl::unexpected(std::string("changes the scale, which is not supported: remove these keys"));
  return {};
}

Expected<GltfChannel> readChannel(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                                  GltfChannel::Path path, std::size_t node, std::size_t keys) {
  if (sampler.interpolation != "LINEAR" && sampler.interpolation != "STEP")
    return tl::unexpected(
        fmt::format("has the interpolation {}, which is not supported: export it with linear interpolation "
                    "(Blender: Always Sample Animations)",
                    sampler.interpolation.substr(0, 20)));
  const bool turns = path == GltfChannel::Path::rotation;
  auto times = readTimes(model, sampler.input, keys);
  if (!times) return tl::unexpected(std::move(times.error()));
  auto values =
      readFloats(model, sampler.output, turns ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3, keys, "values");
  if (!values) return tl::unexpected(std::move(values.error()));
  const std::size_t count = values->size() / (turns ? 4 : 3);
  if (count != times->size())
    return tl::unexpected(fmt::format("has {} values for {} keys", count, times->size()));
  if (turns && !areUnit(*values))
    return tl::unexpected(std::string("has rotations that are not quaternions of length 1"));
  return GltfChannel{.node = node,
                     .path = path,
                     .inSteps = sampler.interpolation == "STEP",
                     .times = std::move(*times),
                     .values = std::move(*values)};
}

}  // namespace

void GltfChannel::apply(double seconds, Similarity& pose) const {
  const auto after = static_cast<std::size_t>(std::ranges::upper_bound(times, seconds) - times.begin());
  const std::size_t from = after == 0 ? 0 : after - 1,
                    to = std::min(from + (after == 0 ? 0 : 1), times.size() - 1);
  const double length = double{times[to]} - times[from];
  const double part = inSteps || length <= 0 ? 0 : (seconds - times[from]) / length;
  if (path == Path::translation) {
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

Expected<std::vector<GltfChannel>> readChannels(const tinygltf::Model& model,
                                                const tinygltf::Animation& animation,
                                                const std::vector<int>& nodes,
                                                const std::vector<Similarity>& poses, std::size_t keys) {
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
      return tl::unexpected(fmt::format("animation \"{}\", channel {} {}", animation.name, i, text));
    };
    const tinygltf::AnimationSampler* sampler = elementAt(animation.samplers, channel.sampler);
    if (!sampler) return refuse(fmt::format("has the sampler {}, which does not exist", channel.sampler));
    if (!known.emplace(node, channel.target_path).second)
      return refuse(fmt::format("is the second one for the {} of node {}", channel.target_path.substr(0, 20),
                                channel.target_node));
    if (channel.target_path == "scale") {
      if (auto done = checkScale(model, sampler->output, poses[node].scale, keys); !done)
        return refuse(done.error());
      continue;
    }
    if (channel.target_path != "translation" && channel.target_path != "rotation")
      return refuse(fmt::format("changes \"{}\", which is not supported: remove these keys",
                                channel.target_path.substr(0, 20)));
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

// SPDX-License-Identifier: MIT
#include "clients/cli/gltf_animation.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <sstream>
#include <utility>

#include <nlohmann/json.hpp>

namespace clothstream::cli {
namespace {

// Longest GLB, and longest input of tinygltf's base64 encoder.
constexpr std::size_t kMaxBytes = std::numeric_limits<std::uint32_t>::max();

// Replaces invalid UTF-8, which tinygltf cannot write.
std::string validUtf8(const std::string& text) {
  using nlohmann::json;
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
}

}  // namespace

int GltfAnimation::addAccessor(std::span<const std::byte> bytes, int componentType, int type) {
  std::vector<unsigned char>& data = model_.buffers[0].data;
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = data.size();
  view.byteLength = bytes.size();
  model_.bufferViews.push_back(view);
  const auto* const first = reinterpret_cast<const unsigned char*>(bytes.data());
  data.insert(data.end(), first, first + bytes.size());
  tinygltf::Accessor accessor;
  accessor.bufferView = static_cast<int>(model_.bufferViews.size() - 1);
  accessor.componentType = componentType;
  accessor.type = type;
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type));
  accessor.count = bytes.size() / sizeof(float) / static_cast<std::size_t>(components);
  model_.accessors.push_back(accessor);
  return static_cast<int>(model_.accessors.size() - 1);
}

int GltfAnimation::addFloats(std::span<const float> values, int type) {
  return addAccessor(std::as_bytes(values), TINYGLTF_COMPONENT_TYPE_FLOAT, type);
}

int GltfAnimation::addBoundedFloats(std::span<const float> values, int type) {
  const int index = addFloats(values, type);
  tinygltf::Accessor& accessor = model_.accessors.back();
  const std::size_t components = values.size() / accessor.count;
  accessor.minValues.assign(components, std::numeric_limits<float>::max());
  accessor.maxValues.assign(components, std::numeric_limits<float>::lowest());
  for (std::size_t i = 0; i < values.size(); ++i) {
    double &least = accessor.minValues[i % components], &most = accessor.maxValues[i % components];
    least = std::min<double>(least, values[i]);
    most = std::max<double>(most, values[i]);
  }
  return index;
}

// Gives the corners of a cloth vertices that have their texture coordinates.
void GltfAnimation::divideVertices(const cs_client* client, std::uint32_t index, const cs_cloth& cloth) {
  constexpr std::uint32_t kNone = ~0u;
  const std::span<std::uint32_t> corners = std::span(indices_).subspan(cloth.first_index, cloth.index_count);
  std::uint32_t count = 0;
  const float* uvs = cs_uvs(client, index, &count);
  const std::uint32_t* uvIndices = cs_uv_indices(client, index, &count);
  std::vector<std::uint32_t> firstUvs(cloth.vertex_count, kNone);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> further;  // by vertex and coordinate
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t vertex = corners[i], uv = uvIndices[i];
    std::uint32_t& firstUv = firstUvs[vertex - cloth.first_vertex];
    if (firstUv == kNone) firstUv = uv;
    if (firstUv != uv) {
      const auto [found, isNew] =
          further.emplace(std::pair(vertex, uv), static_cast<std::uint32_t>(sources_.size()));
      if (isNew) {
        sources_.push_back(vertex);
        uvs_.resize(2 * sources_.size());
      }
      corners[i] = found->second;
    }
    uvs_[2 * std::size_t{corners[i]}] = uvs[2 * uv];
    uvs_[2 * std::size_t{corners[i]} + 1] = 1 - uvs[2 * uv + 1];
  }
}

void GltfAnimation::takeShape(const cs_client* client) {
  parts_ = partsOf(client);
  std::uint32_t count = 0;
  const std::uint32_t* indices = cs_triangles(client, &count);
  indices_.assign(indices, indices + count);
  sources_.resize(cs_vertex_count(client));
  std::iota(sources_.begin(), sources_.end(), 0u);
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i) {
    hasUvs_.push_back(cs_uvs(client, i, &count) != nullptr);
    if (hasUvs_.back() == 0) continue;
    uvs_.resize(2 * sources_.size());
    divideVertices(client, i, cloth);
  }
}

std::vector<float> GltfAnimation::gathered(const float* vectors) const {
  std::vector<float> values;
  values.reserve(3 * sources_.size());
  for (const std::uint32_t source : sources_)
    values.insert(values.end(), vectors + 3 * std::size_t{source}, vectors + 3 * std::size_t{source} + 3);
  return values;
}

void GltfAnimation::add(const cs_client* client, double seconds) {
  if (seconds_.empty()) takeShape(client);
  std::vector<float> positions = gathered(cs_positions(client)), normals = gathered(cs_normals(client));
  if (seconds_.empty()) {
    model_.buffers.resize(1);
    positions_ = positions;
    normals_ = normals;
  } else {
    // A morph target holds the difference from the first frame.
    std::ranges::transform(positions, positions_, positions.begin(), std::minus<>());
    std::ranges::transform(normals, normals_, normals.begin(), std::minus<>());
  }
  const int position = addBoundedFloats(positions, TINYGLTF_TYPE_VEC3);
  attributes_.push_back({{"POSITION", position}, {"NORMAL", addFloats(normals, TINYGLTF_TYPE_VEC3)}});
  seconds_.push_back(static_cast<float>(seconds));
}

// At its time, the weight of a frame is 1 and all others are 0. Between two times the weights are
// interpolated.
void GltfAnimation::addAnimation(tinygltf::Mesh& mesh) {
  const std::size_t targets = seconds_.size() - 1;
  mesh.weights.assign(targets, 0);
  std::vector<float> weights(seconds_.size() * targets, 0);
  for (std::size_t i = 1; i < seconds_.size(); ++i) weights[i * targets + i - 1] = 1;
  tinygltf::Animation animation;
  animation.samplers.resize(1);
  animation.samplers[0].input = addBoundedFloats(seconds_, TINYGLTF_TYPE_SCALAR);
  animation.samplers[0].output = addFloats(weights, TINYGLTF_TYPE_SCALAR);
  animation.channels.resize(1);
  animation.channels[0].sampler = 0;
  animation.channels[0].target_node = 0;
  animation.channels[0].target_path = "weights";
  model_.animations.push_back(animation);
}

// Parts of several cloths with one name have the same material.
int GltfAnimation::materialOf(const std::string& name) {
  const std::string written = validUtf8(name);
  const auto [found, isNew] = materials_.emplace(written, static_cast<int>(model_.materials.size()));
  if (isNew) {
    tinygltf::Material& material = model_.materials.emplace_back();
    material.name = written;
    material.doubleSided = true;
  }
  return found->second;
}

std::string GltfAnimation::finish(bool binary) {
  model_.asset.generator = "clothstream export";
  if (parts_.size() * seconds_.size() > kMaxGltfTargets) return {};
  Attributes withUvs = attributes_[0];
  if (!uvs_.empty()) {
    uvs_.resize(2 * sources_.size());
    withUvs["TEXCOORD_0"] = addFloats(uvs_, TINYGLTF_TYPE_VEC2);
  }
  tinygltf::Mesh mesh;
  for (const Part& part : parts_) {
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = materialOf(part.material);
    primitive.attributes = hasUvs_[part.cloth] != 0 ? withUvs : attributes_[0];
    primitive.targets.assign(attributes_.begin() + 1, attributes_.end());
    const auto indices = std::span(indices_).subspan(part.firstIndex, part.indexCount);
    primitive.indices =
        addAccessor(std::as_bytes(indices), TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR);
    primitive.extras = tinygltf::Value({{"cloth", tinygltf::Value(validUtf8(part.clothName))}});
    mesh.primitives.push_back(std::move(primitive));
  }
  if (frames() > 1) addAnimation(mesh);
  model_.meshes.push_back(std::move(mesh));
  model_.nodes.resize(1);
  model_.nodes[0].mesh = 0;
  model_.nodes[0].name = "cloth";
  model_.scenes.resize(1);
  model_.scenes[0].nodes = {0};
  model_.defaultScene = 0;
  if (model_.buffers[0].data.size() > kMaxBytes) return {};
  std::ostringstream out;
  if (!tinygltf::TinyGLTF().WriteGltfSceneToStream(&model_, out, false, binary)) return {};
  std::string content = std::move(out).str();
  if (binary && content.size() > kMaxBytes) content.clear();
  return content;
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
#include "clients/cli/gltf_animation.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string_view>

#include <nlohmann/json.hpp>

namespace clothstream::cli {
namespace {

using Json = nlohmann::ordered_json;

// As glTF names them.
constexpr int kFloat = 5126, kUnsignedInt = 5125;

class Buffer {
 public:
  // The number of a new accessor of these.
  std::size_t add(std::span<const float> values, const char* type, std::size_t count) {
    return add(values.data(), values.size_bytes(), kFloat, type, count);
  }
  std::size_t add(std::span<const std::uint32_t> values) {
    return add(values.data(), values.size_bytes(), kUnsignedInt, "SCALAR", values.size());
  }
  std::size_t addPositions(std::span<const float> values) {
    const std::size_t accessor = add(values, "VEC3", values.size() / 3);
    std::array<float, 3> least, most;
    least.fill(std::numeric_limits<float>::max());
    most.fill(std::numeric_limits<float>::lowest());
    for (std::size_t i = 0; i < values.size(); ++i) {
      least[i % 3] = std::min(least[i % 3], values[i]);
      most[i % 3] = std::max(most[i % 3], values[i]);
    }
    accessors[accessor]["min"] = least;
    accessors[accessor]["max"] = most;
    return accessor;
  }
  void bound(std::size_t accessor, float least, float most) {
    accessors[accessor]["min"] = {least};
    accessors[accessor]["max"] = {most};
  }

  Json views = Json::array(), accessors = Json::array();
  std::string bytes;

 private:
  std::size_t add(const void* data, std::size_t size, int component, const char* type, std::size_t count) {
    views.push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}});
    bytes.append(static_cast<const char*>(data), size);
    accessors.push_back(
        {{"bufferView", views.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}});
    return accessors.size() - 1;
  }
};

void appendNumber(std::string& out, std::size_t number) {
  const auto value = static_cast<std::uint32_t>(number);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

void appendChunk(std::string& out, std::string_view name, std::string content, char filler) {
  content.resize((content.size() + 3) / 4 * 4, filler);
  appendNumber(out, content.size());
  out += name;
  out += content;
}

}  // namespace

void GltfAnimation::add(const cs_client* client, double seconds) {
  const std::size_t numbers = 3 * std::size_t{cs_vertex_count(client)};
  const float* positions = cs_positions(client);
  const float* normals = cs_normals(client);
  if (seconds_.empty()) {
    numbers_ = numbers;
    std::uint32_t count = 0;
    const std::uint32_t* indices = cs_triangles(client, &count);
    indices_.assign(indices, indices + count);
    cs_cloth cloth;
    for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i)
      cloths_.push_back({cloth.name, cloth.first_index, cloth.index_count});
    positions_.assign(positions, positions + numbers);
    normals_.assign(normals, normals + numbers);
  } else {
    for (std::size_t i = 0; i < numbers_; ++i) {
      positions_.push_back(positions[i] - positions_[i]);
      normals_.push_back(normals[i] - normals_[i]);
    }
  }
  seconds_.push_back(static_cast<float>(seconds));
}

GltfAnimation::Document GltfAnimation::toDocument(bool embedded) const {
  Buffer buffer;
  const auto frame = [&](const std::vector<float>& values, std::size_t i) {
    return std::span(values).subspan(i * numbers_, numbers_);
  };
  const Json attributes{{"POSITION", buffer.addPositions(frame(positions_, 0))},
                        {"NORMAL", buffer.add(frame(normals_, 0), "VEC3", numbers_ / 3)}};
  Json targets = Json::array();
  for (std::size_t i = 1; i < seconds_.size(); ++i)
    targets.push_back({{"POSITION", buffer.addPositions(frame(positions_, i))},
                       {"NORMAL", buffer.add(frame(normals_, i), "VEC3", numbers_ / 3)}});
  Json primitives = Json::array();
  for (const Cloth& cloth : cloths_) {
    Json primitive{{"attributes", attributes},
                   {"indices", buffer.add(std::span(indices_).subspan(cloth.firstIndex, cloth.indexCount))},
                   {"material", 0},
                   {"extras", {{"cloth", cloth.name}}}};
    if (!targets.empty()) primitive["targets"] = targets;
    primitives.push_back(std::move(primitive));
  }
  Json gltf{{"asset", {{"version", "2.0"}, {"generator", "clothstream export"}}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {{{"mesh", 0}, {"name", "cloth"}}}},
            {"materials", {{{"doubleSided", true}}}},
            {"meshes", {{{"primitives", primitives}}}}};
  if (!targets.empty()) {
    // Each frame's own weight is 1 at its time, all others are 0; between two times they cross.
    gltf["meshes"][0]["weights"] = std::vector<float>(targets.size(), 0);
    std::vector<float> weights(seconds_.size() * targets.size(), 0);
    for (std::size_t i = 1; i < seconds_.size(); ++i) weights[i * targets.size() + i - 1] = 1;
    const std::size_t times = buffer.add(seconds_, "SCALAR", seconds_.size());
    buffer.bound(times, seconds_.front(), seconds_.back());
    const std::size_t output = buffer.add(weights, "SCALAR", weights.size());
    gltf["animations"] = {
        {{"samplers", {{{"input", times}, {"output", output}, {"interpolation", "LINEAR"}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}}};
  }
  gltf["bufferViews"] = std::move(buffer.views);
  gltf["accessors"] = std::move(buffer.accessors);
  gltf["buffers"] = {{{"byteLength", buffer.bytes.size()}}};
  if (embedded) gltf["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(buffer.bytes);
  return {gltf.dump(-1, ' ', false, Json::error_handler_t::replace), std::move(buffer.bytes)};
}

std::string GltfAnimation::toGltf() const {
  return toDocument(true).json;
}

std::string GltfAnimation::toGlb() const {
  Document document = toDocument(false);
  if (document.json.size() + document.numbers.size() > std::numeric_limits<std::uint32_t>::max() - 64)
    return {};
  std::string chunks;
  appendChunk(chunks, "JSON", std::move(document.json), ' ');
  appendChunk(chunks, std::string_view("BIN\0", 4), std::move(document.numbers), '\0');
  std::string out = "glTF";
  appendNumber(out, 2);
  appendNumber(out, 12 + chunks.size());
  return out + chunks;
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_primitive.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/draco_mesh.h"
#include "server/meshes/gltf_accessor.h"

namespace clothstream::meshes {
namespace {

using model::Uv;
using model::Vec3;
template <typename T>
using Expected = tl::expected<T, std::string>;

template <typename Vector>
Expected<std::vector<Vector>> readVectors(const GltfElements& elements, std::string_view what) {
  std::vector<Vector> values;
  values.reserve(elements.count);
  for (std::size_t i = 0; i < elements.count; ++i) {
    Vector& value = values.emplace_back();
    for (Eigen::Index c = 0; c < Vector::RowsAtCompileTime; ++c) {
      const auto number = component(elements, i, static_cast<std::size_t>(c));
      if (!number) return tl::unexpected(fmt::format("has {} of a type that glTF does not have", what));
      value[c] = *number;
    }
  }
  return values;
}

Expected<std::vector<std::uint32_t>> readIndices(const GltfElements& elements) {
  std::vector<std::uint32_t> indices;
  indices.reserve(elements.count);
  for (std::size_t i = 0; i < elements.count; ++i) {
    switch (elements.componentType) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        indices.push_back(elements.at<std::uint8_t>(i, 0));
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        indices.push_back(elements.at<std::uint16_t>(i, 0));
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        indices.push_back(elements.at<std::uint32_t>(i, 0));
        break;
      default:
        return tl::unexpected(std::string("has indices that are not unsigned integers"));
    }
  }
  return indices;
}

int modeOf(const tinygltf::Primitive& primitive) {
  return primitive.mode == -1 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
}

std::optional<std::string> checkMode(int mode) {
  switch (mode) {
    case TINYGLTF_MODE_TRIANGLES:
    case TINYGLTF_MODE_TRIANGLE_STRIP:
    case TINYGLTF_MODE_TRIANGLE_FAN:
      return std::nullopt;
    case TINYGLTF_MODE_POINTS:
      return "is made of points, which have no surface: remove them, or export triangles";
    case TINYGLTF_MODE_LINE:
    case TINYGLTF_MODE_LINE_LOOP:
    case TINYGLTF_MODE_LINE_STRIP:
      return "is made of lines, which have no surface: remove them, or export triangles";
    default:
      return fmt::format("has the mode {}, which glTF does not have: export it as triangles", mode);
  }
}

// Number of triangles of this number of indices.
std::size_t trianglesOf(int mode, std::size_t indices) {
  if (mode == TINYGLTF_MODE_TRIANGLES) return indices / 3;
  return indices < 3 ? 0 : indices - 2;
}

std::optional<std::string> checkCounts(int mode, std::size_t vertices, std::size_t indices,
                                       const PrimitiveLimits& limits) {
  if (mode == TINYGLTF_MODE_TRIANGLES && indices % 3 != 0)
    return fmt::format("has {} indices, which is not a multiple of three", indices);
  if (indices < 3) return fmt::format("has {} indices; a triangle has three", indices);
  if (vertices > limits.vertices)
    return fmt::format("has {} vertices; at most {} more are allowed: simplify it", vertices,
                       limits.vertices);
  if (trianglesOf(mode, indices) > limits.triangles)
    return fmt::format("has {} triangles; at most {} more are allowed: simplify it",
                       trianglesOf(mode, indices), limits.triangles);
  return std::nullopt;
}

// Indices of single triangles. Triangles of a strip that name a vertex twice only join its pieces, and are
// left out.
std::vector<std::uint32_t> separated(int mode, std::vector<std::uint32_t> indices) {
  if (mode == TINYGLTF_MODE_TRIANGLES) return indices;
  std::vector<std::uint32_t> triangles;
  triangles.reserve(3 * trianglesOf(mode, indices.size()));
  for (std::size_t i = 0; i + 2 < indices.size(); ++i) {
    const bool isFan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
    const std::uint32_t a = isFan ? indices[i + 1] : indices[i],
                        b = isFan ? indices[i + 2] : indices[i + 1 + i % 2],
                        c = isFan ? indices[0] : indices[i + 2 - i % 2];
    if (a != b && b != c && c != a) triangles.insert(triangles.end(), {a, b, c});
  }
  return triangles;
}

Expected<GltfPrimitive> readPlain(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                  int position, const PrimitiveLimits& limits) {
  const auto vertices = elementsOf(model, position, TINYGLTF_TYPE_VEC3);
  if (!vertices) return tl::unexpected(vertices.error());
  std::optional<GltfElements> corners;
  if (primitive.indices >= 0) {
    const auto elements = elementsOf(model, primitive.indices, TINYGLTF_TYPE_SCALAR);
    if (!elements) return tl::unexpected(elements.error());
    corners = *elements;
  }
  if (auto problem =
          checkCounts(modeOf(primitive), vertices->count, corners ? corners->count : vertices->count, limits))
    return tl::unexpected(std::move(*problem));
  auto positions = readVectors<Vec3>(*vertices, "positions");
  if (!positions) return tl::unexpected(std::move(positions.error()));
  GltfPrimitive read{std::move(*positions), {}, {}};
  if (corners) {
    auto indices = readIndices(*corners);
    if (!indices) return tl::unexpected(std::move(indices.error()));
    read.indices = std::move(*indices);
  } else {
    read.indices.resize(vertices->count);
    std::iota(read.indices.begin(), read.indices.end(), 0u);
  }
  read.indices = separated(modeOf(primitive), std::move(read.indices));
  const auto attribute = primitive.attributes.find("TEXCOORD_0");
  if (attribute == primitive.attributes.end()) return read;
  const auto elements = elementsOf(model, attribute->second, TINYGLTF_TYPE_VEC2);
  if (!elements) return tl::unexpected(elements.error());
  if (elements->count != vertices->count)
    return tl::unexpected(
        fmt::format("has {} texture coordinates for {} vertices", elements->count, vertices->count));
  auto uvs = readVectors<Uv>(*elements, "texture coordinates");
  if (!uvs) return tl::unexpected(std::move(uvs.error()));
  read.uvs = std::move(*uvs);
  return read;
}

int numberIn(const tinygltf::Value& object, const std::string& name) {
  const bool isThere = object.IsObject() && object.Has(name) && object.Get(name).IsInt();
  return isThere ? object.Get(name).GetNumberAsInt() : -1;
}

// Names of the compressed attributes for skins, and of those that are wanted. Their accessors must exist.
std::vector<std::string> vectorsIn(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                   const tinygltf::Value& compressed,
                                   std::span<const std::string_view> wanted) {
  std::vector<std::string> names;
  for (const std::string& name : compressed.Keys()) {
    if (numberIn(compressed, name) < 0) continue;
    const auto attribute = primitive.attributes.find(name);
    const bool isWanted = std::ranges::find(wanted, name) != wanted.end() &&
                          attribute != primitive.attributes.end() &&
                          elementAt(model.accessors, attribute->second);
    if (isWanted || name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")) names.push_back(name);
  }
  if (names.size() > kMaxDracoAttributes) names.resize(kMaxDracoAttributes);
  return names;
}

Expected<GltfPrimitive> readDraco(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                  const tinygltf::Value& extension, std::size_t vertices, std::size_t indices,
                                  std::span<const std::string_view> wanted) {
  const std::size_t triangles = trianglesOf(modeOf(primitive), indices);
  const auto refuse = [](std::string_view what) {
    return tl::unexpected(fmt::format("its compressed data ({}) {}", kDracoExtension, what));
  };
  const tinygltf::BufferView* view = elementAt(model.bufferViews, numberIn(extension, "bufferView"));
  const tinygltf::Buffer* buffer = view ? elementAt(model.buffers, view->buffer) : nullptr;
  if (!buffer || view->byteOffset > buffer->data.size() ||
      view->byteLength > buffer->data.size() - view->byteOffset)
    return refuse("has no buffer that holds it");
  const bool hasAttributes = extension.Has("attributes");
  const int position = hasAttributes ? numberIn(extension.Get("attributes"), "POSITION") : -1;
  const int uv = hasAttributes ? numberIn(extension.Get("attributes"), "TEXCOORD_0") : -1;
  if (position < 0) return refuse("has no POSITION");
  // The time of decoding also depends on the bytes.
  constexpr std::size_t kFixedBytes = 4096;
  const std::size_t most = kFixedBytes + vertices * kMaxDracoPointBytes + indices * sizeof(std::uint32_t);
  if (view->byteLength > most)
    return refuse(fmt::format("has {} bytes; at most {} are allowed for {} vertices and {} indices",
                              view->byteLength, most, vertices, indices));
  DracoRequest request{.positions = static_cast<std::uint32_t>(position),
                       .uvs = std::nullopt,
                       .maxPoints = vertices,
                       .maxFaces = triangles};
  if (uv >= 0) request.uvs = static_cast<std::uint32_t>(uv);
  const std::vector<std::string> names = vectorsIn(model, primitive, extension.Get("attributes"), wanted);
  for (const std::string& name : names) {
    DracoRequest::Vector& vector = request.vectors.emplace_back();
    vector.id = static_cast<std::uint32_t>(numberIn(extension.Get("attributes"), name));
    if (std::ranges::find(wanted, name) != wanted.end())
      vector.components = componentsOf(*elementAt(model.accessors, primitive.attributes.at(name)));
  }
  auto decoded = decodeDraco(
      std::as_bytes(std::span(buffer->data).subspan(view->byteOffset, view->byteLength)), request);
  if (!decoded) return refuse(decoded.error());
  GltfPrimitive read{std::move(decoded->positions), std::move(decoded->uvs), std::move(decoded->indices)};
  for (std::size_t i = 0; i < names.size(); ++i) read.vectors[names[i]] = std::move(decoded->vectors[i]);
  return read;
}

}  // namespace

std::string meshoptError() {
  return fmt::format(
      "is compressed with {}, which is not supported: export it without compression (gltfpack: without -c "
      "and -cc), "
      "or compress it with Draco",
      kMeshoptExtension);
}

Expected<GltfPrimitive> readPrimitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                      const PrimitiveLimits& limits,
                                      std::span<const std::string_view> attributes) {
  const int mode = modeOf(primitive);
  if (auto problem = checkMode(mode)) return tl::unexpected(std::move(*problem));
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end()) return tl::unexpected(std::string("has no POSITION"));
  const auto draco = primitive.extensions.find(kDracoExtension);
  if (draco == primitive.extensions.end()) return readPlain(model, primitive, position->second, limits);
  const tinygltf::Accessor* vertices = elementAt(model.accessors, position->second);
  const tinygltf::Accessor* corners = elementAt(model.accessors, primitive.indices);
  if (!vertices || !corners)
    return tl::unexpected(std::string("has no accessors for its POSITION and indices"));
  if (auto problem = checkCounts(mode, vertices->count, corners->count, limits))
    return tl::unexpected(std::move(*problem));
  return readDraco(model, primitive, draco->second, vertices->count, corners->count, attributes);
}

Expected<void> addTargets(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                          std::span<const double> weights, std::span<Vec3> positions) {
  constexpr std::ptrdiff_t kMost = 256;
  if (std::ranges::count_if(weights, [](double weight) { return weight != 0; }) > kMost)
    return tl::unexpected(
        fmt::format("has more than {} morph targets with a weight: apply them when you export it", kMost));
  for (std::size_t i = 0; i < std::min(weights.size(), primitive.targets.size()); ++i) {
    const auto target = primitive.targets[i].find("POSITION");
    if (weights[i] == 0 || target == primitive.targets[i].end()) continue;
    const auto refuse = [&](const std::string& text) {
      return tl::unexpected(fmt::format("morph target {}: {}", i, text));
    };
    const auto moves = elementsOf(model, target->second, TINYGLTF_TYPE_VEC3);
    if (!moves) return refuse(moves.error());
    if (moves->count != positions.size())
      return refuse(fmt::format("has {} elements for {} vertices", moves->count, positions.size()));
    const auto values = readVectors<Vec3>(*moves, "positions");
    if (!values) return refuse(values.error());
    for (std::size_t k = 0; k < positions.size(); ++k)
      positions[k] += static_cast<float>(weights[i]) * (*values)[k];
  }
  return {};
}

}  // namespace clothstream::meshes

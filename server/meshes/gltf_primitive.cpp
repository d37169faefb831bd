// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_primitive.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/draco_mesh.h"

namespace clothstream::meshes {
namespace {

using model::Uv;
using model::Vec3;
template <typename T>
using Expected = tl::expected<T, std::string>;

// Elements of an accessor in its buffer. The bounds are checked.
struct Elements {
  const unsigned char* first = nullptr;
  std::size_t stride = 0, count = 0;
  int componentType = 0;
  bool isNormalized = false;

  template <typename T>
  T at(std::size_t index, std::size_t component) const {
    T value;
    std::memcpy(&value, first + index * stride + component * sizeof(T), sizeof(T));
    return value;
  }
};

Expected<Elements> elementsOf(const tinygltf::Model& model, int index, int type) {
  const tinygltf::Accessor* accessor = elementAt(model.accessors, index);
  if (!accessor) return tl::unexpected(fmt::format("accessor {} does not exist", index));
  const auto refuse = [&](std::string_view what) {
    return tl::unexpected(fmt::format("accessor {} {}", index, what));
  };
  if (accessor->sparse.isSparse)
    return refuse("is sparse, which is not supported: export it without sparse accessors");
  if (accessor->type != type) return refuse("has the wrong number of components");
  const tinygltf::BufferView* view = elementAt(model.bufferViews, accessor->bufferView);
  if (view && view->extensions.contains(kMeshoptExtension)) return tl::unexpected(meshoptError());
  const tinygltf::Buffer* buffer = view ? elementAt(model.buffers, view->buffer) : nullptr;
  if (!buffer) return refuse("has no buffer");
  const int stride = accessor->ByteStride(*view);
  const std::int64_t size =
      std::int64_t{tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor->componentType))} *
      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor->type));
  if (stride <= 0 || size <= 0) return refuse("has a component type or stride that glTF does not have");
  const std::size_t bytes = buffer->data.size();
  const bool viewFits = view->byteOffset <= bytes && view->byteLength <= bytes - view->byteOffset;
  const bool startFits = viewFits && accessor->byteOffset <= view->byteLength;
  const std::size_t room = startFits ? view->byteLength - accessor->byteOffset : 0;
  const auto step = static_cast<std::size_t>(stride), last = static_cast<std::size_t>(size);
  if (accessor->count == 0 || last > room || accessor->count - 1 > (room - last) / step)
    return refuse(
        fmt::format("has {} elements, which its buffer of {} bytes does not hold", accessor->count, bytes));
  return Elements{buffer->data.data() + view->byteOffset + accessor->byteOffset, step, accessor->count,
                  accessor->componentType, accessor->normalized};
}

// Component of an element as a float. Integers of KHR_mesh_quantization are normalised where the accessor
// says so.
std::optional<float> component(const Elements& elements, std::size_t i, std::size_t c) {
  const auto number = [&]<typename T>(T value) {
    constexpr auto kMost = static_cast<float>(std::numeric_limits<T>::max());
    return elements.isNormalized ? std::max(static_cast<float>(value) / kMost, -1.0f)
                                 : static_cast<float>(value);
  };
  switch (elements.componentType) {
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return elements.at<float>(i, c);
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return number(elements.at<std::int8_t>(i, c));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return number(elements.at<std::uint8_t>(i, c));
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return number(elements.at<std::int16_t>(i, c));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return number(elements.at<std::uint16_t>(i, c));
    default:
      return std::nullopt;
  }
}

template <typename Vector>
Expected<std::vector<Vector>> readVectors(const Elements& elements, std::string_view what) {
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

Expected<std::vector<std::uint32_t>> readIndices(const Elements& elements) {
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

std::optional<std::string> checkCounts(std::size_t vertices, std::size_t indices,
                                       const PrimitiveLimits& limits) {
  if (indices % 3 != 0) return fmt::format("has {} indices, which is not a multiple of three", indices);
  if (vertices > limits.vertices)
    return fmt::format("has {} vertices; at most {} more are allowed: simplify it", vertices,
                       limits.vertices);
  if (indices / 3 > limits.triangles)
    return fmt::format("has {} triangles; at most {} more are allowed: simplify it", indices / 3,
                       limits.triangles);
  return std::nullopt;
}

Expected<GltfPrimitive> readPlain(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                  int position, const PrimitiveLimits& limits) {
  const auto vertices = elementsOf(model, position, TINYGLTF_TYPE_VEC3);
  if (!vertices) return tl::unexpected(vertices.error());
  std::optional<Elements> corners;
  if (primitive.indices >= 0) {
    const auto elements = elementsOf(model, primitive.indices, TINYGLTF_TYPE_SCALAR);
    if (!elements) return tl::unexpected(elements.error());
    corners = *elements;
  }
  if (auto problem = checkCounts(vertices->count, corners ? corners->count : vertices->count, limits))
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

Expected<GltfPrimitive> readDraco(const tinygltf::Model& model, const tinygltf::Value& extension,
                                  std::size_t vertices, std::size_t indices) {
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
                       .maxFaces = indices / 3};
  if (uv >= 0) request.uvs = static_cast<std::uint32_t>(uv);
  auto decoded = decodeDraco(
      std::as_bytes(std::span(buffer->data).subspan(view->byteOffset, view->byteLength)), request);
  if (!decoded) return refuse(decoded.error());
  return GltfPrimitive{std::move(decoded->positions), std::move(decoded->uvs), std::move(decoded->indices)};
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
                                      const PrimitiveLimits& limits) {
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1)
    return tl::unexpected(std::string("is not made of triangles: export it as triangles"));
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end()) return tl::unexpected(std::string("has no POSITION"));
  const auto draco = primitive.extensions.find(kDracoExtension);
  if (draco == primitive.extensions.end()) return readPlain(model, primitive, position->second, limits);
  const tinygltf::Accessor* vertices = elementAt(model.accessors, position->second);
  const tinygltf::Accessor* corners = elementAt(model.accessors, primitive.indices);
  if (!vertices || !corners)
    return tl::unexpected(std::string("has no accessors for its POSITION and indices"));
  if (auto problem = checkCounts(vertices->count, corners->count, limits))
    return tl::unexpected(std::move(*problem));
  return readDraco(model, draco->second, vertices->count, corners->count);
}

}  // namespace clothstream::meshes

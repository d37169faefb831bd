// SPDX-License-Identifier: MIT
// Reads glTF 2.0 with tinygltf. Checks accessors and nodes.
#include "server/meshes/gltf_file.h"

#include <cstring>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <tiny_gltf.h>

namespace clothstream::meshes {
namespace {

using Affine = Eigen::Affine3d;
template <typename T>
using Expected = tl::expected<T, std::string>;

// Elements of an accessor in its buffer. The bounds are checked.
struct Elements {
  const unsigned char* first = nullptr;
  std::size_t stride = 0, count = 0;
  int componentType = 0;

  template <typename T>
  T at(std::size_t index, std::size_t component) const {
    T value;
    std::memcpy(&value, first + index * stride + component * sizeof(T), sizeof(T));
    return value;
  }
};

template <typename Things>
auto* find(const Things& things, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < things.size()
             ? &things[static_cast<std::size_t>(index)]
             : nullptr;
}

Expected<Elements> elementsOf(const tinygltf::Model& model, int index, int type) {
  const tinygltf::Accessor* accessor = find(model.accessors, index);
  if (!accessor) return tl::unexpected(fmt::format("accessor {} does not exist", index));
  const auto refuse = [&](std::string_view what) {
    return tl::unexpected(fmt::format("accessor {} {}", index, what));
  };
  if (accessor->sparse.isSparse)
    return refuse("is sparse, which is not supported: export it without sparse accessors");
  if (accessor->type != type) return refuse("has the wrong number of components");
  const tinygltf::BufferView* view = find(model.bufferViews, accessor->bufferView);
  const tinygltf::Buffer* buffer = view ? find(model.buffers, view->buffer) : nullptr;
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
                  accessor->componentType};
}

Expected<std::vector<std::uint32_t>> readIndices(const tinygltf::Model& model,
                                                 const tinygltf::Primitive& primitive,
                                                 std::size_t vertexCount) {
  std::vector<std::uint32_t> indices;
  if (primitive.indices < 0) {
    for (std::uint32_t i = 0; i < vertexCount; ++i) indices.push_back(i);
    return indices;
  }
  const auto elements = elementsOf(model, primitive.indices, TINYGLTF_TYPE_SCALAR);
  if (!elements) return tl::unexpected(elements.error());
  indices.reserve(elements->count);
  for (std::size_t i = 0; i < elements->count; ++i) {
    switch (elements->componentType) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        indices.push_back(elements->at<std::uint8_t>(i, 0));
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        indices.push_back(elements->at<std::uint16_t>(i, 0));
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        indices.push_back(elements->at<std::uint32_t>(i, 0));
        break;
      default:
        return tl::unexpected(
            fmt::format("accessor {} has indices that are not unsigned integers", primitive.indices));
    }
  }
  return indices;
}

std::optional<model::Uv> readUv(const Elements& elements, std::size_t i) {
  switch (elements.componentType) {
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return model::Uv(elements.at<float>(i, 0), elements.at<float>(i, 1));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return model::Uv(elements.at<std::uint8_t>(i, 0), elements.at<std::uint8_t>(i, 1)) / 255.0f;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return model::Uv(elements.at<std::uint16_t>(i, 0), elements.at<std::uint16_t>(i, 1)) / 65535.0f;
    default:
      return std::nullopt;
  }
}

Affine localTransform(const tinygltf::Node& node) {
  Affine transform = Affine::Identity();
  if (node.matrix.size() == 16) {
    transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
    return transform;
  }
  if (node.translation.size() == 3)
    transform.translate(Eigen::Vector3d(node.translation[0], node.translation[1], node.translation[2]));
  if (node.rotation.size() == 4)
    transform.rotate(
        Eigen::Quaterniond(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]));
  if (node.scale.size() == 3) transform.scale(Eigen::Vector3d(node.scale[0], node.scale[1], node.scale[2]));
  return transform;
}

class Gatherer {
 public:
  explicit Gatherer(const tinygltf::Model& model) : model_(model), visited_(model.nodes.size(), false) {}

  Expected<MeshSource> gather() {
    const tinygltf::Scene* scene = find(model_.scenes, std::max(0, model_.defaultScene));
    if (scene) {
      for (const int node : scene->nodes)
        if (auto done = addTree(node); !done) return tl::unexpected(done.error());
    } else {
      for (const tinygltf::Mesh& mesh : model_.meshes)
        if (auto done = addMesh(mesh, Affine::Identity()); !done) return tl::unexpected(done.error());
    }
    if (!everyPartHasUvs_) {
      source_.uvs.clear();
    }
    return std::move(source_);
  }

 private:
  // Avoids recursion, because trees from outside may be deep.
  Expected<void> addTree(int root) {
    std::vector<std::pair<int, Affine>> open{{root, Affine::Identity()}};
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const tinygltf::Node* node = find(model_.nodes, index);
      if (!node) return tl::unexpected(fmt::format("node {} does not exist", index));
      if (visited_[static_cast<std::size_t>(index)])
        return tl::unexpected(fmt::format("node {} has two parents or is its own ancestor", index));
      visited_[static_cast<std::size_t>(index)] = true;
      const Affine transform = parent * localTransform(*node);
      if (node->mesh >= 0) {
        const tinygltf::Mesh* mesh = find(model_.meshes, node->mesh);
        if (!mesh) return tl::unexpected(fmt::format("mesh {} does not exist", node->mesh));
        if (auto done = addMesh(*mesh, transform); !done) return done;
      }
      // NOLINTNEXTLINE(modernize-loop-convert): backwards
      for (auto child = node->children.rbegin(); child != node->children.rend(); ++child)
        open.emplace_back(*child, transform);
    }
    return {};
  }

  Expected<void> addMesh(const tinygltf::Mesh& mesh, const Affine& transform) {
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i)
      if (auto done = addPrimitive(mesh, mesh.primitives[i], transform); !done)
        return tl::unexpected(fmt::format("mesh \"{}\", primitive {}: {}", mesh.name, i, done.error()));
    return {};
  }

  Expected<void> addPrimitive(const tinygltf::Mesh& mesh, const tinygltf::Primitive& primitive,
                              const Affine& transform) {
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1)
      return tl::unexpected(std::string("is not made of triangles: export it as triangles"));
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) return tl::unexpected(std::string("has no POSITION"));
    const auto vertices = elementsOf(model_, position->second, TINYGLTF_TYPE_VEC3);
    if (!vertices) return tl::unexpected(vertices.error());
    if (vertices->componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
      return tl::unexpected(std::string("has positions that are not floats: export it without compression"));
    const auto indices = readIndices(model_, primitive, vertices->count);
    if (!indices) return tl::unexpected(indices.error());
    if (indices->size() % 3 != 0)
      return tl::unexpected(fmt::format("has {} indices, which is not a multiple of three", indices->size()));

    const auto firstVertex = source_.vertices.size();
    const auto firstUv = source_.uvs.size();
    if (firstVertex + vertices->count > std::numeric_limits<std::uint32_t>::max())
      return tl::unexpected(std::string("has too many vertices"));
    for (std::size_t i = 0; i < vertices->count; ++i)
      source_.vertices.push_back(
          (transform *
           Eigen::Vector3d(vertices->at<float>(i, 0), vertices->at<float>(i, 1), vertices->at<float>(i, 2)))
              .cast<float>());
    if (auto done = addUvs(primitive, vertices->count); !done) return done;
    const tinygltf::Material* material = find(model_.materials, primitive.material);
    source_.parts.push_back(
        {material && !material->name.empty() ? material->name : mesh.name, source_.faces.size()});
    addFaces(*indices, static_cast<std::uint32_t>(firstVertex), static_cast<std::uint32_t>(firstUv),
             transform.linear().determinant() < 0);
    return {};
  }

  Expected<void> addUvs(const tinygltf::Primitive& primitive, std::size_t vertexCount) {
    const auto attribute = primitive.attributes.find("TEXCOORD_0");
    if (attribute == primitive.attributes.end()) {
      everyPartHasUvs_ = false;
      return {};
    }
    const auto elements = elementsOf(model_, attribute->second, TINYGLTF_TYPE_VEC2);
    if (!elements) return tl::unexpected(elements.error());
    if (elements->count != vertexCount)
      return tl::unexpected(
          fmt::format("has {} texture coordinates for {} vertices", elements->count, vertexCount));
    for (std::size_t i = 0; i < elements->count; ++i) {
      const auto uv = readUv(*elements, i);
      if (!uv)
        return tl::unexpected(std::string("has texture coordinates of a type that glTF does not have"));
      // v runs downwards in glTF and upwards here.
      source_.uvs.emplace_back(uv->x(), 1 - uv->y());
    }
    return {};
  }

  // A mirrored mesh shows its back. The specification requires that its triangles are reversed.
  void addFaces(const std::vector<std::uint32_t>& indices, std::uint32_t firstVertex, std::uint32_t firstUv,
                bool mirrored) {
    const std::uint32_t limit = std::numeric_limits<std::uint32_t>::max();
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      SourceFace& face = source_.faces.emplace_back();
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint32_t index = indices[i + (mirrored ? 2 - corner : corner)];
        const bool inside = index < source_.vertices.size() - firstVertex;
        face.vertices[corner] = inside ? firstVertex + index : limit;
        face.uvs[corner] = inside ? firstUv + index : limit;
      }
    }
  }

  const tinygltf::Model& model_;
  std::vector<bool> visited_;
  MeshSource source_;
  bool everyPartHasUvs_ = true;
};

}  // namespace

tl::expected<MeshSource, std::string> readGltf(const std::filesystem::path& path, bool binary) {
  tinygltf::TinyGLTF loader;
  // Images are not needed, so they are not decoded.
  loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
                           int, void*) { return true; },
                        nullptr);
  tinygltf::Model model;
  std::string error, warning;
  const bool read = binary ? loader.LoadBinaryFromFile(&model, &error, &warning, path.string())
                           : loader.LoadASCIIFromFile(&model, &error, &warning, path.string());
  while (!error.empty() && error.back() == '\n') error.pop_back();
  if (!read)
    return tl::unexpected(fmt::format("is not glTF 2.0: {}", error.empty() ? "cannot be parsed" : error));
  for (const std::string& extension : model.extensionsRequired)
    if (extension != "KHR_texture_transform" && !extension.starts_with("KHR_materials"))
      return tl::unexpected(fmt::format(
          "needs the extension {}, which is not supported: export it without that extension", extension));
  return Gatherer(model).gather();
}

}  // namespace clothstream::meshes

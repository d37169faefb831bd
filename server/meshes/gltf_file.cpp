// SPDX-License-Identifier: MIT
// Reads glTF 2.0 with tinygltf. Checks nodes, skins and extensions.
#include "server/meshes/gltf_file.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <tiny_gltf.h>

#include "proto/text/excerpt.h"
#include "proto/text/lines.h"
#include "proto/text/utf8.h"
#include "server/files/regular_file.h"
#include "server/meshes/gltf_attributes.h"
#include "server/meshes/gltf_container.h"
#include "server/meshes/gltf_name.h"
#include "server/meshes/gltf_primitive.h"
#include "server/meshes/gltf_skeleton.h"
#include "server/meshes/gltf_skin.h"
#include "server/meshes/gltf_vertex_joints.h"

namespace clothstream::meshes {
namespace {

using Affine = Eigen::Affine3d;
template <typename T>
using Expected = tl::expected<T, std::string>;

// Skins of the meshes of a file. Each may name its joints again.
constexpr std::size_t kMostSkins = 256;

// Where a mesh is in the scene.
struct Placement {
  Affine transform = Affine::Identity();        // of its node
  const std::vector<Affine>* joints = nullptr;  // matrices of the joints of its skin, which replace it
  const SkinBinding* binding = nullptr;         // to the joints that were asked for, which replace it, too
  std::span<const double> weights = {};         // of its morph targets
};

class Gatherer {
 public:
  Gatherer(const tinygltf::Model& model, std::uint64_t maxVertices, const JointRequest* joints)
      : model_(model), maxVertices_(maxVertices), joints_(joints), visited_(model.nodes.size(), false) {}

  Expected<MeshSource> gather() {
    const tinygltf::Scene* scene = elementAt(model_.scenes, std::max(0, model_.defaultScene));
    if (joints_ && scene)
      if (auto done = readSkins(*scene); !done) return tl::unexpected(std::move(done.error()));
    if (scene) {
      for (const int node : scene->nodes)
        if (auto done = addTree(node); !done) return tl::unexpected(done.error());
    } else {
      for (const tinygltf::Mesh& mesh : model_.meshes)
        if (auto done = addMesh(mesh, {.weights = mesh.weights}); !done) return tl::unexpected(done.error());
    }
    if (!everyPartHasUvs_) {
      source_.uvs.clear();
    }
    if (skeleton_ && !rigidMesh_.empty())
      return tl::unexpected(fmt::format(
          "{} has no skin, in contrast to others: remove it, or give it the same joints", rigidMesh_));
    completeAttributes(source_.vertices.size(), source_.attributes);
    if (skeleton_)
      source_.skin = std::move(skeleton_->skin);
    else if (joints_ && !joints_->animation.empty())
      return tl::unexpected(noJointsError());
    return std::move(source_);
  }

 private:
  // Avoids recursion, because trees from outside may be deep.
  Expected<void> addTree(int root) {
    std::vector<std::pair<int, Affine>> open{{root, Affine::Identity()}};
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const tinygltf::Node* node = elementAt(model_.nodes, index);
      if (!node) return tl::unexpected(fmt::format("node {} does not exist", index));
      if (visited_[static_cast<std::size_t>(index)])
        return tl::unexpected(fmt::format("node {} has two parents or is its own ancestor", index));
      visited_[static_cast<std::size_t>(index)] = true;
      const Affine transform = parent * localTransform(*node);
      if (node->mesh >= 0) {
        const tinygltf::Mesh* mesh = elementAt(model_.meshes, node->mesh);
        if (!mesh) return tl::unexpected(fmt::format("mesh {} does not exist", node->mesh));
        if (joints_ && node->skin < 0) rigidMesh_ = nameOf(*mesh);
        const auto matrices = matricesOf(*node);
        if (!matrices) return tl::unexpected(matrices.error());
        const Placement placement{.transform = transform,
                                  .joints = *matrices,
                                  .binding = bindingOf(*node),
                                  .weights = node->weights.empty() ? mesh->weights : node->weights};
        if (auto done = addMesh(*mesh, placement); !done) return done;
      }
      // NOLINTNEXTLINE(modernize-loop-convert): backwards
      for (auto child = node->children.rbegin(); child != node->children.rend(); ++child)
        open.emplace_back(*child, transform);
    }
    return {};
  }

  // Reads the skins of all meshes of the scene, in the order of its nodes.
  Expected<void> readSkins(const tinygltf::Scene& scene) {
    std::vector<bool> isSeen(model_.nodes.size(), false);
    std::vector<int> open(scene.nodes.rbegin(), scene.nodes.rend());
    while (!open.empty()) {
      const int index = open.back();
      open.pop_back();
      const tinygltf::Node* node = elementAt(model_.nodes, index);
      if (!node || isSeen[static_cast<std::size_t>(index)]) continue;  // addTree() refuses them
      isSeen[static_cast<std::size_t>(index)] = true;
      if (node->mesh >= 0 && node->skin >= 0 && std::ranges::find(skins_, node->skin) == skins_.end()) {
        if (skins_.size() == kMostSkins)
          return tl::unexpected(fmt::format("has meshes with more than {} skins: join meshes", kMostSkins));
        skins_.push_back(node->skin);
      }
      open.insert(open.end(), node->children.rbegin(), node->children.rend());
    }
    if (skins_.empty()) return {};
    auto read = readSkeleton(model_, skins_, *joints_);
    if (!read) return tl::unexpected(std::move(read.error()));
    skeleton_ = std::move(*read);
    return {};
  }

  const SkinBinding* bindingOf(const tinygltf::Node& node) const {
    const auto skin = std::ranges::find(skins_, node.skin);
    return skeleton_ && skin != skins_.end()
               ? &skeleton_->bindings[static_cast<std::size_t>(skin - skins_.begin())]
               : nullptr;
  }

  // Matrices of the joints that place a mesh. Null for a mesh without a skin, and if the skin is requested,
  // whose joints then move.
  Expected<const std::vector<Affine>*> matricesOf(const tinygltf::Node& node) {
    if (joints_ || node.skin < 0) return nullptr;
    const auto known = matrices_.find(node.skin);
    if (known != matrices_.end()) return &known->second;
    if (!nodes_) nodes_.emplace(model_);
    auto read = jointMatrices(model_, node.skin, *nodes_);
    if (!read) return tl::unexpected(std::move(read.error()));
    return &matrices_.emplace(node.skin, std::move(*read)).first->second;
  }

  // `mesh` is one of the model.
  std::string nameOf(const tinygltf::Mesh& mesh) const {
    return namedPart("mesh", mesh.name, static_cast<std::size_t>(&mesh - model_.meshes.data()));
  }

  Expected<void> addMesh(const tinygltf::Mesh& mesh, const Placement& placement) {
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i)
      if (auto done = addPrimitive(mesh, mesh.primitives[i], placement); !done)
        return tl::unexpected(fmt::format("{}, primitive {}: {}", nameOf(mesh), i, done.error()));
    return {};
  }

  Expected<void> addPrimitive(const tinygltf::Mesh& mesh, const tinygltf::Primitive& primitive,
                              const Placement& placement) {
    const std::size_t firstVertex = source_.vertices.size(), firstUv = source_.uvs.size();
    Expected<GltfPrimitive> read = readPrimitive(
        model_, primitive,
        {.vertices = maxVertices_ - firstVertex, .triangles = 2 * maxVertices_ - source_.faces.size()},
        hasAttributes() ? std::span<const std::string_view>(kSkinAttributes)
                        : std::span<const std::string_view>());
    if (!read) return tl::unexpected(read.error());
    if (hasAttributes())
      if (auto done = addAttributes(model_, primitive, *read, firstVertex, source_.attributes); !done)
        return done;
    if (auto done = addTargets(model_, primitive, placement.weights, read->positions); !done) return done;
    const auto isMirrored = place(primitive, placement, *read);
    if (!isMirrored) return tl::unexpected(isMirrored.error());
    source_.vertices.insert(source_.vertices.end(), read->positions.begin(), read->positions.end());
    everyPartHasUvs_ = everyPartHasUvs_ && !read->uvs.empty();
    // v runs downwards in glTF and upwards here.
    for (const model::Uv& uv : read->uvs) source_.uvs.emplace_back(uv.x(), 1 - uv.y());
    const tinygltf::Material* material = elementAt(model_.materials, primitive.material);
    source_.parts.push_back(
        {material && !material->name.empty() ? material->name : mesh.name, source_.faces.size()});
    addFaces(read->indices, static_cast<std::uint32_t>(firstVertex), static_cast<std::uint32_t>(firstUv),
             *isMirrored);
    return {};
  }

  // Moves positions of a primitive to their place in the scene. Returns whether that mirrors them. Joints
  // replace the transform of the node (glTF 2.0, 3.7.3.3).
  Expected<bool> place(const tinygltf::Primitive& primitive, const Placement& placement,
                       GltfPrimitive& read) {
    if (placement.joints) {
      if (auto done = placeByJoints(model_, primitive, *placement.joints, read); !done)
        return tl::unexpected(std::move(done.error()));
      return placement.joints->front().linear().determinant() < 0;
    }
    const Affine transform = placement.binding ? placement.binding->vertices : placement.transform;
    for (model::Vec3& position : read.positions)
      position = (transform * position.cast<double>()).cast<float>();
    if (placement.binding) {
      const auto vertices = readVertexJoints(model_, primitive, read, *placement.binding);
      if (!vertices) return tl::unexpected(vertices.error());
      skeleton_->skin.vertices.insert(skeleton_->skin.vertices.end(), vertices->begin(), vertices->end());
    }
    return transform.linear().determinant() < 0;
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

  bool hasAttributes() const { return joints_ && joints_->attributes; }

  const tinygltf::Model& model_;
  std::uint64_t maxVertices_;
  const JointRequest* joints_;           // null: joints place the vertices once, and the result has no skin
  std::optional<NodeTransforms> nodes_;  // made for the first skin
  std::unordered_map<int, std::vector<Affine>> matrices_;  // of the joints of each skin
  std::vector<int> skins_;                                 // that were asked for
  std::optional<GltfSkeleton> skeleton_;
  std::string rigidMesh_;  // a mesh without a skin
  std::vector<bool> visited_;
  MeshSource source_;
  bool everyPartHasUvs_ = true;
};

// Whether an extension, of any vendor, only says how a mesh looks or what it means.
bool leavesGeometry(std::string_view name) {
  constexpr std::string_view kKinds[] = {"materials", "texture_",      "lights_",
                                         "xmp",       "mesh_features", "structural_metadata"};
  const std::size_t vendor = std::min(name.find('_'), name.size() - 1);
  return std::ranges::any_of(
      kKinds, [&](std::string_view kind) { return name.substr(vendor + 1).starts_with(kind); });
}

std::optional<std::string> unsupportedExtension(const std::string& name) {
  if (name == kMeshoptExtension) return meshoptError();
  if (name == kDracoExtension || name == kQuantizationExtension) return std::nullopt;
  if (!name.empty() && leavesGeometry(name)) return std::nullopt;
  return fmt::format("needs the extension {}, which is not supported: export it without that extension",
                     excerpt(name));
}

// Files that a .gltf file refers to, for the callbacks of tinygltf. They are in its folder, and have a limit
// of bytes in all, so that a file from a stranger reads nothing else and costs no more than it may.
class NeighbourFiles {
 public:
  NeighbourFiles(const std::filesystem::path& folder, std::uint64_t most)
      : folder_(std::filesystem::absolute(folder.empty() ? "." : folder).lexically_normal()), left_(most) {}

  tinygltf::FsCallbacks callbacks() {
    tinygltf::FsCallbacks calls{};
    calls.FileExists = [](const std::string& path, void* self) {
      return static_cast<const NeighbourFiles*>(self)->holds(path);
    };
    calls.ExpandFilePath = [](const std::string& path, void*) { return path; };
    calls.ReadWholeFile = [](std::vector<unsigned char>* bytes, std::string* error, const std::string& path,
                             void* self) {
      return static_cast<NeighbourFiles*>(self)->read(path, *bytes, *error);
    };
    calls.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
      return false;
    };
    setFileSize(calls);
    calls.user_data = this;
    return calls;
  }

  bool holds(const std::filesystem::path& path) const {
    const auto inFolder = std::filesystem::absolute(path).lexically_normal().lexically_relative(folder_);
    std::error_code ignored;
    return !inFolder.empty() && *inFolder.begin() != ".." && std::filesystem::is_regular_file(path, ignored);
  }

 private:
  // Versions of tinygltf that know this callback ignore all callbacks if it is missing, and then read any
  // file.
  template <typename Callbacks>
  static void setFileSize(Callbacks& calls) {
    if constexpr (requires { calls.GetFileSizeInBytes; })
      calls.GetFileSizeInBytes = [](std::size_t* size, std::string* error, const std::string& path, void*) {
        std::error_code problem;
        *size = std::filesystem::file_size(path, problem);
        if (problem) *error = problem.message();
        return !problem;
      };
  }

  bool read(const std::filesystem::path& path, std::vector<unsigned char>& bytes, std::string& error) {
    const auto content = files::readRegularFile(path, left_);
    if (content) {
      left_ -= content->size();
      bytes.assign(content->begin(), content->end());
    } else {
      error = content.error().text;
    }
    return content.has_value();
  }

  std::filesystem::path folder_;
  std::uint64_t left_;
};

}  // namespace

std::string noJointsError() {
  return "has no joints, so it has no animation: export it with its skin, or remove \"animation\"";
}

tl::expected<MeshSource, std::string> readGltf(std::string bytes, const std::filesystem::path& folder,
                                               bool binary, const FileLimits& limits,
                                               const JointRequest* joints) {
  if (!binary && isWideText(bytes))
    return tl::unexpected(
        std::string("is text in UTF-16 or UTF-32, which glTF does not allow: save it as UTF-8"));
  tinygltf::TinyGLTF loader;
  NeighbourFiles files(folder, limits.bytes - std::min<std::uint64_t>(limits.bytes, bytes.size()));
  loader.SetFsCallbacks(files.callbacks());
  // Images are not needed, so they are not decoded.
  loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
                           int, void*) { return true; },
                        nullptr);
  const FileExists exists = [&](const std::string& name) { return files.holds(folder / name); };
  const Expected<std::string> prepared = prepareGltf(std::move(bytes), binary, exists);
  if (!prepared) return tl::unexpected(prepared.error());
  tinygltf::Model model;
  std::string error, warning;
  const auto size = static_cast<unsigned>(prepared->size());
  const bool read =
      binary ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                           reinterpret_cast<const unsigned char*>(prepared->data()), size,
                                           folder.string())
             : loader.LoadASCIIFromString(&model, &error, &warning, prepared->data(), size, folder.string());
  while (!error.empty() && error.back() == '\n') error.pop_back();
  if (!read || !model.asset.version.starts_with("2."))
    if (auto unsupported = unsupportedGltf(*prepared, binary)) return tl::unexpected(std::move(*unsupported));
  if (!read)
    if (auto missing = missingFile(*prepared, binary, exists)) return tl::unexpected(std::move(*missing));
  if (!read)
    return tl::unexpected(isUtf8(error)
                              ? fmt::format("is not glTF 2.0: {}", error.empty() ? "cannot be parsed" : error)
                              : fmt::format("is not glTF 2.0: {}: save it as UTF-8", excerpt(error, 300)));
  for (const std::string& extension : model.extensionsRequired)
    if (auto problem = unsupportedExtension(extension)) return tl::unexpected(std::move(*problem));
  return Gatherer(model, limits.vertices, joints).gather();
}

}  // namespace clothstream::meshes

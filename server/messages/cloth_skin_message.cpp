// SPDX-License-Identifier: MIT
#include "server/messages/cloth_skin_message.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "proto/text/excerpt.h"
#include "server/meshes/mesh_source.h"
#include "server/messages/limits.h"
#include "server/messages/node_selection.h"
#include "server/messages/skin_message.h"
#include "server/model/skin_transfer.h"

namespace clothstream::messages {
namespace {

using model::SkinLimits;
using Numbers = google::protobuf::RepeatedField<float>;

// In lists: the limit of the message for all vertices.
constexpr float kAsLimits = -1;

constexpr std::string_view kInsteadOfNames =
    "rename the joint in one of the files, or give \"vertexJoints\" and \"vertexWeights\"";

void applyLimits(Checks& checks, const Path& path, const v1::SkinLimits& message, SkinLimits& limits) {
  if (message.has_max_distance())
    limits.maxDistance = checks.number(path / "maxDistance", message.max_distance(), limits::kSkinDistance);
  if (message.has_backstop_distance())
    limits.backstopDistance =
        checks.number(path / "backstopDistance", message.backstop_distance(), limits::kSkinDistance);
  if (message.has_backstop_radius())
    limits.backstopRadius =
        checks.number(path / "backstopRadius", message.backstop_radius(), limits::kSkinDistance);
}

// The limits of a vertex of a node that has those of other vertices.
void tighten(SkinLimits& node, const SkinLimits& vertex) {
  node.maxDistance = std::min(node.maxDistance, vertex.maxDistance);
  const bool isLarger =
      vertex.backstopRadius > node.backstopRadius ||
      (vertex.backstopRadius == node.backstopRadius && vertex.backstopDistance < node.backstopDistance);
  if (!isLarger) return;
  node.backstopRadius = vertex.backstopRadius;
  node.backstopDistance = vertex.backstopDistance;
}

class ClothSkinReader {
 public:
  ClothSkinReader(Checks& checks, const Path& path, const v1::ClothSkin& message, const model::Cloth& cloth,
                  const ClothVertices& vertices)
      : checks_(checks),
        path_(path),
        message_(message),
        cloth_(cloth),
        vertices_(vertices),
        vertexCount_(cloth.mesh ? vertices.nodes.nodeOfVertex.size() : cloth.nodeCount()) {}

  std::shared_ptr<const model::ClothSkin> read(const std::vector<model::Collider>& colliders,
                                               const model::Cancellation& cancellation) {
    const model::ClosedMesh* const body = findBody(colliders);
    if (!body) return nullptr;
    checkCounts();
    if (checks_.failed()) return nullptr;
    skin_.collider = message_.collider();
    nodes_ = model::restPositions(cloth_);
    skin_.joints.resize(nodes_.size());
    skin_.limits.resize(nodes_.size());
    if (message_.vertex_joints_size() > 0)
      readJoints(body->skin->joints.size());
    else if (vertices_.skin)
      findJoints(*body->skin);
    else
      skin_.joints = model::jointsNear(*body, nodes_, cancellation);
    cancellation.check();
    if (!checks_.failed()) readLimits();
    for (int i = 0; i < message_.regions_size() && !checks_.failed(); ++i)
      applyRegion(path_.at("regions", i), message_.regions(i));
    if (!checks_.failed()) checkHeld();
    if (checks_.failed()) return nullptr;
    model::complete(skin_, cloth_,
                    *std::ranges::find(colliders, message_.collider(), &model::Collider::name));
    return std::make_shared<const model::ClothSkin>(std::move(skin_));
  }

 private:
  // The collider's mesh, which has joints. Null if a check fails.
  const model::ClosedMesh* findBody(const std::vector<model::Collider>& colliders) {
    const Path at = path_ / "collider";
    checkKnown(checks_, at, message_.collider(), colliders, v1::ERROR_CODE_INVALID_ARGUMENT);
    if (checks_.failed()) return nullptr;
    const auto found = std::ranges::find(colliders, message_.collider(), &model::Collider::name);
    const auto* solid = std::get_if<model::Solid>(&found->shape);
    if (solid && (*solid)->skin) return solid->get();
    failCollider(solid ? "is a mesh without joints; give it a \"skin\", or a file that has one"
                       : "has no joints; must be a collider with a \"mesh\" that has them");
    return nullptr;
  }

  void failCollider(std::string_view text) {
    checks_.failNamed(path_ / "collider", message_.collider(), text);
  }

  void checkCounts() {
    const auto joints = static_cast<std::size_t>(message_.vertex_joints_size()),
               weights = static_cast<std::size_t>(message_.vertex_weights_size());
    const std::size_t numbers = model::kVertexJoints * vertexCount_;
    const auto checkList = [&](std::string_view field, std::size_t has, std::size_t must,
                               std::string_view none) {
      if (has != must)
        checks_.fail(path_ / field, "",
                     fmt::format("has {} numbers for {} vertices; must have {}, or none{}", has, vertexCount_,
                                 must, none));
    };
    if (joints > 0 || weights > 0) {
      checkList("vertexJoints", joints, numbers, " together with \"vertexWeights\"");
      checkList("vertexWeights", weights, numbers, " together with \"vertexJoints\"");
    }
    for (const auto& [field, list] : {std::pair("maxDistances", &message_.max_distances()),
                                      std::pair("backstopDistances", &message_.backstop_distances()),
                                      std::pair("backstopRadii", &message_.backstop_radii())})
      if (!list->empty()) checkList(field, static_cast<std::size_t>(list->size()), vertexCount_, "");
    checks_.count(path_ / "regions", static_cast<std::size_t>(message_.regions_size()), 0, limits::kMaxPins);
  }

  // Calls visit(vertex, node, isFirst) for each vertex that has a node. Copies of a node that a repair made
  // are left out.
  template <typename Visit>
  void forEachVertex(const Visit& visit) const {
    std::vector<bool> isSeen(nodes_.size());
    for (std::size_t vertex = 0; vertex < vertexCount_; ++vertex) {
      const std::size_t node = cloth_.mesh ? vertices_.nodes.nodeOfVertex[vertex] : vertex;
      if (node == meshes::kNoNode) continue;
      visit(vertex, node, !isSeen[node]);
      isSeen[node] = true;
    }
  }

  // Gives the copies of a node what it has.
  template <typename Element>
  void copyToCopies(std::vector<Element>& elements) const {
    const std::vector<std::uint32_t>& next = vertices_.nodes.nextCopy;
    if (next.empty()) return;
    forEachVertex([&](std::size_t, std::size_t node, bool isFirst) {
      if (!isFirst) return;
      for (std::uint32_t copy = next[node]; copy != meshes::kNoNode; copy = next[copy])
        elements[copy] = elements[node];
    });
  }

  void readJoints(std::size_t jointCount) {
    std::vector<model::VertexJoints> joints;
    joints.reserve(vertexCount_);
    for (std::size_t i = 0; i < vertexCount_ && !checks_.failed(); ++i)
      joints.push_back(
          toVertexJoints(checks_, path_, message_.vertex_joints(), message_.vertex_weights(), i, jointCount));
    if (!checks_.failed()) setJoints(joints);
  }

  void setJoints(std::span<const model::VertexJoints> joints) {
    forEachVertex([&](std::size_t vertex, std::size_t node, bool isFirst) {
      if (isFirst) skin_.joints[node] = joints[vertex];
    });
    copyToCopies(skin_.joints);
  }

  // Joints of the file, by their names. Joints that move no vertex of the cloth need not be there.
  void findJoints(const model::Skin& body) {
    const model::Skin& own = *vertices_.skin;
    std::vector<bool> isUsed(own.joints.size());
    for (const model::VertexJoints& vertex : own.vertices)
      for (std::size_t k = 0; k < model::kVertexJoints; ++k)
        if (vertex.weights[k] > 0) isUsed[vertex.joints[k]] = true;
    std::unordered_map<std::string_view, std::size_t> counts;  // of the body's joints with a name
    for (const model::Joint& joint : body.joints) ++counts[joint.name];
    std::unordered_map<std::string_view, std::size_t> used;
    std::vector<std::uint8_t> numbers(own.joints.size());
    for (std::size_t i = 0; i < own.joints.size() && !checks_.failed(); ++i) {
      if (!isUsed[i]) continue;
      const std::string& name = own.joints[i].name;
      if (name.empty())
        checks_.fail(path_, "",
                     "the file has a joint without a name: name its joints as those of the collider, or give "
                     "\"vertexJoints\" and \"vertexWeights\"");
      else if (++used[name] > 1)
        checks_.fail(
            path_, "",
            fmt::format("the file has two joints named \"{}\": give them different names", excerpt(name)));
      else if (counts[name] > 1)
        failCollider(fmt::format("has two joints named \"{}\": give them different names", excerpt(name)));
      else if (counts[name] == 0)
        failCollider(fmt::format("has no joint \"{}\", which moves vertices of the file: {}", excerpt(name),
                                 kInsteadOfNames));
      const auto found = std::ranges::find(body.joints, name, &model::Joint::name);
      numbers[i] = static_cast<std::uint8_t>(found - body.joints.begin());
    }
    if (checks_.failed()) return;
    std::vector<model::VertexJoints> joints = own.vertices;
    for (model::VertexJoints& vertex : joints)
      for (std::uint8_t& joint : vertex.joints) joint = numbers[joint];
    setJoints(joints);
  }

  // A number of the file for a vertex. Nothing if it is absent or negative.
  std::optional<float> numberOfFile(const std::vector<float>& list, std::size_t vertex,
                                    std::string_view name) {
    if (list.empty() || list[vertex] < 0) return std::nullopt;
    if (!(list[vertex] <= static_cast<float>(limits::kSkinDistance.max)))
      checks_.fail(
          path_, "",
          fmt::format("vertex {} of the file has the {} {}; must be a finite number from {:g} to {:g}, or "
                      "negative for that of \"limits\"",
                      vertex, name, list[vertex], limits::kSkinDistance.min, limits::kSkinDistance.max));
    return list[vertex];
  }

  // The number of the message's list. Nothing if it is absent or negative.
  std::optional<float> numberOfList(const Numbers& list, std::size_t vertex, std::string_view field) {
    if (list.empty()) return std::nullopt;
    const auto index = static_cast<int>(vertex);
    const float number = list[index];
    if (number < 0 && std::isfinite(number)) return std::nullopt;
    if (!(number >= 0 && number <= static_cast<float>(limits::kSkinDistance.max)))
      checks_.fail(
          path_.at(field, index), fmt::format("{}", number),
          fmt::format("must be a finite number from {:g} to {:g}, or negative for that of \"limits\"",
                      limits::kSkinDistance.min, limits::kSkinDistance.max));
    return number;
  }

  // Checks the colours and how they are used. The largest distances of the vertices from them.
  std::vector<float> distancesOfColours() {
    const Path at = path_ / "colourDistance";
    const v1::ColourDistance& wanted = message_.colour_distance();
    const std::uint32_t channel = checks_.integer(at / "channel", wanted.channel(), 0, 3);
    const float distance = checks_.number(at / "distance", wanted.distance(), limits::kSkinDistance);
    if (!cloth_.mesh || vertices_.attributes.colours.empty())
      checks_.fail(
          at, "",
          "is for a mesh of a glTF \"file\" with COLOR_0, which this cloth has not: export the vertex "
          "colours, or give \"maxDistances\"");
    std::vector<float> distances;
    if (checks_.failed()) return distances;
    for (const Eigen::Vector4f& colour : vertices_.attributes.colours) {
      const float value = colour[static_cast<Eigen::Index>(channel)];
      const bool isAbsent = value == meshes::VertexAttributes::kAbsent;
      if (!isAbsent && !(value >= 0 && value <= 1))
        checks_.fail(at, "",
                     fmt::format("vertex {} of the file has {} in channel {} of COLOR_0; must be 0 to 1",
                                 distances.size(), value, channel));
      if (checks_.failed()) break;
      distances.push_back(isAbsent ? kAsLimits : value * distance);
    }
    return distances;
  }

  void readLimits() {
    SkinLimits common;
    applyLimits(checks_, path_ / "limits", message_.limits(), common);
    std::vector<float> ofColours;
    if (message_.has_colour_distance()) ofColours = distancesOfColours();
    const meshes::VertexAttributes& file = vertices_.attributes;
    const std::vector<float>& farthest = message_.has_colour_distance() ? ofColours : file.maxDistances;
    if (checks_.failed()) return;
    const auto of = [&](std::size_t i) {
      SkinLimits limits = common;
      const auto set = [](float& limit, std::optional<float> number) { limit = number.value_or(limit); };
      set(limits.maxDistance, numberOfFile(farthest, i, "_MAX_DISTANCE"));
      set(limits.backstopDistance, numberOfFile(file.backstopDistances, i, "_BACKSTOP_DISTANCE"));
      set(limits.backstopRadius, numberOfFile(file.backstopRadii, i, "_BACKSTOP_RADIUS"));
      set(limits.maxDistance, numberOfList(message_.max_distances(), i, "maxDistances"));
      set(limits.backstopDistance, numberOfList(message_.backstop_distances(), i, "backstopDistances"));
      set(limits.backstopRadius, numberOfList(message_.backstop_radii(), i, "backstopRadii"));
      return limits;
    };
    std::vector<SkinLimits> limits;
    limits.reserve(vertexCount_);
    for (std::size_t i = 0; i < vertexCount_ && !checks_.failed(); ++i) limits.push_back(of(i));
    if (checks_.failed()) return;
    forEachVertex([&](std::size_t vertex, std::size_t node, bool isFirst) {
      if (isFirst)
        skin_.limits[node] = limits[vertex];
      else
        tighten(skin_.limits[node], limits[vertex]);
    });
    copyToCopies(skin_.limits);
  }

  void applyRegion(const Path& path, const v1::SkinRegion& message) {
    const model::Region region = toRegion(checks_, path / "region", message.region());
    const v1::SkinLimits& limits = message.limits();
    if (!limits.has_max_distance() && !limits.has_backstop_distance() && !limits.has_backstop_radius())
      checks_.fail(path / "limits", "",
                   "has no number; must have one at least of \"maxDistance\", \"backstopDistance\" and "
                   "\"backstopRadius\"");
    SkinLimits checked;
    applyLimits(checks_, path / "limits", limits, checked);
    if (checks_.failed()) return;
    bool isEmpty = true;
    for (std::size_t node = 0; node < nodes_.size(); ++node) {
      if (!region.contains(nodes_[node])) continue;
      isEmpty = false;
      SkinLimits& own = skin_.limits[node];
      if (limits.has_max_distance()) own.maxDistance = checked.maxDistance;
      if (limits.has_backstop_distance()) own.backstopDistance = checked.backstopDistance;
      if (limits.has_backstop_radius()) own.backstopRadius = checked.backstopRadius;
    }
    if (isEmpty) failEmptyRegion(path / "region");
  }

  void failEmptyRegion(const Path& path) {
    model::Vec3 low = nodes_[0], high = nodes_[0];
    for (const model::Vec3& node : nodes_) {
      low = low.cwiseMin(node);
      high = high.cwiseMax(node);
    }
    checks_.fail(
        path, "",
        fmt::format("contains no node of the cloth, which is between ({:.4g} {:.4g} {:.4g}) and ({:.4g} "
                    "{:.4g} {:.4g}) at rest: move the region, or make it larger",
                    low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
  }

  // Joints alone move a node that follows them exactly.
  void checkHeld() {
    const std::vector<std::uint8_t> held = model::pinnedNodes(cloth_);  // the cloth has no skin yet
    for (std::size_t node = 0; node < held.size(); ++node)
      if (held[node] != 0 && skin_.limits[node].followsExactly())
        return checks_.fail(
            path_, "",
            fmt::format("has node {}, which follows its joints exactly (maxDistance 0), and which "
                        "is pinned or attached: remove one of the two",
                        node));
  }

  Checks& checks_;
  const Path& path_;
  const v1::ClothSkin& message_;
  const model::Cloth& cloth_;
  const ClothVertices& vertices_;
  std::size_t vertexCount_;         // of the message or file
  std::vector<model::Vec3> nodes_;  // at rest
  model::ClothSkin skin_;
};

}  // namespace

std::shared_ptr<const model::ClothSkin> toClothSkin(Checks& checks, const Path& path,
                                                    const v1::ClothSkin& message,
                                                    const std::vector<model::Collider>& colliders,
                                                    const model::Cloth& cloth, const ClothVertices& vertices,
                                                    const model::Cancellation& cancellation) {
  return ClothSkinReader(checks, path, message, cloth, vertices).read(colliders, cancellation);
}

void write(const model::ClothSkin& skin, v1::ClothSkin& message) {
  message.Clear();
  message.set_collider(skin.collider);
  for (const model::VertexJoints& node : skin.joints) {
    message.mutable_vertex_joints()->Add(node.joints.begin(), node.joints.end());
    message.mutable_vertex_weights()->Add(node.weights.begin(), node.weights.end());
  }
  const auto any = [&](auto has) { return std::ranges::any_of(skin.limits, has); };
  if (any([](const SkinLimits& limits) { return limits.maxDistance < SkinLimits::kUnbounded; }))
    for (const SkinLimits& limits : skin.limits)
      message.add_max_distances(limits.maxDistance < SkinLimits::kUnbounded ? limits.maxDistance : kAsLimits);
  if (any([](const SkinLimits& limits) { return limits.backstopDistance != 0; }))
    for (const SkinLimits& limits : skin.limits) message.add_backstop_distances(limits.backstopDistance);
  if (any([](const SkinLimits& limits) { return limits.backstopRadius != 0; }))
    for (const SkinLimits& limits : skin.limits) message.add_backstop_radii(limits.backstopRadius);
}

}  // namespace clothstream::messages

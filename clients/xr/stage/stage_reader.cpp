// SPDX-License-Identifier: MIT
#include "clients/xr/stage/stage_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>

#include "clients/xr/stage/fabrics.h"
#include "clients/xr/stage/solids.h"
#include "clients/xr/stage/topology.h"

namespace clothstream::xr {
namespace {

constexpr std::uint32_t kTopologyEvents = CS_EVENT_DESCRIPTION;
constexpr std::uint32_t kMaterialEvents = CS_EVENT_PARAMETERS | CS_EVENT_DESCRIPTION;
constexpr std::uint32_t kPeopleEvents = CS_EVENT_PARTICIPANTS | CS_EVENT_PRESENCE | CS_EVENT_RETURNED;
constexpr float kOwnOpacity = 0.16F;
// A hull has at most this number of corners, and is drawn slightly smaller than it is, because triangles
// between nodes that touch it cut into it. More are those of a mesh, which is drawn smooth and in its true
// size.
constexpr std::uint32_t kMostHullCorners = 128;
constexpr float kShrink = 0.985F;
constexpr std::uint32_t kStone = 0x9a958c;
constexpr float kLabelHeight = 0.16F;  // m above the middle of the head, in addition to its radius
constexpr float kSwing = 0.3F;         // expected motion of a cloth, as a fraction of its size

Ink inkOf(const Colour& colour) {
  const auto byte = [](float linear) {
    const float encoded =
        linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(encoded, 0.0F, 1.0F)));
  };
  return {byte(colour.x()), byte(colour.y()), byte(colour.z()), 255};
}

Surface stone(bool faceted) {
  Surface surface;
  surface.colour = fromSrgb(kStone);
  surface.roughness = 0.6F;
  surface.reflection = 0.2F;
  surface.faceted = faceted;
  return surface;
}

// Radius of a sphere around a collider that is neither plane nor hull.
float reachOf(const cs_collider& collider) {
  switch (collider.shape) {
    case CS_SHAPE_SPHERE:
      return collider.radius;
    case CS_SHAPE_CAPSULE:
      return std::max(collider.radius, collider.top_radius) + collider.length / 2;
    case CS_SHAPE_BOX:
      return std::hypot(collider.size[0], collider.size[1], collider.size[2]) / 2;
    default:
      return 0;
  }
}

}  // namespace

StageReader::StageReader(TextPainter& painter) : painter_(painter) {}

void StageReader::read(cs_client* client, std::uint32_t events, bool drawsOwn, Stage& stage) {
  const bool isNew = (events & kTopologyEvents) != 0 || stage.topology == 0 || !describes(client);
  if (isNew) readTopology(client, stage);
  if (isNew || (events & kMaterialEvents) != 0) readMaterials(client, stage);
  if (isNew || (events & kPeopleEvents) != 0) readPeople(client);
  readNodes(client, stage);
  readHulls(client, !drawsOwn, stage);
  readColliders(client, drawsOwn, stage);
}

// Returns whether the client still has the description that was read. The event of a new one can come a frame
// late.
bool StageReader::describes(const cs_client* client) const {
  std::uint32_t indexCount = 0;
  const std::uint32_t* triangles = cs_triangles(client, &indexCount);
  return triangles == triangles_ && indexCount == indexCount_ && cs_vertex_count(client) == vertexCount_;
}

void StageReader::readTopology(const cs_client* client, Stage& stage) {
  triangles_ = cs_triangles(client, &indexCount_);
  vertexCount_ = cs_vertex_count(client);
  hulls_.clear();
  parts_.clear();
  stage.topology = ++topology_;
  stage.nodeCount = stage.clothNodeCount = 0;
  stage.vertices.clear();
  stage.indices.clear();
  stage.fanStarts.clear();
  stage.fans.clear();
  stage.parts.clear();
  stage.frames.assign(1, Pose());
  for (std::uint32_t i = 0; i < cs_cloth_count(client); ++i) readCloth(client, i, stage);
  stage.clothNodeCount = stage.nodeCount;
  for (std::uint32_t i = 0; i < cs_collider_count(client); ++i) readHull(client, i, stage);
  stage.positions.resize(std::size_t{3} * stage.nodeCount);
  readBounds(client, stage);
}

void StageReader::readCloth(const cs_client* client, std::uint32_t index, Stage& stage) {
  cs_cloth cloth;
  if (cs_get_cloth(client, index, &cloth) == 0) return;
  std::uint32_t uvCount = 0, uvIndexCount = 0;
  const float* uvs = cs_uvs(client, index, &uvCount);
  const std::uint32_t* uvIndices = cs_uv_indices(client, index, &uvIndexCount);
  const auto firstIndex = static_cast<std::uint32_t>(stage.indices.size());
  Shape shape{.firstNode = cloth.first_vertex,
              .nodeCount = cloth.vertex_count,
              .rows = cloth.rows,
              .columns = cloth.columns,
              .positions = {cs_positions(client) + std::size_t{3} * cloth.first_vertex,
                            std::size_t{3} * cloth.vertex_count},
              .corners = {triangles_ + cloth.first_index, cloth.index_count},
              .uvs = {},
              .uvIndices = {}};
  if (uvs != nullptr && uvIndices != nullptr && uvIndexCount == cloth.index_count) {
    shape.uvs = {uvs, std::size_t{2} * uvCount};
    shape.uvIndices = {uvIndices, uvIndexCount};
  }
  const bool woven = append(shape, stage);
  const std::uint32_t submeshes = cs_submesh_count(client, index);
  for (std::uint32_t i = 0; i < std::max(1U, submeshes); ++i) {
    MeshPart part{.firstIndex = firstIndex, .indexCount = cloth.index_count};
    cs_submesh submesh;
    if (submeshes > 0 && cs_get_submesh(client, index, i, &submesh) != 0) {
      part.firstIndex = firstIndex + submesh.first_index - cloth.first_index;
      part.indexCount = submesh.index_count;
    }
    stage.parts.push_back(part);
    parts_.push_back({index, index + 2 * i, woven});
  }
}

void StageReader::readHull(const cs_client* client, std::uint32_t index, Stage& stage) {
  cs_collider collider;
  if (cs_get_collider(client, index, &collider) == 0 || collider.participant_id != 0 ||
      collider.shape != CS_SHAPE_HULL)
    return;
  std::uint32_t vertexCount = 0, indexCount = 0;
  const std::uint32_t* triangles = nullptr;
  const float* corners = cs_get_hull(client, index, &vertexCount, &triangles, &indexCount);
  if (corners == nullptr || indexCount == 0) return;
  const bool isHull = vertexCount <= kMostHullCorners;
  // The triangles without the head come first, so that the head can be left out.
  using Triangle = std::array<std::uint32_t, 3>;
  std::vector<std::uint32_t> sorted;
  std::uint32_t belowCount = 0;
  const std::uint32_t* below = cs_body_below_neck(client, index, &belowCount);
  std::set<Triangle> isBelow;
  for (std::uint32_t i = 0; i + 2 < belowCount; i += 3) {
    isBelow.insert({below[i], below[i + 1], below[i + 2]});
    for (std::uint32_t k = 0; k < 3; ++k) sorted.push_back(stage.nodeCount + below[i + k]);
  }
  const auto bodyCount = static_cast<std::uint32_t>(sorted.size());
  for (std::uint32_t i = 0; i + 2 < indexCount; i += 3)
    if (!isBelow.contains(Triangle{triangles[i], triangles[i + 1], triangles[i + 2]}))
      for (std::uint32_t k = 0; k < 3; ++k) sorted.push_back(stage.nodeCount + triangles[i + k]);

  Hull hull{.collider = index,
            .firstNode = stage.nodeCount,
            .nodeCount = vertexCount,
            .frame = static_cast<std::uint32_t>(stage.frames.size()),
            .shrink = isHull ? kShrink : 1,
            .headPart = std::nullopt,
            .name = collider.name};
  const auto firstIndex = static_cast<std::uint32_t>(stage.indices.size());
  append({.firstNode = stage.nodeCount,
          .nodeCount = vertexCount,
          .positions = {corners, std::size_t{3} * vertexCount},
          .corners = sorted,
          .uvs = {},
          .uvIndices = {}},
         stage);
  stage.frames.emplace_back();
  const auto addPart = [&](std::uint32_t first, std::uint32_t count) {
    stage.parts.push_back({.firstIndex = firstIndex + first,
                           .indexCount = count,
                           .surface = stone(isHull),
                           .frame = hull.frame});
  };
  if (bodyCount > 0) addPart(0, bodyCount);
  if (bodyCount < sorted.size()) {
    if (bodyCount > 0) hull.headPart = static_cast<std::uint32_t>(stage.parts.size());
    addPart(bodyCount, static_cast<std::uint32_t>(sorted.size()) - bodyCount);
  }
  hulls_.push_back(hull);
}

// Box in which the cloths will mostly stay, with the colliders of the scene; and the floor, which is y = 0 if
// the box ends near it, and else its lower end.
void StageReader::readBounds(const cs_client* client, Stage& stage) const {
  Eigen::AlignedBox3f box;
  const float* rest = cs_positions(client);
  for (std::uint32_t i = 0; i < cs_cloth_count(client); ++i) {
    cs_cloth cloth;
    if (cs_get_cloth(client, i, &cloth) == 0) continue;
    Eigen::AlignedBox3f reach;
    for (std::uint32_t v = cloth.first_vertex; v < cloth.first_vertex + cloth.vertex_count; ++v)
      reach.extend(Eigen::Map<const Eigen::Vector3f>(rest + std::size_t{3} * v));
    const Eigen::Vector3f size = reach.sizes();
    const float swing = kSwing * size.maxCoeff();
    const float side = size.y() > swing ? swing / 2 : 0;
    reach.min() -= Eigen::Vector3f(0, swing, side);
    reach.max().z() += side;
    box.extend(reach);
  }
  for (std::uint32_t i = 0; i < cs_collider_count(client); ++i) {
    cs_collider collider;
    if (cs_get_collider(client, i, &collider) == 0 || collider.participant_id != 0) continue;
    const Eigen::Vector3f middle(collider.position[0], collider.position[1], collider.position[2]);
    const float reach = reachOf(collider);
    if (reach == 0) continue;
    box.extend(Eigen::AlignedBox3f(middle.array() - reach, middle.array() + reach));
  }
  for (const Hull& hull : hulls_) {
    cs_collider collider;
    std::uint32_t vertexCount = 0, indexCount = 0;
    const std::uint32_t* triangles = nullptr;
    const float* corners = cs_get_hull(client, hull.collider, &vertexCount, &triangles, &indexCount);
    if (corners == nullptr || cs_get_collider(client, hull.collider, &collider) == 0) continue;
    const Pose pose = poseOf(collider);
    for (std::uint32_t i = 0; i < vertexCount; ++i)
      box.extend(pose.apply(Eigen::Map<const Eigen::Vector3f>(corners + std::size_t{3} * i)));
  }
  if (box.isEmpty()) box = Eigen::AlignedBox3f(Eigen::Vector3f(-1, 0, -1), Eigen::Vector3f(1, 2, 1));
  const float size = box.diagonal().norm();
  stage.floor = std::abs(box.min().y()) < 0.5F * size ? 0 : box.min().y();
  box.min().y() = std::max(box.min().y(), stage.floor);
  stage.centre = box.center();
  stage.radius = std::max(0.1F, 0.5F * box.diagonal().norm());
}

void StageReader::readMaterials(const cs_client* client, Stage& stage) const {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Surface surface = surfaceOf(cs_cloth_material(client, parts_[i].cloth), parts_[i].dye);
    surface.woven = parts_[i].woven;
    stage.parts[i].surface = surface;
  }
}

void StageReader::readPeople(const cs_client* client) {
  std::unordered_map<std::uint64_t, Person> people;
  for (std::uint32_t i = 0; i < cs_participant_count(client); ++i) {
    cs_participant participant;
    if (cs_get_participant(client, i, &participant) == 0) continue;
    Person& person = people[participant.id];
    const auto known = people_.find(participant.id);
    if (known != people_.end() && known->second.name == participant.name) {
      person = known->second;
      continue;
    }
    person.name = participant.name;
    if (!person.name.empty()) person.picture = painter_.label(person.name, inkOf(colourOf(participant.id)));
  }
  people_ = std::move(people);
}

void StageReader::readNodes(const cs_client* client, Stage& stage) const {
  const std::size_t count = std::size_t{3} * vertexCount_;
  if (count == 0) return;
  std::copy_n(cs_played_positions(client), count, stage.positions.begin());
  if (cs_sends_normals(client) != 0) {
    const float* normals = cs_played_normals(client);
    stage.normals.assign(normals, normals + count);
  } else {
    stage.normals.clear();
  }
}

void StageReader::readHulls(const cs_client* client, bool hidesOwnHead, Stage& stage) const {
  const std::string_view worn = hulls_.empty() ? "" : cs_body_of(client, cs_participant_id(client));
  for (const Hull& hull : hulls_) {
    cs_collider collider;
    std::uint32_t vertexCount = 0, indexCount = 0;
    const std::uint32_t* triangles = nullptr;
    const float* corners = cs_get_hull(client, hull.collider, &vertexCount, &triangles, &indexCount);
    if (corners == nullptr || vertexCount != hull.nodeCount) continue;
    float* out = &stage.positions[std::size_t{3} * hull.firstNode];
    for (std::size_t i = 0; i < std::size_t{3} * vertexCount; ++i) out[i] = hull.shrink * corners[i];
    if (hull.headPart) stage.parts[*hull.headPart].visible = !hidesOwnHead || worn != hull.name;
    if (cs_get_played_collider(client, hull.collider, &collider) == 0) continue;
    stage.frames[hull.frame] = poseOf(collider);
  }
}

void StageReader::readColliders(const cs_client* client, bool drawsOwn, Stage& stage) {
  stage.solids.clear();
  stage.labels.clear();
  const std::uint64_t self = cs_participant_id(client);
  for (std::uint32_t i = 0; i < cs_played_collider_count(client); ++i) {
    cs_collider collider;
    if (cs_get_played_collider(client, i, &collider) == 0) continue;
    const std::uint64_t id = collider.participant_id;
    if (id == 0) {
      addSceneCollider(collider, stage.solids);
      continue;
    }
    const bool isOwn = id == self;
    if (isOwn && (isHead(collider) || !drawsOwn)) continue;
    if (isHead(collider)) addLabel(collider, stage);
    // Head and hands are drawn as parts of the body.
    if (*cs_body_of(client, id) != '\0') continue;
    addParticipantCollider(collider, colourOf(id), isOwn ? kOwnOpacity : 1, stage.solids);
  }
}

void StageReader::addLabel(const cs_collider& head, Stage& stage) {
  const auto person = people_.find(head.participant_id);
  if (person == people_.end() || !person->second.picture) return;
  stage.labels.push_back({head.participant_id,
                          {head.position[0], head.position[1] + head.radius + kLabelHeight, head.position[2]},
                          person->second.picture});
}

}  // namespace clothstream::xr

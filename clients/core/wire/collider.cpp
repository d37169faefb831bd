// SPDX-License-Identifier: MIT
// Reads a ColliderState, its shape and its hull.
#include "clients/core/wire/collider.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace clothstream::client {
namespace {

// Appends the triangles of a face as a fan around its first corner.
bool readFace(Bytes message, std::vector<std::uint32_t>& triangles) {
  using F = field::Face;
  std::vector<std::uint32_t> corners;
  const bool read = readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kVertices.tag) return readPackedVarints(reader.get_view(), kMaxHullParts, corners);
    // A sender may leave a repeated number unpacked.
    if (tag != varint(F::kVertices.number)) return skip(reader);
    corners.push_back(reader.get_uint32());
    return corners.size() <= kMaxHullParts;
  });
  for (std::size_t i = 2; i < corners.size(); ++i)
    triangles.insert(triangles.end(), {corners[0], corners[i - 1], corners[i]});
  return read;
}

bool cornersExist(const Hull& hull) {
  return std::all_of(hull.triangles.begin(), hull.triangles.end(),
                     [&](std::uint32_t corner) { return corner < hull.vertices.size() / 3; });
}

// Copies little-endian numbers, `each` of at most `most` elements.
template <typename Number>
bool copy(Bytes bytes, std::size_t each, std::size_t most, std::vector<Number>& numbers) {
  const std::size_t element = each * sizeof(Number);
  if (bytes.size() % element != 0 || bytes.size() / element > most) return false;
  numbers.resize(bytes.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), bytes.size());
  return true;
}

bool copyJoints(Bytes bytes, std::vector<float>& joints) {
  return copy(bytes, kJointNumbers, kMaxJoints, joints) &&
         std::all_of(joints.begin(), joints.end(), [](float number) { return std::isfinite(number); });
}

}  // namespace

bool readRound(Bytes message, Collider& collider) {
  using F = field::Capsule;
  static_assert(field::Sphere::kRadius.tag == F::kRadius.tag);
  std::optional<float> topRadius;
  const bool read = readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kRadius.tag) return setFinite(collider.radius, reader);
    if (tag == F::kTopRadius.tag) return setFinite(topRadius, reader);
    return tag == F::kLength.tag ? setFinite(collider.length, reader) : skip(reader);
  });
  collider.topRadius = topRadius.value_or(collider.radius);
  return read;
}

bool readBox(Bytes message, Vec3& size) {
  using F = field::Box;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    return tag == F::kSize.tag ? readVec3(reader.get_view(), size) : skip(reader);
  });
}

bool readCollider(Bytes message, Collider& collider) {
  using F = field::ColliderState;
  collider.name.clear();
  collider.position = {};
  collider.orientation = {0, 0, 0, 1};
  collider.shape = CS_SHAPE_HULL;
  collider.radius = collider.length = collider.topRadius = 0;
  collider.size = {};
  collider.hull = collider.mesh = {};
  collider.joints.clear();
  collider.participantId = 0;
  collider.yields = false;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kName.tag:
        return setText(collider.name, reader);
      case F::kPosition.tag:
        return readVec3(reader.get_view(), collider.position);
      case F::kOrientation.tag: {
        if (!readFloats(reader.get_view(), collider.orientation)) return false;
        // All zero means no rotation (scene.proto).
        if (collider.orientation == std::array<float, 4>{}) collider.orientation[3] = 1;
        return true;
      }
      case F::kParticipantId.tag:
        return set(collider.participantId, reader.get_uint64());
      case F::kSphere.tag:
        return set(collider.shape, CS_SHAPE_SPHERE) && readRound(reader.get_view(), collider);
      case F::kCapsule.tag:
        return set(collider.shape, CS_SHAPE_CAPSULE) && readRound(reader.get_view(), collider);
      case F::kPlane.tag:
        reader.skip();
        return set(collider.shape, CS_SHAPE_PLANE);
      case F::kBox.tag:
        return set(collider.shape, CS_SHAPE_BOX) && readBox(reader.get_view(), collider.size);
      case F::kHull.tag:
        return set(collider.shape, CS_SHAPE_HULL) && set(collider.hull, reader.get_view());
      case F::kMesh.tag:
        return set(collider.shape, CS_SHAPE_HULL) && set(collider.mesh, reader.get_view());
      case F::kJoints.tag:
        return copyJoints(reader.get_view(), collider.joints);
      case F::kYields.tag:
        return set(collider.yields, reader.get_bool());
      default:
        return skip(reader);
    }
  });
}

std::optional<Hull> readHull(Bytes message) {
  using F = field::ConvexHull;
  std::size_t faces = 0;
  std::optional<Hull> hull = readMessage<Hull>(message, [&](Hull& out, std::uint32_t tag, Reader& reader) {
    if (tag == F::kFaces.tag) return ++faces <= kMaxHullParts && readFace(reader.get_view(), out.triangles);
    if (tag != F::kVertices.tag) return skip(reader);
    Vec3 vertex{};
    if (!readVec3(reader.get_view(), vertex)) return false;
    out.vertices.insert(out.vertices.end(), vertex.begin(), vertex.end());
    return out.vertices.size() <= 3 * kMaxHullParts;
  });
  return hull && cornersExist(*hull) ? hull : std::nullopt;
}

std::optional<Hull> readMesh(Bytes message) {
  using F = field::ColliderMeshDescription;
  std::optional<Hull> mesh = readMessage<Hull>(message, [&](Hull& out, std::uint32_t tag, Reader& reader) {
    if (tag == F::kPositions.tag) return copy(reader.get_view(), 3, kMaxMeshVertices, out.vertices);
    if (tag == F::kJoints.tag)
      return copy(reader.get_view(), kVertexJoints, kMaxMeshVertices, out.skin.joints);
    if (tag == F::kWeights.tag)
      return copy(reader.get_view(), kVertexJoints, kMaxMeshVertices, out.skin.weights);
    if (tag == F::kRest.tag) return copyJoints(reader.get_view(), out.skin.rest);
    if (tag == F::kJointNames.tag)
      return out.skin.names.size() < kMaxJoints && setText(out.skin.names.emplace_back(), reader);
    if (tag == F::kJointParents.tag)
      return readPackedVarints(reader.get_view(), kMaxJoints, out.skin.parents);
    return tag == F::kTriangles.tag ? copy(reader.get_view(), 3, kMaxMeshTriangles, out.triangles)
                                    : skip(reader);
  });
  const auto isFinite = [](float coordinate) { return std::isfinite(coordinate); };
  const bool isComplete = mesh && cornersExist(*mesh) &&
                          std::all_of(mesh->vertices.begin(), mesh->vertices.end(), isFinite) &&
                          (mesh->skin.rest.empty() || mesh->skin.fits(mesh->vertices.size() / 3));
  return isComplete ? mesh : std::nullopt;
}

}  // namespace clothstream::client

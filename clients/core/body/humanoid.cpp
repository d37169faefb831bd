// SPDX-License-Identifier: MIT
#include "clients/core/body/humanoid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace clothstream::client::body {
namespace {

bool isUpper(char c) {
  return c >= 'A' && c <= 'Z';
}
bool isLetter(char c) {
  return isUpper(c) || (c >= 'a' && c <= 'z');
}

// Words of a name in lower case: letters between other characters, and from a capital that follows a small
// letter.
std::vector<std::string> wordsOf(std::string_view name) {
  std::vector<std::string> words;
  char before = ' ';
  for (const char c : name) {
    if (isLetter(c)) {
      if (!isLetter(before) || (isUpper(c) && !isUpper(before))) words.emplace_back();
      words.back() += isUpper(c) ? static_cast<char>(c - 'A' + 'a') : c;
    }
    before = c;
  }
  return words;
}

// Names of bones without side and separators.
constexpr auto kBoneNames = std::to_array<std::pair<std::string_view, BoneKind>>({
    {"hips", BoneKind::hips},       {"hip", BoneKind::hips},         {"pelvis", BoneKind::hips},
    {"head", BoneKind::head},       {"arm", BoneKind::upperArm},     {"upperarm", BoneKind::upperArm},
    {"forearm", BoneKind::forearm}, {"lowerarm", BoneKind::forearm}, {"hand", BoneKind::hand},
    {"wrist", BoneKind::hand},      {"thigh", BoneKind::thigh},      {"upleg", BoneKind::thigh},
    {"upperleg", BoneKind::thigh},  {"shin", BoneKind::shin},        {"leg", BoneKind::shin},
    {"lowerleg", BoneKind::shin},   {"calf", BoneKind::shin},        {"foot", BoneKind::foot},
    {"ankle", BoneKind::foot},
});
// Words that belong to the rig, not to the bone.
constexpr auto kRigWords = std::to_array<std::string_view>({"mixamorig", "j", "bip", "c", "def", "org"});

// Length of the forearm relative to the upper arm, for bodies without a joint at the wrist. Drillis and
// Contini, "Body Segment Parameters" (1966): 0.146 and 0.186 of the body's height.
constexpr double kForearmShare = 0.146 / 0.186;
// Height of the eyes relative to the body's height, from the same source.
constexpr double kEyeHeight = 0.936;
// Distance of the eyes from the front of the face, m.
constexpr double kBehindFace = 0.02;

using Found =
    std::array<std::array<std::optional<std::size_t>, 2>, 8>;  // by kind and side; the middle is at 0

Found findBones(const std::vector<std::string>& names) {
  Found found;
  for (std::size_t joint = 0; joint < names.size(); ++joint) {
    const std::optional<BoneName> bone = boneOf(names[joint]);
    if (!bone) continue;
    auto& place = found[static_cast<std::size_t>(bone->kind)][bone->side == Side::right ? 1 : 0];
    if (!place) place = joint;
  }
  return found;
}

using Parents = std::vector<std::optional<std::size_t>>;

bool isBelow(const Parents& parents, std::optional<std::size_t> joint, std::size_t ancestor) {
  while (joint && *joint != ancestor) joint = parents[*joint];
  return joint.has_value();
}

std::optional<LimbJoints> limbOf(const Found& found, const Parents& parents, std::size_t side, BoneKind upper,
                                 BoneKind lower, BoneKind end) {
  const auto at = [&](BoneKind kind) { return found[static_cast<std::size_t>(kind)][side]; };
  if (!at(upper) || !at(lower) || !isBelow(parents, parents[*at(lower)], *at(upper))) return std::nullopt;
  LimbJoints limb{.upper = *at(upper), .lower = *at(lower), .end = at(end)};
  if (limb.end && !isBelow(parents, parents[*limb.end], limb.lower)) limb.end.reset();
  return limb;
}

// Axis of the frame that is nearest to a direction.
Point nearestAxis(const Point& a) {
  const double x = std::abs(a.x), y = std::abs(a.y), z = std::abs(a.z);
  if (y >= x && y >= z) return {0, a.y < 0 ? -1.0 : 1.0, 0};
  if (x >= z) return {a.x < 0 ? -1.0 : 1.0, 0, 0};
  return {0, 0, a.z < 0 ? -1.0 : 1.0};
}

Point vertexAt(const Hull& mesh, std::size_t vertex) {
  return {mesh.vertices[3 * vertex], mesh.vertices[3 * vertex + 1], mesh.vertices[3 * vertex + 2]};
}

// Share of a vertex that joints at and below `ancestor` move.
double shareOf(const Hull& mesh, const Parents& parents, std::size_t vertex, std::size_t ancestor) {
  double share = 0;
  for (std::size_t k = kVertexJoints * vertex; k < kVertexJoints * (vertex + 1); ++k)
    if (mesh.skin.weights[k] > 0 && isBelow(parents, std::size_t{mesh.skin.joints[k]}, ancestor))
      share += static_cast<double>(mesh.skin.weights[k]);
  return share;
}

// Sum of the ways from the ankles to the vertices of the feet: it points to the toes.
Point wayToToes(const Hull& mesh, const Parents& parents, const std::vector<Frame>& rest,
                const std::array<LimbJoints, 2>& legs) {
  Point way;
  for (const LimbJoints& leg : legs)
    for (std::size_t vertex = 0; vertex < mesh.vertices.size() / 3; ++vertex)
      if (const double share = shareOf(mesh, parents, vertex, *leg.end); share > 0.5)
        way = way + (vertexAt(mesh, vertex) - rest[*leg.end].position);
  return way;
}

// Sizes of the body, in its own frame.
void measure(Humanoid& body, const Hull& mesh) {
  const Rotation turn = inverse(body.toCollider);
  double low = std::numeric_limits<double>::max(), high = -low, face = low;
  for (std::size_t vertex = 0; vertex < mesh.vertices.size() / 3; ++vertex) {
    const Point p = turn * vertexAt(mesh, vertex);
    low = std::min(low, p.y);
    high = std::max(high, p.y);
    if (shareOf(mesh, body.parents, vertex, body.head) > 0.5) face = std::min(face, p.z);
  }
  const Point& head = body.rest[body.head].position;
  body.floor = low;
  body.height = high - low;
  if (face > head.z) face = head.z;
  body.eyes = {0, low + kEyeHeight * body.height - head.y, std::min(face + kBehindFace, head.z) - head.z};
  for (const Side side : kSides) {
    const LimbJoints& arm = body.arms[static_cast<std::size_t>(side)];
    const Point& elbow = body.rest[arm.lower].position;
    body.forearms[static_cast<std::size_t>(side)] =
        arm.end ? length(body.rest[*arm.end].position - elbow)
                : kForearmShare * length(elbow - body.rest[arm.upper].position);
  }
}

bool hasLengths(const Humanoid& body) {
  const auto distance = [&](std::size_t a, std::size_t b) {
    return length(body.rest[a].position - body.rest[b].position);
  };
  constexpr double kLeast = 0.01;  // m; a shorter bone has no direction that means something
  bool has = body.rest[body.head].position.y - body.rest[body.hips].position.y > kLeast;
  for (std::size_t side = 0; side < 2; ++side) {
    has = has && distance(body.arms[side].upper, body.arms[side].lower) > kLeast &&
          body.forearms[side] > kLeast;
    if (body.legs)
      has = has && distance((*body.legs)[side].upper, (*body.legs)[side].lower) > kLeast &&
            distance((*body.legs)[side].lower, *(*body.legs)[side].end) > kLeast;
  }
  return has;
}

}  // namespace

std::optional<BoneName> boneOf(std::string_view jointName) {
  if (const std::size_t colon = jointName.rfind(':'); colon != std::string_view::npos)
    jointName.remove_prefix(colon + 1);
  std::optional<Side> side;
  std::string bone;
  for (const std::string& word : wordsOf(jointName)) {
    if (word == "left" || word == "l")
      side = Side::left;
    else if (word == "right" || word == "r")
      side = Side::right;
    else if (std::find(kRigWords.begin(), kRigWords.end(), word) == kRigWords.end())
      bone += word;
  }
  // Names in small letters without separators: leftarm.
  for (const auto& [prefix, ofPrefix] : {std::pair("left", Side::left), std::pair("right", Side::right)})
    if (!side && bone.starts_with(prefix)) {
      side = ofPrefix;
      bone.erase(0, std::string_view(prefix).size());
    }
  const auto known = std::find_if(kBoneNames.begin(), kBoneNames.end(),
                                  [&](const auto& name) { return name.first == bone; });
  if (known == kBoneNames.end()) return std::nullopt;
  const bool isMiddle = known->second == BoneKind::hips || known->second == BoneKind::head;
  if (isMiddle == side.has_value()) return std::nullopt;
  return BoneName{known->second, side};
}

std::optional<Humanoid> findHumanoid(const Hull& mesh) {
  const std::size_t count = mesh.skin.jointCount();
  if (count == 0 || mesh.skin.names.size() != count || mesh.skin.parents.size() != count) return std::nullopt;
  Humanoid body;
  for (std::size_t joint = 0; joint < count; ++joint) {
    const std::uint32_t up = mesh.skin.parents[joint];
    body.parents.push_back(up == 0 ? std::nullopt : std::optional<std::size_t>(up - 1));
    body.rest.push_back(frameOf(mesh.skin.rest.data() + kJointNumbers * joint));
  }
  const Found found = findBones(mesh.skin.names);
  const auto hips = found[static_cast<std::size_t>(BoneKind::hips)][0];
  const auto head = found[static_cast<std::size_t>(BoneKind::head)][0];
  if (!hips || !head || !isBelow(body.parents, body.parents[*head], *hips)) return std::nullopt;
  body.hips = *hips;
  body.head = *head;
  std::array<std::optional<LimbJoints>, 2> arms, legs;
  for (std::size_t side = 0; side < 2; ++side) {
    arms[side] = limbOf(found, body.parents, side, BoneKind::upperArm, BoneKind::forearm, BoneKind::hand);
    legs[side] = limbOf(found, body.parents, side, BoneKind::thigh, BoneKind::shin, BoneKind::foot);
    if (!arms[side] || !isBelow(body.parents, arms[side]->upper, body.hips)) return std::nullopt;
    if (legs[side] && (!legs[side]->end || !isBelow(body.parents, legs[side]->upper, body.hips)))
      legs[side].reset();
  }
  body.arms = {*arms[0], *arms[1]};
  if (legs[0] && legs[1]) body.legs = {*legs[0], *legs[1]};
  for (std::size_t joint = *body.parents[body.head]; joint != body.hips; joint = *body.parents[joint])
    body.spine.insert(body.spine.begin(), joint);
  body.spine.insert(body.spine.begin(), body.hips);
  const auto above = std::find_if(body.spine.begin(), body.spine.end(), [&](std::size_t joint) {
    return !isBelow(body.parents, body.arms[0].upper, joint) &&
           !isBelow(body.parents, body.arms[1].upper, joint);
  });
  body.neck = above == body.spine.end() ? body.head : *above;

  const auto place = [&](std::size_t joint) { return body.rest[joint].position; };
  const Point up = nearestAxis(place(body.head) - place(body.hips));
  const Point toLeft = across(place(body.arms[0].upper) - place(body.arms[1].upper), up);
  if (length(toLeft) < 0.01) return std::nullopt;
  Point right = direction(-1.0 * toLeft, {1, 0, 0});
  Point back = cross(right, up);
  if (body.legs && dot(wayToToes(mesh, body.parents, body.rest, *body.legs), back) > 0) {
    // The names call the right side left.
    right = -1.0 * right;
    back = -1.0 * back;
    std::swap(body.arms[0], body.arms[1]);
    std::swap((*body.legs)[0], (*body.legs)[1]);
  }
  body.toCollider = basis(right, up);
  const Rotation turn = inverse(body.toCollider);
  for (Frame& frame : body.rest) frame = {turn * frame.rotation, turn * frame.position};
  measure(body, mesh);
  return hasLengths(body) ? std::optional(std::move(body)) : std::nullopt;
}

std::vector<std::uint32_t> trianglesBelowNeck(const Humanoid& humanoid, const Hull& mesh) {
  std::vector<bool> hidden(mesh.vertices.size() / 3);
  for (std::size_t vertex = 0; vertex < hidden.size(); ++vertex)
    hidden[vertex] = shareOf(mesh, humanoid.parents, vertex, humanoid.neck) > 0.5;
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    const auto begin = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::none_of(begin, begin + 3, [&](std::uint32_t corner) { return hidden[corner]; }))
      corners.insert(corners.end(), begin, begin + 3);
  }
  return corners;
}

}  // namespace clothstream::client::body

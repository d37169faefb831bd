// SPDX-License-Identifier: MIT
// What is drawn in one frame, as plain data. Coordinates are those of the scene: metres, +Y up. A Stage is
// kept from frame to frame, so that its lists keep their memory.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "clients/xr/geometry/pose.h"
#include "clients/xr/text/picture.h"

namespace clothstream::xr {

// Colours are linear, red green blue, 0 to 1.
using Colour = Eigen::Vector3f;

// Colour of 0xRRGGBB in sRGB encoding.
Colour fromSrgb(std::uint32_t rgb);

// This is seen where nothing is drawn.
enum class Background : std::uint32_t {
  kRoom = 0,  // a floor that fades into a bright room; for VR
  kTransparent =
      1,         // alpha 0, and colours multiplied with alpha; the floor only darkens where it is in shadow
  kAdditive = 2  // black, for displays that add light to the real room; no floor
};

// Surface of a cloth or of a solid. The numbers are those of the page (clients/web/three).
struct Surface {
  Colour colour{0.6F, 0.6F, 0.6F};
  float roughness = 0.8F;
  float sheen = 0, sheenRoughness = 0.5F;
  float reverse = 1;        // brightness of the back compared with the front
  float translucency = 0;   // part of the light from behind that shines through
  float relief = 0;         // strength of the weave's normals
  float reflection = 0.5F;  // strength of reflections of the surroundings
  std::uint32_t weave = 0;  // index of the weave (render/weave.h); used by meshes with texture coordinates
  bool woven = false;       // has texture coordinates
  bool faceted = false;     // flat faces, as of a convex hull
};

// A range of triangles with one surface, of a cloth or of a collider that is a hull.
struct MeshPart {
  std::uint32_t firstIndex = 0, indexCount = 0;  // in Stage::indices
  Surface surface{};
  bool visible = true;      // else it only casts a shadow
  std::uint32_t frame = 0;  // index in Stage::frames
};

// A vertex that is drawn. Vertices at seams of texture coordinates share their node.
struct DrawnVertex {
  std::uint32_t node = 0;
  float u = 0, v = 0;  // texture coordinates, m of cloth
};

enum class SolidKind : std::uint32_t {
  kCapsule = 0,  // also tapered ones, and spheres, whose length is 0
  kBox = 1,
  kPlane = 2  // the half-space below y = 0 of its frame; drawn as a disk
};

// A solid seems to be made of this.
enum class Substance : std::uint32_t {
  kPlain = 0,
  kCeramic = 1,
  kWood = 2,
  kPlaster = 3,
  kStone = 4,
  kGlowing = 5
};

// A sphere, capsule, box or plane: a collider, a part of a hand or head, a controller, a ray.
struct Solid {
  SolidKind kind = SolidKind::kCapsule;
  Substance substance = Substance::kPlain;
  Pose pose;
  float radius = 0, topRadius = 0, length = 0;        // of a capsule, along Y; topRadius is at +Y
  Eigen::Vector3f size = Eigen::Vector3f::Zero();     // edges of a box
  Eigen::Vector3f stretch = Eigen::Vector3f::Ones();  // factors along the axes of the frame
  Colour colour{0.6F, 0.6F, 0.6F};
  float roughness = 0.55F, reflection = 0.3F;
  float opacity = 1;       // below 1: drawn after all others, and casts no shadow
  bool hidesOnly = false;  // hides what is behind it, and has no colour: a real hand in pass-through
};

// A name that faces the viewer.
struct Label {
  std::uint64_t id = 0;                                // of the participant
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  // middle
  std::shared_ptr<const Picture> picture;
};

// The panel in space, a rectangle in the plane z = 0 of its frame, with its front to +Z.
struct PanelQuad {
  bool visible = false;
  Pose pose;
  Eigen::Vector2f size = Eigen::Vector2f::Zero();  // m
  const Picture* picture = nullptr;                // of the Panel; at most kPanelTexels
};
inline constexpr std::array<std::uint32_t, 2> kPanelTexels{1024, 1280};

struct Stage {
  // Changes with the lists in this paragraph; never 0 with them. Renderer::upload() copies them.
  std::uint64_t topology = 0;
  std::uint32_t nodeCount = 0;  // cloth vertices first, then corners of hulls
  std::uint32_t clothNodeCount = 0;
  std::vector<DrawnVertex> vertices;
  std::vector<std::uint32_t> indices;  // of `vertices`, 3 per triangle
  // Faces around each node for its normal, as in proto/codec/vertex_normals.h: the sum of (c - p) x (b - a).
  // The faces of node n are fans[fanStarts[n]] to fans[fanStarts[n + 1] - 1].
  struct Face {
    std::uint32_t a = 0, c = 0, b = 0;
  };
  std::vector<std::uint32_t> fanStarts;  // nodeCount + 1
  std::vector<Face> fans;

  // The rest changes from frame to frame.
  std::vector<float> positions;  // 3 per node; corners of hulls in the frames of their colliders
  std::vector<float> normals;    // 3 per cloth node if the server sends them; else empty: they are computed
  std::vector<Pose> frames;      // the first is that of the scene; the others are those of hulls
  std::vector<MeshPart> parts;   // the number of parts belongs to the topology
  std::vector<Solid> solids;     // colliders and other participants, filled by StageReader
  std::vector<Solid> own;        // own hands, controllers, rays; filled by the program
  std::vector<Label> labels;
  PanelQuad panel;
  Background background = Background::kRoom;
  float floor = 0;  // height, m
  // Sphere in which the cloths mostly stay. The shadow map covers it.
  Eigen::Vector3f centre = Eigen::Vector3f(0, 1, 0);
  float radius = 2;
};

}  // namespace clothstream::xr

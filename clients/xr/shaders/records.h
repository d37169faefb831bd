// SPDX-License-Identifier: MIT
// Structs that C++ and the shaders share, in the layout std430 (std140 for Frame). Compiled as both.
#ifndef CLOTHSTREAM_XR_SHADERS_RECORDS_H
#define CLOTHSTREAM_XR_SHADERS_RECORDS_H

#ifdef __cplusplus
#include <Eigen/Core>
#include <cstdint>
namespace clothstream::xr::shaders {
using uint = std::uint32_t;
using vec4 = Eigen::Matrix<float, 4, 1, Eigen::DontAlign>;
using mat4 = Eigen::Matrix<float, 4, 4, Eigen::DontAlign>;
#endif

// Bindings of the one descriptor set.
const uint kFrameBinding = 0;
const uint kPositionsBinding = 1;
const uint kNormalsBinding = 2;
const uint kVerticesBinding = 3;
const uint kFanStartsBinding = 4;
const uint kFansBinding = 5;
const uint kPartsBinding = 6;
const uint kSolidsBinding = 7;
const uint kQuadsBinding = 8;
const uint kShadowDepthsBinding = 9;
const uint kShadowBinding = 10;
const uint kWeaveColoursBinding = 11;
const uint kWeaveReliefsBinding = 12;
const uint kPanelBinding = 13;
const uint kLabelsBinding = 14;
const uint kBindings = 15;

// Workgroup size of gather_normals.comp.
const uint kNodesPerGroup = 64;

// Values of Frame.background.
const uint kBackgroundRoom = 0;
const uint kBackgroundTransparent = 1;
const uint kBackgroundAdditive = 2;

// Everything that is the same for a whole frame. The arrays of two have one element per view.
struct Frame {
  mat4 viewProjection[2];
  mat4 unproject[2];  // inverse of viewProjection
  vec4 eyes[2];       // m
  mat4 shadow;        // from the scene to the shadow map: texture coordinates, and depth 0 to 1
  vec4 keyDirection;  // from the scene to the light, length 1
  vec4 keyLight;      // irradiance; w: length by which lookups of shadows are moved along the normal, m
  vec4 rimDirection;
  vec4 rimLight;
  vec4 irradiance[9];  // spherical harmonics of the surroundings
  vec4 skyAbove;
  vec4 skyLevel;
  vec4 skyBelow;
  vec4 skyKey;  // radiance of the window towards the key light
  vec4 skyRim;
  vec4 floorMiddle;  // xyz: middle of the floor; w: radius at which it has faded
  vec4 floorColour;  // w: distance between its lines, m
  vec4 outside;      // colour that the floor fades into
  vec4 zenith;
  float exposure;
  uint background;
  uint encodes;  // 1: the target has no sRGB encoding, so the shaders encode
  uint reserved;
};

// A range of triangles with one surface (MeshPart).
struct PartRecord {
  mat4 model;
  vec4 colour;  // w: roughness
  vec4 sheen;   // x: strength, y: roughness, z: brightness of the back, w: translucency
  vec4
      look;  // x: strength of the weave's normals, y: reflection, z: tiles of weave per metre, or 0; w: layer
  uint faceted;
  uint reserved0, reserved1, reserved2;
};

struct VertexRecord {
  uint node;
  float u, v;
};

struct SolidRecord {
  vec4 position;  // w: opacity; negative: hides only
  vec4 orientation;
  vec4 shape;    // radius, topRadius, length of a capsule; edges of a box or plane; w: kind
  vec4 stretch;  // w: substance
  vec4 colour;   // w: roughness
  vec4 more;     // x: reflection
};

// A rectangle with a texture.
struct QuadRecord {
  vec4 middle;  // w: opacity
  vec4 right;   // half the width; w: width of the used part of the texture, 0 to 1
  vec4 up;      // half the height; w: height of the used part of the texture
  vec4 look;    // x: layer of the labels, or -1 for the panel
};

#ifdef __cplusplus
static_assert(sizeof(VertexRecord) == 12);
static_assert(sizeof(PartRecord) == 128);
static_assert(sizeof(SolidRecord) == 96);
static_assert(sizeof(QuadRecord) == 64);
static_assert(sizeof(Frame) == 5 * 64 + 2 * 16 + 22 * 16 + 16);
}  // namespace clothstream::xr::shaders
#endif

#endif

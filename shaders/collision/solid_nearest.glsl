// SPDX-License-Identifier: MIT
// The point of a closed triangle mesh that is nearest to a point, and on which side of the surface the point
// is: Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005.
//
// The including kernel defines kSolidBinding.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_SOLID_NEAREST_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_SOLID_NEAREST_GLSL

#include "shaders/collision/solid.h"
#include "shaders/shared/arithmetic.glsl"

layout(binding = kSolidBinding) uniform samplerBuffer solids;

// Nearer to the surface than this, the pseudonormal is the normal: the direction from the nearest point has
// too few digits. Metres.
const float kTouching = 1e-4;

// Nodes of trees that searches may still visit. A search that is cut short finds the nearest of the triangles
// that it has seen, so that a mesh whose triangles lie in a heap cannot hold the device up.
uint visitsLeft = kMostSolidVisits;

// Parts of a triangle. Corner k is kCorner + k; the edge from corner k to the next one is kEdge + k.
const uint kFace = 0u;
const uint kCorner = 1u;
const uint kEdge = 4u;

struct Nearest {
  bool found;      // false: the mesh is farther away than the bound
  float distance;  // m, negative inside
  vec3 point;
  vec3 normal;  // length 1, out of the mesh
  vec3 motion;  // m, of that point of the mesh during the tick
};

struct Corners {
  vec3 a;
  vec3 b;
  vec3 c;
};

// A point a + second (b - a) + third (c - a) of a triangle.
struct TrianglePoint {
  float second;
  float third;
  uint part;
};

bool moves(SolidRecord solid) {
  return solid.vertexTexels > float(CLOTHSTREAM_VERTEX_TEXELS);
}

// A vector of a vertex, at a share of the tick: its position, or its normal one texel later.
vec3 vertexVector(SolidRecord solid, uint vertex, int which, float progress) {
  int texel = int(uint(solid.firstVertex) + uint(solid.vertexTexels) * vertex) + which;
  precise vec3 at = texelFetch(solids, texel).xyz;
  if (moves(solid)) {
    at = at + progress * (texelFetch(solids, texel + CLOTHSTREAM_VERTEX_TEXELS).xyz - at);
  }
  return at;
}

vec3 vertexMotion(SolidRecord solid, uint vertex) {
  int texel = int(uint(solid.firstVertex) + uint(solid.vertexTexels) * vertex);
  precise vec3 motion =
      texelFetch(solids, texel + CLOTHSTREAM_VERTEX_TEXELS).xyz - texelFetch(solids, texel).xyz;
  return motion;
}

Corners fetchCorners(SolidRecord solid, uint triangle, float progress) {
  uvec3 vertices = cornersAt(solids, solid, triangle);
  return Corners(vertexVector(solid, vertices.x, 0, progress), vertexVector(solid, vertices.y, 0, progress),
                 vertexVector(solid, vertices.z, 0, progress));
}

// Quotient of two numbers that are not negative.
float quotient(float a, float b) {
  precise float q = a * reciprocal(max(b, 1e-30));
  return q;
}

// Ericson, "Real-Time Collision Detection", 2005, 5.1.5.
TrianglePoint nearestOnTriangle(vec3 p, Corners t) {
  precise vec3 ab = t.b - t.a;
  precise vec3 ac = t.c - t.a;
  precise vec3 ap = p - t.a;
  precise vec3 bp = p - t.b;
  precise vec3 cp = p - t.c;
  float d1 = dotProduct(ab, ap), d2 = dotProduct(ac, ap);
  float d3 = dotProduct(ab, bp), d4 = dotProduct(ac, bp);
  float d5 = dotProduct(ab, cp), d6 = dotProduct(ac, cp);
  precise float vc = d1 * d4 - d3 * d2;
  precise float vb = d5 * d2 - d1 * d6;
  precise float va = d3 * d6 - d5 * d4;
  precise float fromB = d4 - d3;
  precise float fromC = d5 - d6;
  precise float otherB = -d3;
  precise float otherC = -d6;
  if (d1 <= 0.0 && d2 <= 0.0) {
    return TrianglePoint(0.0, 0.0, kCorner);
  }
  if (d3 >= 0.0 && d4 <= d3) {
    return TrianglePoint(1.0, 0.0, kCorner + 1u);
  }
  if (d6 >= 0.0 && d5 <= d6) {
    return TrianglePoint(0.0, 1.0, kCorner + 2u);
  }
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    precise float both = d1 + otherB;
    return TrianglePoint(quotient(d1, both), 0.0, kEdge);
  }
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    precise float both = d2 + otherC;
    return TrianglePoint(0.0, quotient(d2, both), kEdge + 2u);
  }
  if (va <= 0.0 && fromB >= 0.0 && fromC >= 0.0) {
    precise float both = fromB + fromC;
    float third = quotient(fromB, both);
    precise float second = 1.0 - third;
    return TrianglePoint(second, third, kEdge + 1u);
  }
  precise float all_ = va + vb + vc;
  float inverse = reciprocal(max(all_, 1e-30));
  precise float second = vb * inverse;
  precise float third = vc * inverse;
  return TrianglePoint(second, third, kFace);
}

vec3 pointOf(Corners t, TrianglePoint at) {
  precise vec3 point = t.a + at.second * (t.b - t.a) + at.third * (t.c - t.a);
  return point;
}

vec3 unitNormal(Corners t) {
  precise vec3 ab = t.b - t.a;
  precise vec3 ac = t.c - t.a;
  vec3 normal = crossProduct(ab, ac);
  precise vec3 unit_ = normal * reciprocalSquareRoot(max(dotProduct(normal, normal), 1e-30));
  return unit_;
}

vec3 pseudonormal(SolidRecord solid, uint triangle, uint part, float progress) {
  if (part >= kCorner && part < kEdge) {
    return vertexVector(solid, cornersAt(solids, solid, triangle)[part - kCorner], 1, progress);
  }
  precise vec3 normal = unitNormal(fetchCorners(solid, triangle, progress));
  if (part != kFace) {
    uint other = neighboursAt(solids, solid, triangle)[part - kEdge];
    normal = normal + unitNormal(fetchCorners(solid, other, progress));
  }
  return normal;
}

// Square of the distance from the box of a node, at a share of the tick.
float squaredFromBox(vec3 p, SolidRecord solid, uint node, float progress) {
  uint texels = moves(solid) ? CLOTHSTREAM_MOVING_BOX_TEXELS : CLOTHSTREAM_BOX_TEXELS;
  int texel = int(uint(solid.firstBox) + texels * node);
  precise vec3 low = texelFetch(solids, texel).xyz;
  precise vec3 high = texelFetch(solids, texel + 1).xyz;
  if (moves(solid)) {
    low = low + progress * (texelFetch(solids, texel + CLOTHSTREAM_BOX_TEXELS).xyz - low);
    high = high + progress * (texelFetch(solids, texel + CLOTHSTREAM_BOX_TEXELS + 1).xyz - high);
  }
  precise vec3 below = low - p;
  precise vec3 above = p - high;
  vec3 outside = max(max(below, above), vec3(0.0));
  return dotProduct(outside, outside);
}

// The node of the tree that follows a node and all nodes below it; 0 after the last one.
uint nodeAfter(uint node) {
  uint next = node + 1u;
  next >>= uint(findLSB(next));
  return next == 1u ? 0u : next;
}

// The nearest point nearer than `bound`, at a share of the tick. Of points at the same distance, the one of
// the first triangle. Takes its visits from those that are left.
Nearest nearestOnSolid(SolidRecord solid, float progress, vec3 p, float bound) {
  uint leaves = uint(solid.leafCount), triangles = uint(solid.triangleCount);
  uint shift = uint(findMSB(leaves));
  precise float best = bound * bound;
  bool found = false;
  uint triangle = 0u;
  TrianglePoint at = TrianglePoint(0.0, 0.0, kFace);
  uint node = visitsLeft == 0u ? 0u : 1u;
  while (node != 0u) {
    --visitsLeft;
    bool near = squaredFromBox(p, solid, node, progress) < best;
    if (near && node >= leaves) {
      uint leaf = node - leaves;
      uint end = ((leaf + 1u) * triangles) >> shift;
      for (uint t = (leaf * triangles) >> shift; t < end; ++t) {
        Corners corners = fetchCorners(solid, t, progress);
        TrianglePoint nearest = nearestOnTriangle(p, corners);
        precise vec3 apart = p - pointOf(corners, nearest);
        float squared = dotProduct(apart, apart);
        if (squared < best) {
          best = squared;
          found = true;
          triangle = t;
          at = nearest;
        }
      }
    }
    node = near && node < leaves ? 2u * node : nodeAfter(node);
    node = visitsLeft == 0u ? 0u : node;
  }
  if (!found) {
    return Nearest(false, bound, vec3(0.0), vec3(0.0, 1.0, 0.0), vec3(0.0));
  }
  vec3 point = pointOf(fetchCorners(solid, triangle, progress), at);
  vec3 outwards = pseudonormal(solid, triangle, at.part, progress);
  vec3 motion = vec3(0.0);
  if (moves(solid)) {
    uvec3 vertices = cornersAt(solids, solid, triangle);
    motion = pointOf(Corners(vertexMotion(solid, vertices.x), vertexMotion(solid, vertices.y),
                             vertexMotion(solid, vertices.z)),
                     at);
  }
  precise vec3 apart = p - point;
  float inverse = reciprocalSquareRoot(max(best, 1e-24));
  precise float size = best * inverse;
  bool isOutside = dotProduct(apart, outwards) >= 0.0;
  precise float distance_ = isOutside ? size : -size;
  precise float sign_ = isOutside ? inverse : -inverse;
  precise vec3 away = sign_ * apart;
  precise vec3 along = outwards * reciprocalSquareRoot(max(dotProduct(outwards, outwards), 1e-24));
  return Nearest(true, distance_, point, size < kTouching ? along : away, motion);
}

#endif

// SPDX-License-Identifier: MIT
// The contact of a path with surfaces of the real room, which are triangle meshes that may be open.
//
// A path stays on the side of its beginning: it is stopped where it first crosses a triangle. A path that
// crosses none ends at the distance `thickness` from the nearest point of the surface, or farther away, as
// far as the surface may push it in a substep. A surface with one side can be crossed from behind. While it
// lifts, it pushes nodes to its front that are near behind it, except near its rim, where cloth hangs down.
//
// The including kernel defines kSolidBinding and kSurfaceBinding.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_SURFACE_CONTACT_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_SURFACE_CONTACT_GLSL

#include "shaders/collision/contact.glsl"
#include "shaders/collision/solid_nearest.glsl"
#include "shaders/collision/surface.h"
#include "shaders/shared/rotation.glsl"

layout(binding = kSurfaceBinding) uniform samplerBuffer surfaces;  // SurfaceRecord

SurfaceRecord surfaceRecordAt(uint surface) {
  int first = CLOTHSTREAM_SURFACE_TEXELS * int(surface);
  vec4 low = texelFetch(surfaces, first);
  vec4 high = texelFetch(surfaces, first + 1);
  vec4 position = texelFetch(surfaces, first + 2);
  return SurfaceRecord(CLOTHSTREAM_VECTOR(low), CLOTHSTREAM_VECTOR(high), CLOTHSTREAM_VECTOR(position),
                       texelFetch(surfaces, first + 3));
}

// Result of the search along a path on one surface, in the surface's frame.
struct SurfaceSearch {
  float part;          // share of the path at its first crossing; above 1: it crosses nothing
  uint crossed;        // the triangle
  float startSquared;  // squared distance of the path's beginning; that of the search if it is farther away
  float endSquared;    // the same of its end
  uint nearest;        // triangle that is nearest to the end
  TrianglePoint at;    // its nearest point
  float rimSquared;    // squared distance of the path's end from the rim, if it was asked for
};

// A contact, in the world. It is one of a crossing if `part` is at most 1.
struct SurfaceContact {
  Contact contact;
  float part;
  uint surface;
};

const float kNoCrossing = 2.0;

bool boxesOverlap(vec3 low, vec3 high, vec3 otherLow, vec3 otherHigh) {
  return all(lessThanEqual(low, otherHigh)) && all(greaterThanEqual(high, otherLow));
}

// The share of the path at which it crosses the triangle, or kNoCrossing. From behind it crosses only
// triangles with two sides.
float crossingOf(Corners corners, vec3 from, vec3 to, bool twoSided) {
  vec3 normal = unitNormal(corners);
  precise vec3 before = from - corners.a;
  precise vec3 after = to - corners.a;
  float start = dotProduct(normal, before);
  float end = dotProduct(normal, after);
  bool leaves = start >= 0.0 && end < 0.0;
  bool returns = twoSided && start < 0.0 && end >= 0.0;
  if (!leaves && !returns) {
    return kNoCrossing;
  }
  precise float both = abs(start) + abs(end);
  precise float part = abs(start) * reciprocal(max(both, 1e-20));
  part = min(part, 1.0);
  precise vec3 place = from + part * (to - from);
  TrianglePoint nearest = nearestOnTriangle(place, corners);
  precise vec3 apart = place - pointOf(corners, nearest);
  precise float seam = kSurfaceSeam * kSurfaceSeam;
  return dotProduct(apart, apart) <= seam ? part : kNoCrossing;
}

float squaredFromEdge(vec3 p, vec3 a, vec3 b) {
  precise vec3 edge = b - a;
  precise vec3 from = p - a;
  float along = dotProduct(from, edge);
  float part = along <= 0.0 ? 0.0 : min(quotient(along, dotProduct(edge, edge)), 1.0);
  precise vec3 apart = from - part * edge;
  return dotProduct(apart, apart);
}

float squaredFromRim(SolidRecord solid, uint triangle, Corners corners, vec3 p) {
  int texel = int(uint(solid.firstTriangle) + CLOTHSTREAM_TRIANGLE_TEXELS * triangle) + 1;
  uint rims = uint(texelFetch(solids, texel).w);
  float squared = 1e30;
  if ((rims & 1u) != 0u) {
    squared = squaredFromEdge(p, corners.a, corners.b);
  }
  if ((rims & 2u) != 0u) {
    squared = min(squared, squaredFromEdge(p, corners.b, corners.c));
  }
  if ((rims & 4u) != 0u) {
    squared = min(squared, squaredFromEdge(p, corners.c, corners.a));
  }
  return squared;
}

// Searches within `reach` of the path. Of triangles that are equally near, the first counts. Takes its visits
// from those that are left.
SurfaceSearch searchSurface(SolidRecord solid, vec3 from, vec3 to, float reach, bool twoSided,
                            bool needsRim) {
  uint leaves = uint(solid.leafCount), triangles = uint(solid.triangleCount);
  uint shift = uint(findMSB(leaves));
  precise vec3 low = min(from, to) - reach;
  precise vec3 high = max(from, to) + reach;
  precise float bound = reach * reach;
  SurfaceSearch search =
      SurfaceSearch(kNoCrossing, 0u, bound, bound, 0u, TrianglePoint(0.0, 0.0, kFace), bound);
  uint node = visitsLeft == 0u ? 0u : 1u;
  while (node != 0u) {
    --visitsLeft;
    int texel = int(uint(solid.firstBox) + CLOTHSTREAM_BOX_TEXELS * node);
    bool near = boxesOverlap(low, high, texelFetch(solids, texel).xyz, texelFetch(solids, texel + 1).xyz);
    if (near && node >= leaves) {
      uint leaf = node - leaves;
      uint end = ((leaf + 1u) * triangles) >> shift;
      for (uint t = (leaf * triangles) >> shift; t < end; ++t) {
        Corners corners = fetchCorners(solid, t, 0.0);
        float part = crossingOf(corners, from, to, twoSided);
        if (part < search.part) {
          search.part = part;
          search.crossed = t;
        }
        precise vec3 before = from - pointOf(corners, nearestOnTriangle(from, corners));
        search.startSquared = min(search.startSquared, dotProduct(before, before));
        TrianglePoint nearest = nearestOnTriangle(to, corners);
        precise vec3 after = to - pointOf(corners, nearest);
        float squared = dotProduct(after, after);
        if (squared < search.endSquared) {
          search.endSquared = squared;
          search.nearest = t;
          search.at = nearest;
        }
        if (needsRim) {
          search.rimSquared = min(search.rimSquared, squaredFromRim(solid, t, corners, to));
        }
      }
    }
    node = near && node < leaves ? 2u * node : nodeAfter(node);
    node = visitsLeft == 0u ? 0u : node;
  }
  return search;
}

float lengthOf(float squared) {
  precise float length_ = squared * reciprocalSquareRoot(max(squared, 1e-24));
  return length_;
}

// The contact that the search found, in the frame of the surface. `pushed`: the farthest way that the surface
// pushes a node which it finds too near, in this substep. A node behind a surface with one side has no
// contact unless it is less than `depthBound` deep.
Contact contactOfSearch(SolidRecord solid, SurfaceSearch search, vec3 from, vec3 to, bool twoSided,
                        float thickness, float depthBound, float pushed) {
  precise float reached = lengthOf(search.startSquared) + pushed;
  if (search.part <= 1.0) {
    Corners corners = fetchCorners(solid, search.crossed, 0.0);
    vec3 normal = unitNormal(corners);
    precise vec3 before = from - corners.a;
    precise vec3 side = dotProduct(normal, before) >= 0.0 ? normal : -normal;
    precise vec3 after = to - corners.a;
    precise float depth = min(thickness, reached) - dotProduct(side, after);
    return Contact(side, depth);
  }
  vec3 point = pointOf(fetchCorners(solid, search.nearest, 0.0), search.at);
  vec3 outwards = pseudonormal(solid, search.nearest, search.at.part, 0.0);
  precise vec3 along = outwards * reciprocalSquareRoot(max(dotProduct(outwards, outwards), 1e-24));
  precise vec3 apart = to - point;
  precise vec3 before = from - point;
  precise float inverse = reciprocalSquareRoot(max(search.endSquared, 1e-24));
  precise float distance_ = search.endSquared * inverse;
  precise vec3 away = inverse * apart;
  bool touches = distance_ < kTouching;
  bool inFront = dotProduct(apart, outwards) >= 0.0;
  if (touches) {
    inFront = dotProduct(before, outwards) >= 0.0;
    precise vec3 back = -along;
    away = inFront ? along : back;
  }
  if (twoSided || inFront) {
    // A node that comes from behind may be pushed no farther than from its depth there.
    if (!twoSided && dotProduct(before, outwards) < 0.0) {
      reached = dotProduct(away, before) + pushed;
    }
    precise float depth = min(thickness, reached) - (touches ? 0.0 : distance_);
    return Contact(away, depth);
  }
  precise float bound = depthBound * depthBound;
  if (search.rimSquared < bound || distance_ >= depthBound) {
    return kNoContact;
  }
  // Behind: `away` leads back, out of the front is the other way.
  precise vec3 front = -away;
  precise float start = dotProduct(front, before) + pushed;
  precise float depth = min(thickness, start) + (touches ? 0.0 : distance_);
  return Contact(front, depth);
}

// Kinds of search: for a crossing; for a crossing or a node too near; for a node behind a surface that lifts.
const uint kCrossings = 0u;
const uint kContacts = 1u;
const uint kBehind = 2u;

// The contact of a path with all surfaces: the first crossing, or else the one that pushes farthest. Most
// nodes that touch something do not need the wider search for what is behind a surface.
SurfaceContact touchSurfaces(SurfacePush push, vec3 from, vec3 to, float thickness, uint what) {
  SurfaceContact best = SurfaceContact(kNoContact, kNoCrossing, 0u);
  for (uint number = 0u; number < push.surfaceCount; ++number) {
    SurfaceRecord surface = surfaceRecordAt(number);
    bool twoSided = surface.kind == kTwoSidedSurface;
    float depthBound = what == kBehind ? push.depth : 0.0;
    float reach = what == kCrossings ? kSurfaceSeam : max(max(thickness, depthBound), kSurfaceSeam);
    precise vec3 low = min(from, to) - reach;
    precise vec3 high = max(from, to) + reach;
    bool searches = what != kBehind || surface.kind == kLiftingSurface;
    if (searches && boxesOverlap(low, high, surface.low, surface.high)) {
      SolidRecord solid = solidRecordAt(solids, uint(surface.solid));
      precise vec3 before = from - surface.position;
      precise vec3 after = to - surface.position;
      before = rotateBack(surface.orientation, before);
      after = rotateBack(surface.orientation, after);
      precise float bound = reach * reach;
      SurfaceSearch search = searchSurface(solid, before, after, reach, twoSided, what == kBehind);
      bool crosses = search.part <= 1.0;
      bool counts = crosses || (what != kCrossings && best.part > 1.0 && search.endSquared < bound);
      if (counts) {
        Contact contact =
            contactOfSearch(solid, search, before, after, twoSided, thickness, depthBound, push.pushed);
        if (crosses ? search.part < best.part : contact.depth > best.contact.depth) {
          contact.normal = rotate(surface.orientation, contact.normal);
          best = SurfaceContact(contact, search.part, number);
        }
      }
    }
  }
  return best;
}

#endif

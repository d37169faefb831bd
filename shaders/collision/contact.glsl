// SPDX-License-Identifier: MIT
// The contact of a path with a shape, in the shape's frame.
//
// A path that begins outside meets the shape where it enters. A path that begins inside (because of rounding,
// or because the shape moved there) leaves by the nearest way at its beginning. In both cases the path stays
// on the side of its beginning, so that fast nodes do not pass through thin shapes.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_CONTACT_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_CONTACT_GLSL

#include "shaders/collision/collision.h"
#include "shaders/shared/arithmetic.glsl"

// The path's end has to move by `depth` along the normal. There is no contact if depth <= 0.
struct Contact {
  vec3 normal;
  float depth;
};

const Contact kNoContact = Contact(vec3(0.0, 1.0, 0.0), 0.0);

vec3 unit(vec3 v, float squared) {
  precise vec3 u = v * reciprocalSquareRoot(max(squared, 1e-24));
  return squared < 1e-24 ? vec3(0.0, 1.0, 0.0) : u;
}

// The nearest point of a capsule's segment.
vec3 onSegment(float y, float halfLength) {
  precise float otherEnd = -halfLength;
  return vec3(0.0, y > halfLength ? halfLength : (y < otherEnd ? otherEnd : y), 0.0);
}

// Share t of the path at which the squared distance, squared + 2 t along + t^2 pathSquared, first falls to
// zero. More than 1 if it does not. The squared distance is above zero at the beginning.
float shareUntilZero(float squared, float along, float pathSquared) {
  precise float discriminant = along * along - pathSquared * squared;
  precise float root = discriminant * reciprocalSquareRoot(max(discriminant, 1e-30));
  precise float part = squared * reciprocal(max(root - along, 1e-20));
  return along < 0.0 && discriminant >= 0.0 ? part : 2.0;
}

// True if the path, which begins outside, enters the capsule. `centre` is the point of the segment nearest to
// the entry.
bool entersRound(vec3 from, vec3 path, float radius, float halfLength, out vec3 centre, out vec3 normal) {
  // The infinite cylinder comes first. A path that begins inside it lies beyond one of the capsule's ends.
  precise float radiusSquared = radius * radius;
  precise float squared = from.x * from.x + from.z * from.z - radiusSquared;
  precise float along = from.x * path.x + from.z * path.z;
  precise float pathSquared = path.x * path.x + path.z * path.z;
  float part = 0.0;
  if (squared > 0.0) {
    part = shareUntilZero(squared, along, pathSquared);
  }
  precise float y = from.y + part * path.y;
  centre = onSegment(y, halfLength);
  if (part <= 1.0 && centre.y != y) {
    precise vec3 offset = from - centre;
    precise float outside = dotProduct(offset, offset) - radiusSquared;
    part = shareUntilZero(outside, dotProduct(offset, path), dotProduct(path, path));
  }
  precise vec3 out_ = from + part * path - centre;
  normal = unit(out_, dotProduct(out_, out_));
  return part <= 1.0;
}

// A sphere is a capsule without length.
Contact touchRound(vec3 from, vec3 to, float radius, float halfLength) {
  precise vec3 centre = onSegment(from.y, halfLength);
  precise vec3 before = from - centre;
  precise vec3 after = to - onSegment(to.y, halfLength);
  precise float beforeSquared = dotProduct(before, before);
  precise float afterSquared = dotProduct(after, after);
  precise float radiusSquared = radius * radius;
  vec3 normal = unit(before, beforeSquared);
  bool begunInside = beforeSquared <= radiusSquared;
  if (!begunInside) {
    precise vec3 path = to - from;
    if (!entersRound(from, path, radius, halfLength, centre, normal)) {
      return kNoContact;
    }
  }
  // The node leaves along its own normal if that is on the same side, else along the normal at the entry.
  vec3 outwards = unit(after, afterSquared);
  if (dotProduct(normal, outwards) > 0.0) {
    if (afterSquared < radiusSquared) {
      precise float distance = dotProduct(after, outwards);
      precise float depth = radius - distance;
      return Contact(outwards, depth);
    }
    if (begunInside) {
      return kNoContact;
    }
  }
  precise vec3 beyond = to - centre;
  precise float depth = radius - dotProduct(normal, beyond);
  return Contact(normal, depth);
}

// Plane of a box (normal, offset), axis by axis.
vec4 boxPlane(vec3 halfSize, uint index) {
  float side = (index & 1u) == 0u ? 1.0 : -1.0;
  return index < 2u   ? vec4(side, 0.0, 0.0, halfSize.x)
         : index < 4u ? vec4(0.0, side, 0.0, halfSize.y)
                      : vec4(0.0, 0.0, side, halfSize.z);
}

// The shape is the set of points behind all its planes, each moved outwards by `thickness`.
Contact touchPlanes(samplerBuffer colliders, vec3 from, vec3 to, ShapeRecord shape, float thickness) {
  bool isBox = shape.kind == kBoxShape;
  uint count = isBox ? 6u : planeCountOf(shape);
  bool begunInside = true;
  float entry = 0.0, exit = 1.0, nearest = -1e30;
  Contact contact = kNoContact;
  for (uint i = 0; i < count; ++i) {
    vec4 plane = isBox ? boxPlane(halfSizeOf(shape), i) : texelFetch(colliders, int(firstPlaneOf(shape) + i));
    precise float surface = plane.w + thickness;
    precise float before = dotProduct(plane.xyz, from) - surface;
    precise float after = dotProduct(plane.xyz, to) - surface;
    precise float depth = -after;
    if (before > 0.0 && after > 0.0) {
      return kNoContact;
    }
    precise float length = abs(before - after);
    precise float part = abs(before) * reciprocal(max(length, 1e-20));
    if (before > 0.0) {
      if (begunInside || part > entry) {
        entry = part;
        contact = Contact(plane.xyz, depth);
      }
      begunInside = false;
    } else {
      if (after > 0.0 && part < exit) {
        exit = part;
      }
      if (begunInside && before > nearest) {
        nearest = before;
        contact = Contact(plane.xyz, depth);
      }
    }
  }
  return begunInside || entry <= exit ? contact : kNoContact;
}

#endif

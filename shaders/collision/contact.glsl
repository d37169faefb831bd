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

// A point of a capsule's segment at height y, or the nearest end.
vec3 onSegment(float y, float halfLength) {
  precise float otherEnd = -halfLength;
  return vec3(0.0, y > halfLength ? halfLength : (y < otherEnd ? otherEnd : y), 0.0);
}

// A sphere, a capsule or a tapered capsule: the balls about the points of its segment. A sphere has no
// length.
struct Round {
  float radius;  // at the end at -Y
  float halfLength;
  float slope;  // of the radius along the segment
  float lean;   // slope / sqrt(1 - slope^2)
};

Round roundOf(ShapeRecord shape, float thickness) {
  precise float radius = radiusOf(shape) + thickness;
  float slope = slopeOf(shape);
  precise float cosineSquared = 1.0 - slope * slope;
  precise float lean = slope * reciprocalSquareRoot(cosineSquared);
  return Round(radius, halfLengthOf(shape), slope, lean);
}

struct Ball {
  vec3 centre;
  float radius;
};

// The ball of a round shape whose surface is nearest to a point outside, and farthest from a point inside.
// With the distance q from the axis and the height h over the end at -Y, the distance sqrt(q^2 + (h - t)^2)
// - r - slope t from the ball at t is smallest at t = h + lean q.
Ball nearestBall(vec3 p, Round shape) {
  precise float squared = p.x * p.x + p.z * p.z;
  precise float away = squared * reciprocalSquareRoot(max(squared, 1e-30));
  precise float y = p.y + shape.lean * away;
  vec3 centre = onSegment(y, shape.halfLength);
  precise float radius = shape.radius + shape.slope * (centre.y + shape.halfLength);
  return Ball(centre, radius);
}

// Share t of the path at which the squared distance, squared + 2 t along + t^2 pathSquared, first falls to
// zero. More than 1 if it does not. The squared distance is above zero at the beginning.
float shareUntilZero(float squared, float along, float pathSquared) {
  precise float discriminant = along * along - pathSquared * squared;
  precise float root = discriminant * reciprocalSquareRoot(max(discriminant, 1e-30));
  precise float part = squared * reciprocal(max(root - along, 1e-20));
  return along < 0.0 && discriminant >= 0.0 ? part : 2.0;
}

// True if the path, which begins outside, enters a capsule with one radius. `met` is the ball that it enters.
bool entersCapsule(vec3 from, vec3 path, Round shape, inout Ball met, inout vec3 normal) {
  // The infinite cylinder comes first. A path that begins inside it lies beyond one of the capsule's ends.
  precise float radiusSquared = shape.radius * shape.radius;
  precise float squared = from.x * from.x + from.z * from.z - radiusSquared;
  precise float along = from.x * path.x + from.z * path.z;
  precise float pathSquared = path.x * path.x + path.z * path.z;
  float part = 0.0;
  if (squared > 0.0) {
    part = shareUntilZero(squared, along, pathSquared);
  }
  precise float y = from.y + part * path.y;
  vec3 centre = onSegment(y, shape.halfLength);
  if (part <= 1.0 && centre.y != y) {
    precise vec3 offset = from - centre;
    precise float outside = dotProduct(offset, offset) - radiusSquared;
    part = shareUntilZero(outside, dotProduct(offset, path), dotProduct(path, path));
  }
  precise vec3 out_ = from + part * path - centre;
  normal = unit(out_, dotProduct(out_, out_));
  met = Ball(centre, shape.radius);
  return part <= 1.0;
}

// Steps of Newton's method along a path. The height over a convex shape is a convex function of the path, so
// that no step leads beyond the first entry. Paths that graze the shape need the most steps.
const uint kEntrySteps = 12;

// True if the path, which begins outside, enters the tapered capsule. `met` is the ball that it enters.
bool entersTapered(vec3 from, vec3 path, Round shape, inout Ball met, inout vec3 normal) {
  uint steps = shape.slope != 0.0 ? kEntrySteps : 0u;
  float part = 0.0;
  bool passes = false;
  uint i = 0;
  do {
    precise vec3 at = from + part * path;
    met = nearestBall(at, shape);
    precise vec3 out_ = at - met.centre;
    precise float squared = dotProduct(out_, out_);
    normal = unit(out_, squared);
    precise float height = squared * reciprocalSquareRoot(max(squared, 1e-30)) - met.radius;
    precise float closing = -dotProduct(normal, path);
    precise float next = part + max(height, 0.0) * reciprocal(max(closing, 1e-20));
    passes = passes || (height > 0.0 && (closing <= 0.0 || next > 1.0));
    part = passes ? part : next;
    ++i;
  } while (i < steps);
  return !passes;
}

Contact touchRound(vec3 from, vec3 to, Round shape) {
  Ball met = nearestBall(from, shape);
  Ball last = nearestBall(to, shape);
  precise vec3 before = from - met.centre;
  precise vec3 after = to - last.centre;
  precise float beforeSquared = dotProduct(before, before);
  precise float afterSquared = dotProduct(after, after);
  precise float startSquared = met.radius * met.radius;
  precise float endSquared = last.radius * last.radius;
  vec3 normal = unit(before, beforeSquared);
  bool begunInside = beforeSquared <= startSquared;
  if (!begunInside) {
    precise vec3 path = to - from;
    bool entered = false;
    if (shape.slope == 0.0) {
      entered = entersCapsule(from, path, shape, met, normal);
    } else {
      entered = entersTapered(from, path, shape, met, normal);
    }
    if (!entered) {
      return kNoContact;
    }
  }
  // The node leaves along its own normal if that is on the same side, else along the normal at the entry.
  vec3 outwards = unit(after, afterSquared);
  if (dotProduct(normal, outwards) > 0.0) {
    if (afterSquared < endSquared) {
      precise float distance = dotProduct(after, outwards);
      precise float depth = last.radius - distance;
      return Contact(outwards, depth);
    }
    if (begunInside) {
      return kNoContact;
    }
  }
  precise vec3 beyond = to - met.centre;
  precise float depth = met.radius - dotProduct(normal, beyond);
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

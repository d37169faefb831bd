// SPDX-License-Identifier: MIT
// The contact of a path with a closed triangle solid, in the frame of the mesh.
//
// A path that begins outside and crosses the surface is stopped where it first crosses it, however thin the
// mesh is there. A path that begins inside leaves by the nearest way at its beginning. All other paths end
// at the distance `thickness` from the nearest point of the solid, or farther away.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_SOLID_CONTACT_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_SOLID_CONTACT_GLSL

#include "shaders/collision/contact.glsl"
#include "shaders/collision/distance_grid.glsl"

// A path is searched for its first crossing in at most this number of strides.
const uint kStrides = 32u;
const float kLeastStride = 1.0 / 32.0;  // as a share of the path
// Normals whose product is above this are on one side. The sides of a box are not, whatever the rounding.
const float kSameSide = 0.01;

// A contact with a mesh, and the motion of the mesh there during the tick.
struct SolidContact {
  Contact contact;
  vec3 motion;
};

// The contact that keeps `to` outside, if the path crossed the surface near `entry` or began inside there.
// The point of entry moves on for `left`, a share of the tick.
SolidContact leaveAt(Nearest entry, Nearest end, vec3 to, float left, float thickness) {
  if (end.found && dotProduct(entry.normal, end.normal) > kSameSide) {
    precise float depth = thickness - end.distance;
    if (depth > 0.0) {
      return SolidContact(Contact(end.normal, depth), end.motion);
    }
    if (entry.distance < 0.0) {
      return SolidContact(kNoContact, vec3(0.0));
    }
  }
  precise vec3 beyond = to - (entry.point + left * entry.motion);
  precise float depth = thickness - dotProduct(entry.normal, beyond);
  return SolidContact(Contact(entry.normal, depth), entry.motion);
}

// Seen from a node, the distance from the mesh changes at most by the length of its path and the motion of
// the mesh, together `way`. So a path whose ends are far enough outside cannot cross the surface. Any other
// path is followed in strides of the distance from the mesh, or of kLeastStride of the path if that is
// longer. All its searches together visit at most kMostSolidVisits nodes of the tree. The substep begins and
// ends at shares of the tick. No vertex moves farther in the tick than
// `motion`.
SolidContact touchSolid(SolidRecord solid, vec3 from, vec3 to, float begins, float ends, float motion,
                        float thickness) {
  precise vec3 path = to - from;
  precise float substep = ends - begins;
  float squared = dotProduct(path, path);
  precise float way = squared * reciprocalSquareRoot(max(squared, 1e-24)) + substep * motion;
  float inverse = reciprocal(max(way, 1e-12));
  precise float bound = way + max(thickness, kSolidDepth);
  SolidContact none = SolidContact(kNoContact, vec3(0.0));
  Nearest entry = Nearest(false, 0.0, vec3(0.0), vec3(0.0), vec3(0.0));
  Nearest end = entry;
  visitsLeft = kMostSolidVisits;
  bool entered = false;
  float part = 0.0, entryPart = 0.0;
  uint queries = kStrides + 2u;
  for (uint query = 0u; query < queries; ++query) {
    float share = query == 1u ? 1.0 : part;
    precise vec3 between = from + share * path;
    precise float progress = begins + share * substep;
    Nearest here = nearestPoint(solid, query == 1u ? ends : progress, query == 1u ? to : between, bound);
    if (query == 0u) {
      entry = here;
      precise float least = here.distance - way;
      if (!here.found || least >= thickness) {
        return none;
      }
      entered = here.distance < 0.0;
    } else if (query == 1u) {
      end = here;
      precise float both = entry.distance + end.distance;
      bool mayCross = !entered && end.found && (end.distance < 0.0 || both < way);
      queries = mayCross ? queries : 0u;
    } else if (here.found && here.distance < 0.0) {
      entered = true;
      queries = 0u;
    } else {
      if (here.found) {
        entry = here;
        entryPart = part;
      }
      queries = part >= 1.0 ? 0u : queries;
    }
    if (query > 0u) {
      float stride = here.found && query > 1u ? here.distance : entry.distance;
      precise float next = part + max(stride * inverse, kLeastStride);
      part = next < 1.0 ? next : 1.0;
    }
  }
  if (entered) {
    precise float left = (1.0 - entryPart) * substep;
    return leaveAt(entry, end, to, left, thickness);
  }
  precise float depth = thickness - end.distance;
  return SolidContact(Contact(end.normal, end.found ? depth : 0.0), end.motion);
}

#endif

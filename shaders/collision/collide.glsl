// SPDX-License-Identifier: MIT
// Collision of a node with moving shapes during a substep, with Coulomb friction: [Va21] 3.4, Alg. 4, for
// more kinds of shapes.
//
// The including kernel defines kColliderBinding, the first of two bindings, and kContactImpulseBinding. It
// calls collideWithAll().
#ifndef CLOTHSTREAM_SHADERS_COLLISION_COLLIDE_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_COLLIDE_GLSL

#include "shaders/collision/contact.glsl"
#include "shaders/shared/rotation.glsl"

layout(binding = kColliderBinding) uniform samplerBuffer colliders;  // ColliderRecord, then planes
layout(binding = kColliderBinding +
                 1) uniform samplerBuffer nearColliders;  // a list for each kNearNodes nodes

layout(std430, binding = kContactImpulseBinding) buffer ContactImpulses {
  uint contactImpulses[];  // by collider, then by cloth, in kImpulseUnits
};

// A node that collides. An inverse mass of 0 keeps its contacts out of the report.
struct CollidingNode {
  uint index;  // in the scene
  uint cloth;
  float inverseMass;
  float thickness;  // m, of its cloth
  float friction;   // of its cloth
};

// ---- The list of near colliders

struct NearList {
  int first;  // texel of the numbers; negative: the list means all colliders
  uint count;
  vec3 low;
  vec3 high;
};

NearList fetchNearList(uint node) {
  int first = int((node / kNearNodes) * (kNearStride / 4));
  vec4 lowAndCount = texelFetch(nearColliders, first + int(kNearLow / 4));
  vec4 high = texelFetch(nearColliders, first + int(kNearHigh / 4));
  return NearList(first + int(kNearHeader / 4), uint(lowAndCount.w), lowAndCount.xyz, high.xyz);
}

// True if the list has every collider that a node can touch on its way from `from` to `to`.
bool covers(NearList list, vec3 from, vec3 to) {
  if (list.first < 0) {
    return true;
  }
  return list.count <= kMaxNear && all(greaterThanEqual(from, list.low)) &&
         all(lessThanEqual(from, list.high)) && all(greaterThanEqual(to, list.low)) &&
         all(lessThanEqual(to, list.high));
}

NearList allColliders(uint count) {
  return NearList(-1, count, vec3(0.0), vec3(0.0));
}

// Number of the collider at place `index` of the list, in ascending order.
uint colliderAt(NearList list, uint index) {
  if (list.first < 0) {
    return index;
  }
  vec4 four = texelFetch(nearColliders, list.first + int(index >> 2));
  uint place = index & 3u;
  return uint(place < 2u ? (place == 0u ? four.x : four.y) : (place == 2u ? four.z : four.w));
}

// ---- The pose of a collider

// A collider at the start and at the end of a substep.
struct Collider {
  uint number;
  vec3 before;
  vec3 after;
  vec3 velocity;
  float reach;     // includes the cloth's thickness
  float friction;  // product with the cloth's friction
  float thickness;
};

// The rotation and shape of a collider, needed only for near nodes.
struct ColliderFrame {
  vec4 before;  // unit quaternions
  vec4 after;
  vec3 spin;  // 1/s
  ShapeRecord shape;
};

Collider fetchCollider(uint index, CollisionPush push, float thickness, float friction) {
  ColliderRecord record = colliderRecordAt(colliders, index);
  precise vec3 before = record.position + push.progressBefore * record.motion;
  precise vec3 after = record.position + push.progressAfter * record.motion;
  precise vec3 velocity = push.tickRate * record.motion;
  precise float reach = record.reach + kThicknessReach * thickness;
  precise float both = friction * record.friction;
  return Collider(index, before, after, velocity, reach, both, thickness);
}

// False only if a node on this way stays farther from the collider than its reach. For lengths a, b and c and
// any k > 0, the test a^2 > (1 + k) b^2 + (1 + 1 / k) c^2 is slightly stricter than a > b + c. A k of 1 suits
// long ways, a k of 1/32 short ones.
bool mayTouch(Collider collider, vec3 from, vec3 to) {
  precise vec3 before = from - collider.before;
  precise vec3 after = to - collider.after;
  precise vec3 path = after - before;
  precise float reachSquared = collider.reach * collider.reach;
  precise float pathSquared = dotProduct(path, path);
  precise float longWay = 2.001 * (reachSquared + pathSquared);
  precise float shortWay = 1.032 * reachSquared + 33.1 * pathSquared;
  return dotProduct(after, after) <= (longWay < shortWay ? longWay : shortWay);
}

ColliderFrame fetchFrame(Collider collider, CollisionPush push) {
  ColliderRecord record = colliderRecordAt(colliders, collider.number);
  vec4 before = orientationAt(record.orientation, record.orientationChange, push.progressBefore);
  vec4 after = orientationAt(record.orientation, record.orientationChange, push.progressAfter);
  // Twice the vector part of after * conjugate(before) is the axis times the angle.
  precise vec3 difference = before.w * after.xyz - after.w * before.xyz - crossProduct(after.xyz, before.xyz);
  precise vec3 spin = (2.0 * push.substepRate) * difference;
  return ColliderFrame(before, after, spin, record.shape);
}

// ---- Contacts

Contact findContact(Collider collider, ColliderFrame frame, vec3 from, vec3 to) {
  precise vec3 before = from - collider.before;
  precise vec3 after = to - collider.after;
  ShapeRecord shape = frame.shape;
  before = rotateBack(frame.before, before);
  after = rotateBack(frame.after, after);
  Contact contact = kNoContact;
#if CLOTHSTREAM_SHAPE_KINDS != 4
#error "findContact() does not know all kinds of shapes (collide_solids.comp has those of meshes)"
#endif
  if (shape.kind == kRoundShape) {
    contact = touchRound(before, after, roundOf(shape, collider.thickness));
  } else {
    contact = touchPlanes(colliders, before, after, shape, collider.thickness);
  }
  contact.normal = rotate(frame.after, contact.normal);
  return contact;
}

// Adds an impulse to the report. Whole numbers make the sum independent of the order.
void reportContact(uint contact, vec3 gained, float inverseMass) {
  precise float squared = max(dotProduct(gained, gained), 1e-30);
  precise float impulse = (squared * reciprocalSquareRoot(squared)) * reciprocal(inverseMass);
  precise float units = (impulse < kMaxImpulse ? impulse : kMaxImpulse) * kImpulseUnits;
  atomicAdd(contactImpulses[contact], uint(units) + 1);
}

// The share of a motion along a surface that friction takes. It takes at most `most` of its length.
float heldShare(vec3 along, float most) {
  precise float share = most * reciprocalSquareRoot(max(dotProduct(along, along), 1e-30));
  return min(share, 1.0);
}

vec3 alongSurface(vec3 v, vec3 normal) {
  precise vec3 along = v - dotProduct(v, normal) * normal;
  return along;
}

// A contact whose friction has not acted yet. Friction waits for the next contact of the node: only then is
// it known which motion along the surface remains.
struct Press {
  uint collider;  // kNoCollider: there is no contact
  vec3 normal;
  vec3 before;   // normal of the contact before this one; 0 if there is none, or if they are opposed
  vec3 carried;  // velocity of the surface
  float pushed;  // speed at which the collider pushes
  float friction;
};
const uint kNoCollider = 0xFFFFFFFFu;
const Press kNoPress = Press(kNoCollider, vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0);

// Without the part that leads into a surface.
vec3 keptOut(vec3 change, vec3 normal) {
  precise vec3 kept = change - min(dotProduct(change, normal), 0.0) * normal;
  return kept;
}

// Friction takes at most its coefficient times the speed at which the collider pushes. It acts on the
// velocity relative to the surface, and on the way since the substep's start, which other colliders may have
// caused. It moves nothing into the surfaces of the contacts before and after this one (`next`; 0 if there is
// none), unless they are opposed: a node that two colliders pinch cannot be outside of both.
void rub(Press press, vec3 next, CollisionPush push, CollidingNode node, vec3 from, inout vec3 position,
         inout vec3 velocity) {
  precise float most = press.friction * press.pushed;
  precise vec3 relative = velocity - press.carried;
  vec3 slip = alongSurface(relative, press.normal);
  precise vec3 slower = -heldShare(slip, most) * slip;
  slower = keptOut(keptOut(slower, press.before), next);
  precise vec3 way = position - from - push.substepSeconds * press.carried;
  vec3 slid = alongSurface(way, press.normal);
  precise vec3 back = -heldShare(slid, push.substepSeconds * most) * slid;
  back = keptOut(keptOut(back, press.before), next);
  precise vec3 slowed = velocity + slower;
  precise vec3 stayed = position + back;
  velocity = slowed;
  position = stayed;
  if (push.contactClothCount > 0 && node.inverseMass > 0.0) {
    precise vec3 given = slower + press.pushed * press.normal;
    reportContact(press.collider * push.contactClothCount + node.cloth, given, node.inverseMass);
  }
}

// Moves a free node, which was at `from` at the substep's start, out of the collider. Its velocity relative
// to the surface, which moves with `surfaceVelocity` and spins, loses the part into the surface. The collider
// pushes with the speed of the approach, or that of the way out, less its rounding and a speed away from the
// surface.
void leave(uint index, Collider collider, Contact contact, vec3 surfaceVelocity, vec3 spin,
           CollisionPush push, CollidingNode node, vec3 from, inout Press last, inout vec3 position,
           inout vec3 velocity) {
  precise vec3 surface = position + contact.depth * contact.normal;
  precise vec3 arm = surface - collider.after;
  precise vec3 carried = surfaceVelocity + crossProduct(spin, arm);
  precise vec3 relative = velocity - carried;
  precise float approach = dotProduct(relative, contact.normal);
  precise vec3 extents = abs(arm) + abs(surface);
  precise float pressed = contact.depth - kDepthRounding * (extents.x + extents.y + extents.z);
  precise float wayOut = pressed * push.substepRate - max(approach, 0.0);
  precise float met = max(-approach, 0.0);
  precise float pushed = max(met, wayOut);
  precise vec3 stopped = velocity + met * contact.normal;
  position = surface;
  velocity = stopped;
  bool opposed = dotProduct(last.normal, contact.normal) < kOpposed;
  if (last.collider != kNoCollider) {
    rub(last, opposed ? vec3(0.0) : contact.normal, push, node, from, position, velocity);
  }
  last = Press(index, contact.normal, opposed ? vec3(0.0) : last.normal, carried, pushed, collider.friction);
}

// Moves a free node that comes from `from` out of the collider, if it touches it.
void collide(uint index, Collider collider, ColliderFrame frame, CollisionPush push, CollidingNode node,
             vec3 from, inout Press last, inout vec3 position, inout vec3 velocity) {
  Contact contact = findContact(collider, frame, from, position);
  if (contact.depth <= 0.0) {
    return;
  }
  leave(index, collider, contact, collider.velocity, frame.spin, push, node, from, last, position, velocity);
}

// The friction of the last contact.
void finishContacts(Press last, CollisionPush push, CollidingNode node, vec3 from, inout vec3 position,
                    inout vec3 velocity) {
  if (last.collider != kNoCollider) {
    rub(last, vec3(0.0), push, node, from, position, velocity);
  }
}

// Collides a node with every collider that it may touch, in ascending order. A node that is pushed out of the
// list's box continues with the next of all colliders.
//
// The inner loop only looks for the next collider, so that a device which runs several nodes together
// computes contacts of all of them at once. A software device would otherwise compute a contact for each
// collider that it rejects.
void collideWithAll(CollidingNode node, CollisionPush push, vec3 from, inout vec3 position,
                    inout vec3 velocity) {
  NearList list = fetchNearList(node.index);
  if (!covers(list, from, position)) {
    list = allColliders(push.colliderCount);
  }
  Press last = kNoPress;
  uint i = 0;
  do {
    uint index = 0;
    Collider collider;
    bool near = false;
    do {
      if (i < list.count) {
        index = colliderAt(list, i);
        collider = fetchCollider(index, push, node.thickness, node.friction);
        near = mayTouch(collider, from, position);
        ++i;
      }
    } while (!near && i < list.count);
    if (near) {
      collide(index, collider, fetchFrame(collider, push), push, node, from, last, position, velocity);
      if (!covers(list, from, position)) {
        list = allColliders(push.colliderCount);
        i = index + 1;
      }
    }
  } while (i < list.count);
  finishContacts(last, push, node, from, position, velocity);
}

#endif

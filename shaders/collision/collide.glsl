// SPDX-License-Identifier: MIT
// Collision of a node with moving shapes over a substep, with Coulomb friction: [Va21] 3.4, Alg. 4, and more
// shapes.
//
// The kernel that includes this defines kColliderBinding, the first of two bindings, and kContactImpulseBinding, and
// calls collideWithAll() with a node's index in the scene.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_COLLIDE_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_COLLIDE_GLSL

#include "shaders/collision/contact.glsl"
#include "shaders/shared/rotation.glsl"

layout(binding = kColliderBinding) uniform samplerBuffer colliders;  // ColliderRecord, then planes
layout(binding = kColliderBinding +
                 1) uniform samplerBuffer nearColliders;  // a list for each kNearNodes nodes

layout(std430, binding = kContactImpulseBinding) buffer ContactImpulses {
  uint contactImpulses[];  // a collider, a cloth: kImpulseUnits
};

// Who collides: its cloth's number; 0 where its contacts are not to be told.
struct CollidingNode {
  uint cloth;
  float inverseMass;
};

// ---- Which colliders

struct NearList {
  int first;  // texel of the indices; negative: all colliders are meant
  uint count;
  vec3 low;
  vec3 high;
};

NearList fetchNearList(uint node) {
  int first = int((node / kNearNodes) * (kNearStride / 4));
  vec4 low = texelFetch(nearColliders, first);
  vec4 high = texelFetch(nearColliders, first + 1);
  return NearList(first + 2, uint(low.w), low.xyz, high.xyz);
}

// Whether the list holds all that a node on its way from one place to the other can touch.
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

// The index-th one, in ascending order.
uint colliderAt(NearList list, uint index) {
  if (list.first < 0) {
    return index;
  }
  vec4 four = texelFetch(nearColliders, list.first + int(index >> 2));
  uint place = index & 3u;
  return uint(place < 2u ? (place == 0u ? four.x : four.y) : (place == 2u ? four.z : four.w));
}

// ---- Where they are

// A collider at the start and at the end of a substep.
struct Collider {
  int record;  // its first texel
  vec3 before;
  vec3 after;
  vec3 velocity;
  float reach;     // with the cloth's thickness
  float friction;  // with the cloth's
  float thickness;
};

// How it is turned, and its shape: only needed close by.
struct ColliderFrame {
  vec4 before;  // unit quaternions
  vec4 after;
  vec3 spin;  // 1/s
  vec4 shape;
};

Collider fetchCollider(uint index, CollisionPush push, float thickness, float friction) {
  int record = int(5 * index);
  vec4 start = texelFetch(colliders, record);
  vec4 motion = texelFetch(colliders, record + 1);
  precise vec3 before = start.xyz + push.progressBefore * motion.xyz;
  precise vec3 after = start.xyz + push.progressAfter * motion.xyz;
  precise vec3 velocity = push.tickRate * motion.xyz;
  precise float reach = start.w + kThicknessReach * thickness;
  precise float both = friction * motion.w;
  return Collider(record, before, after, velocity, reach, both, thickness);
}

// False only where a node on this way stays farther from the collider than it reaches. Of three lengths a, b,
// c with a > b + c, a^2 > 2 (b^2 + c^2) asks for a little more.
bool mayTouch(Collider collider, vec3 from, vec3 to) {
  precise vec3 before = from - collider.before;
  precise vec3 after = to - collider.after;
  precise vec3 path = after - before;
  precise float limit = collider.reach * collider.reach + dotProduct(path, path);
  precise float doubled = 2.001 * limit;
  return dotProduct(after, after) <= doubled;
}

ColliderFrame fetchFrame(Collider collider, CollisionPush push) {
  vec4 shape = texelFetch(colliders, collider.record + 4);
  vec4 start = texelFetch(colliders, collider.record + 2);
  vec4 turn = texelFetch(colliders, collider.record + 3);
  vec4 before = turnedAt(start, turn, push.progressBefore);
  vec4 after = turnedAt(start, turn, push.progressAfter);
  // Twice the vector part of after * conjugate(before) is the axis times the angle.
  precise vec3 difference = before.w * after.xyz - after.w * before.xyz - crossProduct(after.xyz, before.xyz);
  precise vec3 spin = (2.0 * push.substepRate) * difference;
  return ColliderFrame(before, after, spin, shape);
}

// ---- What they do

Contact findContact(Collider collider, ColliderFrame frame, vec3 from, vec3 to) {
  precise vec3 before = from - collider.before;
  precise vec3 after = to - collider.after;
  precise float radius = frame.shape.y + collider.thickness;
  before = rotateBack(frame.before, before);
  after = rotateBack(frame.after, after);
  Contact contact = kNoContact;
  if (frame.shape.x == kRoundShape) {
    contact = touchRound(before, after, radius, frame.shape.z);
  } else {
    contact = touchPlanes(colliders, before, after, frame.shape, collider.thickness);
  }
  contact.normal = rotate(frame.after, contact.normal);
  return contact;
}

// Whole numbers, so that the sum does not depend on who comes first.
void tell(uint contact, vec3 gained, float inverseMass) {
  precise float squared = max(dotProduct(gained, gained), 1e-30);
  precise float impulse = (squared * reciprocalSquareRoot(squared)) * reciprocal(inverseMass);
  precise float units = (impulse < kMostImpulse ? impulse : kMostImpulse) * kImpulseUnits;
  atomicAdd(contactImpulses[contact], uint(units) + 1);
}

// Puts a node that comes from `from` out of the collider. Its velocity relative to the surface loses what
// goes into it, and, of what goes along it, at most friction times that. For nodes that can move.
void collide(uint index, Collider collider, ColliderFrame frame, CollisionPush push, CollidingNode who, vec3 from,
             inout vec3 position, inout vec3 velocity) {
  Contact contact = findContact(collider, frame, from, position);
  if (contact.depth <= 0.0) {
    return;
  }
  precise vec3 surface = position + contact.depth * contact.normal;
  position = surface;
  precise vec3 arm = surface - collider.after;
  precise vec3 carried = collider.velocity + crossProduct(frame.spin, arm);
  precise vec3 relative = velocity - carried;
  precise float approach = dotProduct(relative, contact.normal);
  vec3 gained = vec3(0.0);
  if (approach < 0.0) {
    precise vec3 slip = relative - approach * contact.normal;
    precise float inverseSlip = reciprocalSquareRoot(max(dotProduct(slip, slip), 1e-30));
    precise float kept = max(1.0 + collider.friction * approach * inverseSlip, 0.0);
    precise vec3 after = carried + kept * slip;
    precise vec3 difference = after - velocity;
    gained = difference;
    velocity = after;
  }
  if (push.contactClothCount > 0 && who.inverseMass > 0.0) {
    tell(index * push.contactClothCount + who.cloth, gained, who.inverseMass);
  }
}

// Every collider that the node may touch, in ascending order. One that is pushed out of what the list covers
// goes on with the collider that comes next of all.
void collideWithAll(uint node, CollidingNode who, CollisionPush push, float thickness, float friction, vec3 from,
                    inout vec3 position, inout vec3 velocity) {
  NearList list = fetchNearList(node);
  uint i = 0;
  uint next = 0;
  do {
    if (!covers(list, from, position)) {
      list = allColliders(push.colliderCount);
      i = next;
    }
    if (i < list.count) {
      uint index = colliderAt(list, i);
      Collider collider = fetchCollider(index, push, thickness, friction);
      if (mayTouch(collider, from, position)) {
        collide(index, collider, fetchFrame(collider, push), push, who, from, position, velocity);
      }
      next = index + 1;
      ++i;
    }
  } while (i < list.count || !covers(list, from, position));
}

#endif

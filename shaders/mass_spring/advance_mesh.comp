// SPDX-License-Identifier: MIT
// One substep of the mass-spring model for every node of a scene's meshes: spring and air forces,
// integration, collision, as the grids' kernel does it, over lists of what meets at a node.
#version 450
#extension GL_GOOGLE_include_directive : require

#define CLOTHSTREAM_MESH_BINDING 8

#include "shaders/mass_spring/state.glsl"
#include "shaders/shared/mesh_node.glsl"

layout(std430, binding = CLOTHSTREAM_MESH_BINDING + 2) readonly buffer SpringEnds {
  SpringEndRecord springEnds[];
};

vec3 springForces(Node here, MeshNodeRecord lists, vec4 stiffness, vec4 damping) {
  precise vec3 force = vec3(0.0);
  uint end = lists.firstSpring + lists.springCount;
  uint i = lists.firstSpring;
  while (i < end) {
    SpringEndRecord ending = springEnds[i];
    uint kind = springKind(ending.other);
    Spring spring = Spring(stiffness[kind], damping[kind], ending.restLength);
    force = force + springForce(here, fetchNode(otherNode(ending.other)), spring);
    ++i;
  }
  return force;
}

vec3 airForces(Node here, MeshNodeRecord lists, vec4 resistance) {
  precise float drag = push.windAir.w * resistance.x;
  precise float lift = push.windAir.w * resistance.y;
  Air air = Air(push.windAir.xyz, drag, lift);
  precise vec3 force = vec3(0.0);
  uint end = lists.firstTriangle + lists.triangleCount;
  uint i = lists.firstTriangle;
  while (i < end) {
    TriangleCornerRecord corner = triangleCorners[i];
    force = force + airForce(here, fetchNode(corner.second), fetchNode(corner.third), air);
    ++i;
  }
  return force;
}

// Writes cannot race: each node belongs to one invocation, and what is read lies in other buffers.
void main() {
  MeshNode self = locateMeshNode(push.firstTile);
  if (!self.exists) {
    return;
  }
  vec4 stiffness = texelFetch(cloths, self.cloth + 2);
  vec4 damping = texelFetch(cloths, self.cloth + 3);
  Node here = fetchNode(self.index);
  here.velocity = fetchVelocity(self.index);
  precise vec3 force = springForces(here, self.lists, stiffness, damping);
  if (kAir) {
    force = force + airForces(here, self.lists, texelFetch(cloths, self.cloth + 4));
  }
  Node moved = moveNode(here, force, texelFetch(cloths, self.cloth + 1).w);
  if (kColliders && moved.inverseMass > 0.0) {
    collideWithAll(self.index, push.collision, damping.w, stiffness.w, here.position, moved.position,
                   moved.velocity);
  }
  store(self.index, moved);
}

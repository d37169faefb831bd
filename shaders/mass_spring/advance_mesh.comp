// SPDX-License-Identifier: MIT
// One substep of the mass-spring model for every node of a scene's meshes: spring and air forces,
// integration, collision, as the grids' kernel does it, over lists of what meets at a node.
#version 450
#extension GL_GOOGLE_include_directive : require

#define CLOTHSTREAM_MESH_BINDING 9

#include "shaders/mass_spring/state.glsl"
#include "shaders/shared/mesh_node.glsl"

layout(binding = CLOTHSTREAM_MESH_BINDING + 2) uniform samplerBuffer springEnds;  // SpringPairRecord

// Of the spring that `end` is half a SpringPairRecord of.
vec3 endForce(Node here, vec2 end, vec4 stiffness, vec4 damping) {
  bool isShear = end.x < 0.0;
  bool isBend = end.y < 0.0;
  Spring spring = Spring(isShear ? stiffness.y : (isBend ? stiffness.z : stiffness.x),
                         isShear ? damping.y : (isBend ? damping.z : damping.x), abs(end.y));
  return springForce(here, fetchNode(uint(abs(end.x)) - 1), spring);
}

vec3 springForces(Node here, MeshNode self, vec4 stiffness, vec4 damping) {
  precise vec3 force = vec3(0.0);
  if (!kSpringForces) {
    return force;
  }
  TexelRange springs = springsOf(self);
  while (springs.first < springs.end) {
    vec4 ends = texelFetch(springEnds, springs.first);
    force = force + endForce(here, ends.xy, stiffness, damping);
    force = force + endForce(here, ends.zw, stiffness, damping);
    ++springs.first;
  }
  return force;
}

vec3 airForces(Node here, MeshNode self, vec4 resistance) {
  precise float drag = push.windAir.w * resistance.x;
  precise float lift = push.windAir.w * resistance.y;
  Air air = Air(push.windAir.xyz, drag, lift);
  precise vec3 force = vec3(0.0);
  TexelRange triangles = trianglesOf(self);
  while (triangles.first < triangles.end) {
    vec4 corners = texelFetch(triangleCorners, triangles.first);
    force = force + airForce(here, fetchNode(uint(corners.x)), fetchNode(uint(corners.y)), air);
    force = force + airForce(here, fetchNode(uint(corners.z)), fetchNode(uint(corners.w)), air);
    ++triangles.first;
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
  precise vec3 force = springForces(here, self, stiffness, damping);
  if (kAir) {
    force = force + airForces(here, self, texelFetch(cloths, self.cloth + 4));
  }
  Node moved = moveNode(here, force, texelFetch(cloths, self.cloth + 1).w);
  if (kColliders && moved.inverseMass > 0.0) {
    CollidingNode who = CollidingNode(uint(self.cloth) / CLOTHSTREAM_CLOTH_TEXELS, moved.inverseMass);
    collideWithAll(self.index, who, push.collision, damping.w, stiffness.w, here.position, moved.position,
                   moved.velocity);
  }
  store(self.index, moved);
}

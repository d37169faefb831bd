// SPDX-License-Identifier: MIT
// One substep of the mass-spring model for every node of a scene's meshes: spring and air forces, integration
// and collision, over lists of the springs and triangles at each node. advance_mass_spring.comp does the same
// for grids.
#version 450
#extension GL_GOOGLE_include_directive : require

#define CLOTHSTREAM_MESH_BINDING 9

const int kLocalWindBinding = CLOTHSTREAM_MESH_BINDING + 3;

#include "shaders/mass_spring/state.glsl"
#include "shaders/shared/mesh_node.glsl"

layout(binding = CLOTHSTREAM_MESH_BINDING + 2) uniform samplerBuffer springEnds;  // SpringPairRecord

vec3 signedSpringForce(Node here, SignedSpring end, ClothRecord cloth) {
  bool isShear = end.signedOther < 0.0;
  bool isBend = end.signedLength < 0.0;
  Spring spring =
      Spring(isShear ? cloth.shearStiffness : (isBend ? cloth.bendStiffness : cloth.structuralStiffness),
             isShear ? cloth.shearDamping : (isBend ? cloth.bendDamping : cloth.structuralDamping),
             abs(end.signedLength),
             longestSquared(abs(end.signedLength), cloth.activation, !isBend || cloth.solvesBend != 0.0));
  return springForce(here, fetchNode(uint(abs(end.signedOther)) - 1), spring);
}

vec3 springForces(Node here, MeshNode self, ClothRecord cloth) {
  precise vec3 force = vec3(0.0);
  if (!kSpringForces) {
    return force;
  }
  TexelRange springs = springsOf(self);
  while (springs.first < springs.end) {
    SpringPairRecord pair = springPairAt(springEnds, springs.first);
    force = force + signedSpringForce(here, pair.springs[0], cloth);
    force = force + signedSpringForce(here, pair.springs[1], cloth);
    ++springs.first;
  }
  return force;
}

vec3 airForces(Node here, MeshNode self, ClothRecord cloth) {
  precise float drag = push.airFactor * cloth.drag;
  precise float lift = push.airFactor * cloth.lift;
  Air air = Air(push.wind, drag, lift, push.localWinds);
  precise vec3 force = vec3(0.0);
  TexelRange triangles = trianglesOf(self);
  while (triangles.first < triangles.end) {
    OtherCorners pair[2] = cornerPairAt(triangleCorners, triangles.first).triangles;
    force = force + airForce(here, fetchNode(uint(pair[0].second)), fetchNode(uint(pair[0].third)), air);
    force = force + airForce(here, fetchNode(uint(pair[1].second)), fetchNode(uint(pair[1].third)), air);
    ++triangles.first;
  }
  return force;
}

// Writes cannot race: each node belongs to one invocation, and reads go to other buffers.
void main() {
  MeshNode self = locateMeshNode(push.firstTile);
  if (!self.exists) {
    return;
  }
  ClothRecord cloth = clothAt(cloths, self.cloth);
  Node here = fetchNode(self.index);
  here.velocity = fetchVelocity(self.index);
  precise vec3 force = springForces(here, self, cloth);
  if (kAir) {
    force = force + airForces(here, self, cloth);
  }
  Node moved = moveNode(here, force, cloth.velocityDecay);
  if (kColliders && moved.inverseMass > 0.0) {
    CollidingNode node =
        CollidingNode(self.index, self.cloth, moved.inverseMass, cloth.thickness, cloth.friction);
    collideWithAll(node, push.collision, here.position, moved.position, moved.velocity);
  }
  store(self.index, moved);
}

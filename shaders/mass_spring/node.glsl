// SPDX-License-Identifier: MIT
// The state of a node that the forces depend on.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_NODE_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_NODE_GLSL

struct Node {
  vec3 position;
  float inverseMass;
  vec3 velocity;
};

#endif

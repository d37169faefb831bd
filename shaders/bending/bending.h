// SPDX-License-Identifier: MIT
// Tables of the kernels of dihedral bending, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_BENDING_BENDING_H
#define CLOTHSTREAM_SHADERS_BENDING_BENDING_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Read as texels of four floats, in which whole numbers are exact below 2^24.

#define CLOTHSTREAM_HINGE_TEXELS 2
struct HingeRecord {
  vec4 nodes;  // of the scene: the edge's two, then those opposite of it
  vec4 rest;   // weight, bent, least square of a normal as model::Hinge has them; the cloth
};

// Of a node: the texels that name its hinges' forces. Each has up to four numbers: four times a hinge plus
// the node's place in it, plus one; 0: none.
struct HingeListRecord {
  vec4 list;  // the first modulo 2^16, the first / 2^16, how many
};

struct BendingPush {
  uint32_t count;  // of hinges, or of nodes
  float substepSeconds;
};

CLOTHSTREAM_SHARED_END

#endif

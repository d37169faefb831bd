// SPDX-License-Identifier: MIT
// Tables of the kernels of dihedral bending. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_BENDING_BENDING_H
#define CLOTHSTREAM_SHADERS_BENDING_BENDING_H

#include "shaders/shared/types.h"
#include "shaders/shared/whole_number.h"

CLOTHSTREAM_SHARED_BEGIN

// model::Hinge: two triangles that share an edge.
#define CLOTHSTREAM_HINGE_TEXELS 2
struct HingeRecord {
  float edgeStart;  // nodes in the scene
  float edgeEnd;
  float firstOpposite;
  float secondOpposite;

  float weight;
  float restQuarter;  // tan of a quarter of the angle at rest
  float leastSquare;  // m^4, lower bound of a normal's square
  float cloth;
};

// The forces on a node: four numbers per texel. A number is four times a hinge, plus the node's place in the
// hinge, plus one; 0 fills the last texel. ListRecord says where the texels of a node are.
struct HingeNumbers {
  vec4 four;
};

struct BendingPush {
  uint32_t count;  // of hinges or nodes
  float substepSeconds;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(HingeRecord) == CLOTHSTREAM_HINGE_TEXELS * sizeof(vec4) && sizeof(HingeNumbers) == 16);
}  // namespace clothstream::shared
#else

HingeRecord hingeAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_HINGE_TEXELS * int(number);
  vec4 nodes = texelFetch(table, first);
  vec4 rest = texelFetch(table, first + 1);
  return HingeRecord(CLOTHSTREAM_FLOATS(nodes), CLOTHSTREAM_FLOATS(rest));
}

#endif

#endif

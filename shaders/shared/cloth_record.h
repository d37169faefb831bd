// SPDX-License-Identifier: MIT
// The table of cloths: one record per cloth, which C++ writes and kernels read by name.
#ifndef CLOTHSTREAM_SHADERS_SHARED_CLOTH_RECORD_H
#define CLOTHSTREAM_SHADERS_SHARED_CLOTH_RECORD_H

#include "shaders/shared/types.h"
#include "shaders/shared/whole_number.h"

CLOTHSTREAM_SHARED_BEGIN

// Terms of the XPBD correction of one kind of spring: model::XpbdSpring.
struct XpbdSpringRecord {
  float stretch;
  float damping;
  float memory;
  float reserved;
};

// One cloth: its nodes, its material and its solver. SI units. Four members share a texel of the table; only
// this struct says which.
struct ClothRecord {
  float firstNodeLow;  // first node in the scene: wholeNumber(low, high)
  float firstNodeHigh;
  float rows;     // 0: the cloth is a mesh
  float columns;  // of a mesh: number of nodes

  float columnSpacing;  // rest lengths of a grid's springs, m
  float rowSpacing;
  float diagonalSpacing;
  float velocityDecay;  // 1/s

  float structuralStiffness;  // N/m
  float shearStiffness;
  float bendStiffness;
  float friction;  // Coulomb coefficient against colliders

  float structuralDamping;  // N s/m
  float shearDamping;
  float bendDamping;
  float thickness;  // m, kept from colliders

  float drag;  // air coefficients
  float lift;
  float ballRadius;    // self-collision, m; 0: none
  float ballFriction;  // self-collision

  float scaledCompliance;  // compliance / h^2, 1/kg
  float solverIterations;
  float squaredTolerance;
  float solvesBend;  // 1: bend springs are part of the linear system

  float activation;          // stretch up to which ACAD leaves a spring alone, [Va21] 3.3
  float correctionFraction;  // share of an excess length that one substep removes
  float gridInverseMass;     // 1/kg, inverse mass of a grid's free node
  float bendingRigidity;     // dihedral bending, N m

  XpbdSpringRecord xpbdSprings[3];  // structural, shear, bend
};

#define CLOTHSTREAM_CLOTH_TEXELS 10
#define CLOTHSTREAM_CLOTH_XPBD_TEXEL 7

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(ClothRecord) == CLOTHSTREAM_CLOTH_TEXELS * sizeof(vec4) &&
              offsetof(ClothRecord, xpbdSprings) == CLOTHSTREAM_CLOTH_XPBD_TEXEL * sizeof(vec4));
}  // namespace clothstream::shared
#else

// `kind`: 0 structural, 1 shear, 2 bend.
XpbdSpringRecord xpbdSpringAt(samplerBuffer table, uint cloth, uint kind) {
  vec4 texel =
      texelFetch(table, CLOTHSTREAM_CLOTH_TEXELS * int(cloth) + CLOTHSTREAM_CLOTH_XPBD_TEXEL + int(kind));
  return XpbdSpringRecord(CLOTHSTREAM_FLOATS(texel));
}

// Drivers drop the loads of members that a kernel does not use.
ClothRecord clothAt(samplerBuffer table, uint cloth) {
  int first = CLOTHSTREAM_CLOTH_TEXELS * int(cloth);
  vec4 place = texelFetch(table, first);
  vec4 spacing = texelFetch(table, first + 1);
  vec4 stiffness = texelFetch(table, first + 2);
  vec4 damping = texelFetch(table, first + 3);
  vec4 air = texelFetch(table, first + 4);
  vec4 solver = texelFetch(table, first + 5);
  vec4 limits = texelFetch(table, first + 6);
  return ClothRecord(CLOTHSTREAM_FLOATS(place), CLOTHSTREAM_FLOATS(spacing), CLOTHSTREAM_FLOATS(stiffness),
                     CLOTHSTREAM_FLOATS(damping), CLOTHSTREAM_FLOATS(air), CLOTHSTREAM_FLOATS(solver),
                     CLOTHSTREAM_FLOATS(limits),
                     XpbdSpringRecord[3](xpbdSpringAt(table, cloth, 0), xpbdSpringAt(table, cloth, 1),
                                         xpbdSpringAt(table, cloth, 2)));
}

bool isMesh(ClothRecord cloth) {
  return cloth.rows == 0.0;
}

uint firstNodeOf(ClothRecord cloth) {
  return wholeNumber(cloth.firstNodeLow, cloth.firstNodeHigh);
}

uint nodeCountOf(ClothRecord cloth) {
  return isMesh(cloth) ? uint(cloth.columns) : uint(cloth.rows) * uint(cloth.columns);
}

#endif

#endif

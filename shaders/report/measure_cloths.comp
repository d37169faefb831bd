// SPDX-License-Identifier: MIT
// Measures the stretch of the structural springs and the energies of every cloth. An invocation handles a run
// of nodes, each with its springs to nodes of higher numbers. Writes cannot race: sums belong to one run, and
// counts are added atomically as whole numbers, whose order does not matter.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/report/report.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/mesh.h"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;        // ClothRecord
layout(binding = 1) uniform samplerBuffer blocks;        // ReportBlockRecord
layout(binding = 2) uniform samplerBuffer reportCloths;  // ReportClothRecord
layout(binding = 3) uniform samplerBuffer positions;     // w: inverse mass
layout(binding = 4) uniform samplerBuffer velocities;
layout(binding = 5) uniform samplerBuffer meshNodes;   // MeshNodeRecord
layout(binding = 6) uniform samplerBuffer springEnds;  // SpringPairRecord
layout(std430, binding = 7) writeonly buffer Runs {
  ReportSums runs[];
};
layout(std430, binding = 8) buffer Counts {
  uint counts[];
};

layout(push_constant) uniform Push {
  MeasurePush push;
};

ReportSums sums = ReportSums(-1e30, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
// Consecutive stretches mostly fall into the same bin: they are counted here until another bin is needed.
uint openBin = 0;
uint inOpenBin = 0;
uint firstCount;

void countOpenBin() {
  if (inOpenBin > 0) {
    atomicAdd(counts[firstCount + openBin], inOpenBin);
  }
  inOpenBin = 0;
}

void count(float stretch) {
  uint bin = stretch < 9.5367431640625e-7 ? 0u : (floatBitsToUint(stretch) >> 18) - kStretchFirst + 1u;
  bin = min(bin, kStretchBins - 1u);
  if (bin != openBin) {
    countOpenBin();
    openBin = bin;
  }
  ++inOpenBin;
}

// Computes the extension as a difference of squares, which rounds less than a difference of two similar
// lengths.
void measureSpring(vec3 here, uint other, float restLength, float stiffness, bool structural) {
  precise vec3 d = texelFetch(positions, int(other)).xyz - here;
  precise float squared = dotProduct(d, d);
  precise float safe = max(squared, 1e-24);
  precise float length_ = safe * reciprocalSquareRoot(safe);
  precise float extension = (squared - restLength * restLength) * reciprocal(length_ + restLength);
  precise float elastic = sums.elastic + (0.5 * stiffness * extension) * extension;
  sums.elastic = elastic;
  if (structural) {
    precise float stretch = extension * reciprocal(restLength);
    precise float strain = sums.strain + abs(stretch);
    sums.strain = strain;
    sums.largest = max(sums.largest, stretch);
    count(stretch);
  }
}

void measureGridSprings(vec3 here, uint index, uint inCloth, ClothRecord cloth, ReportClothRecord springs) {
  uint rows = uint(cloth.rows);
  uint columns = uint(cloth.columns);
  uint row = inCloth / columns;
  uint column = inCloth - row * columns;
  bool right = column + 1 < columns;
  bool down = row + 1 < rows;
  if (right) {
    measureSpring(here, index + 1, cloth.columnSpacing, springs.structuralStiffness, true);
  }
  if (down) {
    measureSpring(here, index + columns, cloth.rowSpacing, springs.structuralStiffness, true);
  }
  if (down && column > 0) {
    measureSpring(here, index + columns - 1, cloth.diagonalSpacing, springs.shearStiffness, false);
  }
  if (down && right) {
    measureSpring(here, index + columns + 1, cloth.diagonalSpacing, springs.shearStiffness, false);
  }
  if (column + 2 < columns) {
    precise float length_ = 2.0 * cloth.columnSpacing;
    measureSpring(here, index + 2, length_, springs.bendStiffness, false);
  }
  if (row + 2 < rows) {
    precise float length_ = 2.0 * cloth.rowSpacing;
    measureSpring(here, index + 2 * columns, length_, springs.bendStiffness, false);
  }
}

void measureSignedSpring(vec3 here, uint index, SignedSpring end, ReportClothRecord springs) {
  uint other = uint(abs(end.signedOther)) - 1;
  bool isShear = end.signedOther < 0.0;
  bool isBend = end.signedLength < 0.0;
  if (other > index) {
    float stiffness =
        isShear ? springs.shearStiffness : (isBend ? springs.bendStiffness : springs.structuralStiffness);
    measureSpring(here, other, abs(end.signedLength), stiffness, !isShear && !isBend);
  }
}

void measureMeshSprings(vec3 here, uint index, uint meshNode, ReportClothRecord springs) {
  TexelRange list = rangeOf(meshNodeAt(meshNodes, meshNode).springs);
  while (list.first < list.end) {
    SpringPairRecord pair = springPairAt(springEnds, list.first);
    measureSignedSpring(here, index, pair.springs[0], springs);
    measureSignedSpring(here, index, pair.springs[1], springs);
    ++list.first;
  }
}

// Adds the energies of a free node.
void measureNode(vec3 here, float inverseMass, uint index) {
  float mass = reciprocal(inverseMass);
  vec3 velocity = texelFetch(velocities, int(index)).xyz;
  precise float kinetic = sums.kinetic + (0.5 * mass) * dotProduct(velocity, velocity);
  precise float gravity = sums.gravity - mass * (dotProduct(push.gravity.xyz, here) + push.gravity.w);
  sums.kinetic = kinetic;
  sums.gravity = gravity;
}

void main() {
  uint block = gl_GlobalInvocationID.x / kReportRuns;
  if (block >= push.blockCount) {
    return;
  }
  uint run = gl_GlobalInvocationID.x - block * kReportRuns;
  ReportBlockRecord place = reportBlockAt(blocks, block);
  uint number = uint(place.cloth);
  ClothRecord cloth = clothAt(cloths, number);
  ReportClothRecord springs = reportClothAt(reportCloths, number);
  bool meshed = isMesh(cloth);
  uint firstNode = firstNodeOf(cloth);
  uint first = uint(place.firstNode);
  uint end = min(first + kReportBlock, nodeCountOf(cloth));
  firstCount = number * kReportCounts;
  for (uint inCloth = first + run; inCloth < end; inCloth += kReportRuns) {
    uint index = firstNode + inCloth;
    vec4 here = texelFetch(positions, int(index));
    if (here.w > 0.0) {
      measureNode(here.xyz, here.w, index);
    }
    if (meshed) {
      measureMeshSprings(here.xyz, index, uint(place.firstMeshNode) + inCloth - first, springs);
    } else {
      measureGridSprings(here.xyz, index, inCloth, cloth, springs);
    }
  }
  countOpenBin();
  runs[block * kReportRuns + run] = sums;
}

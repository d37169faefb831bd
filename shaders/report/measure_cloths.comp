// SPDX-License-Identifier: MIT
// Stretch of the structural springs, and the energies, of every cloth: an invocation a run of nodes, each
// with the springs to nodes of higher numbers. Writes cannot race: sums belong to one run, counts are added
// up atomically, and the order of whole numbers does not matter.
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
// Stretches that follow each other are mostly alike: they are counted here until another bin's turn comes.
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

// The extension is a difference of squares, which rounds less than that of two lengths that are almost one.
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

void measureGridSprings(vec3 here, uint index, uint inCloth, vec4 place, int record, vec4 stiffness) {
  uint rows = uint(place.z);
  uint columns = uint(place.w);
  uint row = inCloth / columns;
  uint column = inCloth - row * columns;
  vec4 spacing = texelFetch(cloths, record + 1);
  bool right = column + 1 < columns;
  bool down = row + 1 < rows;
  if (right) {
    measureSpring(here, index + 1, spacing.x, stiffness.x, true);
  }
  if (down) {
    measureSpring(here, index + columns, spacing.y, stiffness.x, true);
  }
  if (down && column > 0) {
    measureSpring(here, index + columns - 1, spacing.z, stiffness.y, false);
  }
  if (down && right) {
    measureSpring(here, index + columns + 1, spacing.z, stiffness.y, false);
  }
  if (column + 2 < columns) {
    measureSpring(here, index + 2, 2.0 * spacing.x, stiffness.z, false);
  }
  if (row + 2 < rows) {
    measureSpring(here, index + 2 * columns, 2.0 * spacing.y, stiffness.z, false);
  }
}

// Of half a SpringPairRecord.
void measureEnd(vec3 here, uint index, vec2 end, vec4 stiffness) {
  uint other = uint(abs(end.x)) - 1;
  bool isShear = end.x < 0.0;
  bool isBend = end.y < 0.0;
  if (other > index) {
    measureSpring(here, other, abs(end.y), isShear ? stiffness.y : (isBend ? stiffness.z : stiffness.x),
                  !isShear && !isBend);
  }
}

void measureMeshSprings(vec3 here, uint index, uint inMeshes, vec4 stiffness) {
  vec4 list = texelFetch(meshNodes, CLOTHSTREAM_MESH_NODE_TEXELS * int(inMeshes));
  int texel = int(uint(list.x) + (uint(list.y) << 16));
  int end = texel + int(list.z);
  while (texel < end) {
    vec4 ends = texelFetch(springEnds, texel);
    measureEnd(here, index, ends.xy, stiffness);
    measureEnd(here, index, ends.zw, stiffness);
    ++texel;
  }
}

// Of nodes that can move.
void measureNode(vec3 here, float inverseMass, uint index) {
  float mass = reciprocal(inverseMass);
  vec3 velocity = texelFetch(velocities, int(index)).xyz;
  precise float kinetic = sums.kinetic + (0.5 * mass) * dotProduct(velocity, velocity);
  precise float gravity = sums.gravity - mass * dotProduct(push.gravity.xyz, here);
  sums.kinetic = kinetic;
  sums.gravity = gravity;
}

void main() {
  uint block = gl_GlobalInvocationID.x / kReportRuns;
  if (block >= push.blockCount) {
    return;
  }
  uint run = gl_GlobalInvocationID.x - block * kReportRuns;
  vec4 blockPlace = texelFetch(blocks, int(block));
  uint cloth = uint(blockPlace.x);
  int record = CLOTHSTREAM_CLOTH_TEXELS * int(cloth);
  vec4 place = texelFetch(cloths, record);
  vec4 stiffness = texelFetch(reportCloths, CLOTHSTREAM_REPORT_CLOTH_TEXELS * int(cloth));
  bool isMesh = place.z == 0.0;
  uint firstNode = uint(place.x) + (uint(place.y) << 16);
  uint nodes = isMesh ? uint(place.w) : uint(place.z) * uint(place.w);
  uint first = uint(blockPlace.y);
  uint end = min(first + kReportBlock, nodes);
  firstCount = cloth * kReportCounts;
  for (uint inCloth = first + run; inCloth < end; inCloth += kReportRuns) {
    uint index = firstNode + inCloth;
    vec4 here = texelFetch(positions, int(index));
    if (here.w > 0.0) {
      measureNode(here.xyz, here.w, index);
    }
    if (isMesh) {
      measureMeshSprings(here.xyz, index, uint(blockPlace.z) + inCloth - first, stiffness);
    } else {
      measureGridSprings(here.xyz, index, inCloth, place, record, stiffness);
    }
  }
  countOpenBin();
  runs[block * kReportRuns + run] = sums;
}

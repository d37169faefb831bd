// SPDX-License-Identifier: MIT
// The systems of grids at the substep's start: the weight of each spring, kept at one of its nodes, and what
// conjugate gradients start with at each node. One chunk a workgroup; every node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

layout(std430, binding = 10) writeonly buffer Along {
  vec4 along[];  // vectors.glsl
};
layout(std430, binding = 11) writeonly buffer Across {
  vec4 across[];
};
layout(std430, binding = 12) writeonly buffer Vectors {
  vec4 vectors[];
};

struct Cloth {
  uint start, rows, columns;
  Kind alongRow, alongColumn, shear, bendRow, bendColumn;
  bool hasBend;
  vec4 limits;
  float compliance;
};

Kind kindOf(float restLength, float stiffness, float damping) {
  precise float elastic = push.substepSeconds * push.substepSeconds * stiffness;
  precise float viscous = push.substepSeconds * damping;
  return Kind(restLength, elastic, viscous);
}

Cloth clothOf(System system) {
  vec4 spacing = texelFetch(cloths, system.cloth + 1);
  vec4 solver = texelFetch(cloths, system.cloth + 5);
  vec4 k = texelFetch(cloths, system.cloth + 2);
  vec4 d = texelFetch(cloths, system.cloth + 3);
  return Cloth(system.firstNode, system.rows, system.columns, kindOf(spacing.x, k.x, d.x),
               kindOf(spacing.y, k.x, d.x), kindOf(spacing.z, k.y, d.y), kindOf(2.0 * spacing.x, k.z, d.z),
               kindOf(2.0 * spacing.y, k.z, d.z), kBend && solver.w != 0.0,
               texelFetch(cloths, system.cloth + 6), solver.x);
}

// A node beyond an edge lies on it.
uint nodeAt(Cloth cloth, int row, int column) {
  return cloth.start + uint(clamp(row, 0, int(cloth.rows) - 1)) * cloth.columns +
         uint(clamp(column, 0, int(cloth.columns) - 1));
}

Weight springTo(Cloth cloth, End here, int row, int column, Kind kind, bool exists) {
  bool inside = row >= 0 && row < int(cloth.rows) && column >= 0 && column < int(cloth.columns);
  return weigh(here, endAt(nodeAt(cloth, row, column)), kind, cloth.limits, exists && inside);
}

void prepareNode(Cloth cloth, int row, int column, bool stored) {
  uint node = nodeAt(cloth, row, column);
  End here = endAt(node);
  Weight right = springTo(cloth, here, row, column + 1, cloth.alongRow, true);
  Weight below = springTo(cloth, here, row + 1, column, cloth.alongColumn, true);
  Weight rightBelow = springTo(cloth, here, row + 1, column + 1, cloth.shear, true);
  Weight right2 = springTo(cloth, here, row, column + 2, cloth.bendRow, cloth.hasBend);
  Weight below2 = springTo(cloth, here, row + 2, column, cloth.bendColumn, cloth.hasBend);
  End rightEnd = endAt(nodeAt(cloth, row, column + 1));
  Weight fromRight = springTo(cloth, rightEnd, row + 1, column, cloth.shear, column + 1 < int(cloth.columns));
  Weight others[6] = Weight[](springTo(cloth, here, row, column - 1, cloth.alongRow, true),
                              springTo(cloth, here, row - 1, column, cloth.alongColumn, true),
                              springTo(cloth, here, row - 1, column - 1, cloth.shear, true),
                              springTo(cloth, here, row - 1, column + 1, cloth.shear, true),
                              springTo(cloth, here, row + 1, column - 1, cloth.shear, true),
                              springTo(cloth, here, row, column - 2, cloth.bendRow, cloth.hasBend));
  Weight above2 = springTo(cloth, here, row - 2, column, cloth.bendColumn, cloth.hasBend);

  precise vec3 impulse = right.impulse + below.impulse + rightBelow.impulse + right2.impulse + below2.impulse;
  precise float trace = right.trace + below.trace + rightBelow.trace + right2.trace + below2.trace;
  precise float all = right.along + below.along + rightBelow.along + right2.along + below2.along;
  [[unroll]] for (int i = 0; i < 6; ++i) {
    impulse = impulse + others[i].impulse;
    trace = trace + others[i].trace;
    all = all + others[i].along;
  }
  impulse = impulse + above2.impulse;
  trace = trace + above2.trace;
  all = all + above2.along;

  Start start = startOf(here, impulse, trace, cloth.compliance);
  if (stored) {
    along[2 * node] = vec4(right.along, below.along, rightBelow.along, fromRight.along);
    along[2 * node + 1] = vec4(right2.along, below2.along, start.mass, 0.0);
    if (kImplicit) {
      across[2 * node] = vec4(right.across, below.across, rightBelow.across, fromRight.across);
      across[2 * node + 1] = vec4(right2.across, below2.across, 0.0, 0.0);
    }
    vectors[kResiduals * push.nodes + node] = start.residual;
    vectors[kCorrections * push.nodes + node] = vec4(start.correction, 0.0);
    if (kImplicit || all > 0.0) {
      atomicOr(touched, 1);
    }
    uint active_ = (right.along > 0.0 ? 1 : 0) + (below.along > 0.0 ? 1 : 0) +
                   (rightBelow.along > 0.0 ? 1 : 0) + (fromRight.along > 0.0 ? 1 : 0) +
                   (right2.along > 0.0 ? 1 : 0) + (below2.along > 0.0 ? 1 : 0);
    if (!kImplicit) {
      atomicAdd(activeSprings, active_);
    }
  }
}

void main() {
  vec4 part = texelFetch(chunks, int(push.firstChunk + gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  uint chunk = uint(part.y);
  Cloth cloth = clothOf(system);
  // Of ACAD's chunks check_stretch.comp has said which.
  bool wanted = !kAdaptive || (actives[system.firstChunk + chunk] & kPrepared) != 0;
  uint end = wanted ? kLanes : 0;
  beginChunk();
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    uint k = 0;
    do {
      prepareNode(cloth, int(walk.row + k), int(walk.column), k < walk.count && lane < end);
      ++k;
    } while (k < kWalk);
    lane += width();
  } while (lane < end);
  if (!kAdaptive) {
    keepActive(system, chunk);
  }
  keepActiveSprings(system);
}

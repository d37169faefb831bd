// SPDX-License-Identifier: MIT
// Computes the systems of grids at the substep's start: the weight of each spring, stored at one of its
// nodes, and the start of conjugate gradients at each node. A workgroup handles one chunk; every node belongs
// to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

layout(std430, binding = 10) writeonly buffer Along {
  vec4 along[];  // SpringWeights
};
layout(std430, binding = 11) writeonly buffer Across {
  vec4 across[];
};
layout(std430, binding = 12) buffer Vectors {
  vec4 vectors[];
};

struct Grid {
  uint start, rows, columns;
  SpringKind alongRow, alongColumn, shear, bendRow, bendColumn;
  bool hasBend;
  ClothRecord cloth;
};

Grid gridOf(System system) {
  ClothRecord cloth = clothAt(cloths, system.cloth);
  float structural = cloth.structuralStiffness, structuralDamping = cloth.structuralDamping;
  precise float bendRow = 2.0 * cloth.columnSpacing;
  precise float bendColumn = 2.0 * cloth.rowSpacing;
  float bend = cloth.bendStiffness, bendDamping = cloth.bendDamping;
  return Grid(system.firstNode, system.rows, system.columns,
              springKind(cloth.columnSpacing, structural, structuralDamping),
              springKind(cloth.rowSpacing, structural, structuralDamping),
              springKind(cloth.diagonalSpacing, cloth.shearStiffness, cloth.shearDamping),
              springKind(bendRow, bend, bendDamping), springKind(bendColumn, bend, bendDamping),
              kBend && cloth.solvesBend != 0.0, cloth);
}

// Node of a grid; a place beyond an edge gives the node on the edge.
uint nodeAt(Grid grid, int row, int column) {
  return grid.start + uint(clamp(row, 0, int(grid.rows) - 1)) * grid.columns +
         uint(clamp(column, 0, int(grid.columns) - 1));
}

Weight springTo(Grid grid, End here, int row, int column, SpringKind kind, bool exists) {
  bool inside = row >= 0 && row < int(grid.rows) && column >= 0 && column < int(grid.columns);
  return weightOf(here, endAt(nodeAt(grid, row, column)), kind, grid.cloth, exists && inside);
}

void prepareNode(Grid grid, int row, int column, bool stored, bool continued) {
  uint node = nodeAt(grid, row, column);
  End here = endAt(node);
  Weight right = springTo(grid, here, row, column + 1, grid.alongRow, true);
  Weight below = springTo(grid, here, row + 1, column, grid.alongColumn, true);
  Weight rightBelow = springTo(grid, here, row + 1, column + 1, grid.shear, true);
  Weight right2 = springTo(grid, here, row, column + 2, grid.bendRow, grid.hasBend);
  Weight below2 = springTo(grid, here, row + 2, column, grid.bendColumn, grid.hasBend);
  End rightEnd = endAt(nodeAt(grid, row, column + 1));
  Weight fromRight = springTo(grid, rightEnd, row + 1, column, grid.shear, column + 1 < int(grid.columns));
  Weight others[6] = Weight[](springTo(grid, here, row, column - 1, grid.alongRow, true),
                              springTo(grid, here, row - 1, column, grid.alongColumn, true),
                              springTo(grid, here, row - 1, column - 1, grid.shear, true),
                              springTo(grid, here, row - 1, column + 1, grid.shear, true),
                              springTo(grid, here, row + 1, column - 1, grid.shear, true),
                              springTo(grid, here, row, column - 2, grid.bendRow, grid.hasBend));
  Weight above2 = springTo(grid, here, row - 2, column, grid.bendColumn, grid.hasBend);

  precise vec3 impulse = right.impulse + below.impulse + rightBelow.impulse + right2.impulse + below2.impulse;
  precise float all = right.along + below.along + rightBelow.along + right2.along + below2.along;
  [[unroll]] for (int i = 0; i < 6; ++i) {
    impulse = impulse + others[i].impulse;
    all = all + others[i].along;
  }
  impulse = impulse + above2.impulse;
  all = all + above2.along;

  vec3 total = kLimit && continued ? vectors[kTotals * push.nodes + node].xyz : vec3(0.0);
  Start start = startOf(here, impulse, grid.cloth.scaledCompliance, total);
  if (stored) {
    SpringWeights weights = SpringWeights(right.along, below.along, rightBelow.along, fromRight.along,
                                          right2.along, below2.along, massFactor(grid.cloth), 0.0);
    along[2 * node] = firstTexelOf(weights);
    along[2 * node + 1] = secondTexelOf(weights);
    if (kImplicit) {
      SpringWeights acrossWeights = SpringWeights(right.across, below.across, rightBelow.across,
                                                  fromRight.across, right2.across, below2.across, 0.0, 0.0);
      across[2 * node] = firstTexelOf(acrossWeights);
      across[2 * node + 1] = secondTexelOf(acrossWeights);
    }
    vectors[kResiduals * push.nodes + node] = start.residual;
    vectors[kCorrections * push.nodes + node] = vec4(start.correction, 0.0);
    if (kLimit) {
      vectors[kTotals * push.nodes + node] = vec4(total, 0.0);
    }
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
  // check_stretch.comp has listed the chunks of ACAD.
  uint place = push.firstChunk + gl_WorkGroupID.x;
  if (kAdaptive) {
    place = actives[2 * (actives.length() / 3) + place];
  }
  ChunkRecord part = chunkAt(chunks, place);
  System system = systemAt(uint(part.system));
  uint chunk = uint(part.chunk);
  Grid grid = gridOf(system);
  bool continued = kLimit && (actives[place] & kContinued) != 0;
  beginChunk();
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    uint k = 0;
    do {
      prepareNode(grid, int(walk.row + k), int(walk.column), k < walk.count, continued);
      ++k;
    } while (k < kWalk);
    lane += width();
  } while (lane < kLanes);
  if (!kAdaptive) {
    keepActive(system, chunk);
  }
  keepActiveSprings(system);
}

// SPDX-License-Identifier: MIT
// Lists the nodes of a grid that ACAD solves for: the ends of stretched springs, in the order of walks. One
// workgroup lists the nodes of a system. The forces have marked the walks where a spring may be stretched.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_STRETCHED_NODES_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_STRETCHED_NODES_GLSL

#include "shaders/solve/linear_system.glsl"
#include "shaders/solve/stretched_tables.glsl"

// True: the workgroup is wide, and continues solves that the narrow one found too long for its device.
layout(constant_id = 5) const bool kContinues = false;

layout(binding = 3) uniform samplerBuffer positions;  // at the substep's start; w: inverse mass
// Free positions twice, as the vectors of conjugate_gradient.glsl: rounds of the limit read what others
// wrote.
layout(binding = 4, rgba32f) uniform coherent readonly imageBuffer freeTexels;
layout(std430, binding = 5) coherent buffer FreePositions {
  vec4 freePositions[];
};
layout(binding = 6) uniform samplerBuffer freeVelocities;
layout(std430, binding = 12) coherent buffer Lists {
  uint lists[];
};
layout(std430, binding = 14) coherent buffer Stretches {
  uint stretches[];  // StateBuffers
};

layout(push_constant) uniform Push {
  StretchedPush push;
};

#include "shaders/solve/spring_weight.glsl"

const uint kAllOfWalk = (1u << kWalk) - 1;

System system;
ClothRecord cloth;
uint walkCount;

uint at(uint table, uint i) {
  return table * push.nodes + system.firstNode + i;
}

// The neighbours of a node in the order in which products add up their springs: rows, columns.
const uint kNeighbours = kBend ? 12 : 8;
const ivec2 kOffsets[12] =
    ivec2[](ivec2(0, -1), ivec2(0, 1), ivec2(-1, 0), ivec2(1, 0), ivec2(-1, -1), ivec2(-1, 1), ivec2(1, -1),
            ivec2(1, 1), ivec2(0, -2), ivec2(0, 2), ivec2(-2, 0), ivec2(2, 0));

float restLengthOf(uint neighbour) {
  precise float along = neighbour % 4 < 2 ? cloth.columnSpacing : cloth.rowSpacing;
  precise float twice = 2.0 * along;
  return neighbour < 4 ? along : (neighbour < 8 ? cloth.diagonalSpacing : twice);
}

bool hasSpringTo(uint neighbour, ivec2 place) {
  bool inside = place.x >= 0 && place.x < int(system.rows) && place.y >= 0 && place.y < int(system.columns);
  return inside && (neighbour < 8 || cloth.solvesBend != 0.0);
}

// A place beyond an edge gives the node on the edge, counted from the cloth's first one.
uint nodeAt(ivec2 place) {
  uvec2 inside = uvec2(clamp(place, ivec2(0), ivec2(system.rows, system.columns) - 1));
  return inside.x * system.columns + inside.y;
}

vec4 decisivePosition(uint node) {
  if (kPaper) {
    return texelFetch(positions, int(system.firstNode + node));
  }
  return imageLoad(freeTexels, int(system.firstNode + node));
}

// True if a spring at the node is stretched.
bool isStretched(ivec2 place) {
  vec4 here = decisivePosition(nodeAt(place));
  bool any = false;
  [[unroll]] for (uint i = 0; i < kNeighbours; ++i) {
    vec4 other = decisivePosition(nodeAt(place + kOffsets[i]));
    float restLength = restLengthOf(i);
    precise float longest = restLength + cloth.activation * restLength;
    precise float inverseMasses = here.w + other.w;
    any = any || (hasSpringTo(i, place + kOffsets[i]) && inverseMasses > 0.0 &&
                  isTooLong(here.xyz, other.xyz, longest));
  }
  return any;
}

const uint kMostInvocations = CLOTHSTREAM_STRETCHED_INVOCATIONS;
shared uint counts[kMostInvocations];
shared uint listed[2];  // walks with nodes to solve for, and these nodes

// Sum of `count` over the invocations before this one. All of them in `all`.
uint sumBefore(uint count, out uint all) {
  barrier();
  counts[self()] = count;
  barrier();
  for (uint step_ = 1; step_ < width(); step_ *= 2) {
    uint before = self() >= step_ ? counts[max(self(), step_) - step_] : 0;
    barrier();
    counts[self()] += before;
    barrier();
  }
  all = counts[width() - 1];
  return counts[self()] - count;
}

void finishPass() {
  memoryBarrier();
  barrier();
}

// Consecutive numbers below `count` of each invocation. At least 1.
uint shareOf(uint count) {
  return max((count + width() - 1) / width(), 1);
}

uint placeOfFlag(bool marked, uint walk) {
  return marked ? push.firstMark + system.firstNode + walk : at(kFlags, walk);
}
uint flagOf(bool marked, uint walk) {
  return marked ? stretches[placeOfFlag(true, walk)] : lists[placeOfFlag(false, walk)];
}

// Lists the walks that the forces have marked, or those with a flag, in `table`, in their order. Clears what
// it has read. Returns their number.
uint listWalks(bool marked, uint table) {
  uint share = shareOf(walkCount), first = self() * share;
  uint count = 0, i = 0;
  do {
    uint walk = min(first + i, walkCount - 1);
    count += first + i < walkCount && flagOf(marked, walk) != 0 ? 1 : 0;
    ++i;
  } while (i < share);
  uint all;
  uint place = sumBefore(count, all);
  i = 0;
  do {
    uint walk = min(first + i, walkCount - 1);
    bool exists = first + i < walkCount;
    if (exists && flagOf(marked, walk) != 0) {
      lists[at(table, place)] = walk;
      ++place;
    }
    if (exists && marked) {
      stretches[placeOfFlag(true, walk)] = 0;
      lists[at(kMasks, walk)] = 0;
    } else if (exists) {
      lists[placeOfFlag(false, walk)] = 0;
    }
    ++i;
  } while (i < share);
  finishPass();
  return all;
}

// Flags the walks around those listed, so that both ends of a stretched spring are tested.
void flagAround(uint seeds) {
  const int kReach = kBend ? 2 : 1;
  uint i = self();
  do {
    uint walk = lists[at(kWalks, min(i, max(seeds, 1) - 1))];
    ivec2 place = ivec2(walk / system.columns, walk % system.columns);
    ivec2 last = ivec2(walkCount / system.columns, system.columns) - 1;
    [[unroll]] for (int row = -1; row <= 1; ++row) {
      [[unroll]] for (int column = -kReach; column <= kReach; ++column) {
        ivec2 other = clamp(place + ivec2(row, column), ivec2(0), last);
        if (i < seeds) {
          lists[at(kFlags, uint(other.x) * system.columns + uint(other.y))] = 1;
        }
      }
    }
    i += width();
  } while (i < seeds);
  finishPass();
}

// Finds the nodes of the walks to test. Nodes of the round before stay, because springs that are no longer
// stretched must give back what they did.
void testWalks(uint tested) {
  uint i = self();
  do {
    uint walk = lists[at(kTested, min(i, max(tested, 1) - 1))];
    uint mask = 0;
    [[unroll]] for (uint k = 0; k < kWalk; ++k) {
      uint row = walk / system.columns * kWalk + k;
      bool any = isStretched(ivec2(row, walk % system.columns));
      mask |= any && row < system.rows ? 1u << k : 0;
    }
    uint before = lists[at(kMasks, walk)] & kAllOfWalk;
    if (i < tested) {
      lists[at(kMasks, walk)] = mask | before | before << kWalk;
    }
    i += width();
  } while (i < tested);
  finishPass();
}

// Lists the walks with nodes to solve for, and these nodes.
void listNodes(uint tested) {
  uint share = shareOf(tested), first = self() * share;
  uvec2 count = uvec2(0);
  uint i = 0;
  do {
    uint walk = lists[at(kTested, min(first + i, max(tested, 1) - 1))];
    uint nodes = first + i < tested ? bitCount(lists[at(kMasks, walk)] & kAllOfWalk) : 0;
    count += uvec2(nodes > 0 ? 1 : 0, nodes);
    ++i;
  } while (i < share);
  uvec2 all;
  uint walkPlace = sumBefore(count.x, all.x);
  uint nodePlace = sumBefore(count.y, all.y);
  i = 0;
  do {
    uint walk = lists[at(kTested, min(first + i, max(tested, 1) - 1))];
    uint mask = first + i < tested ? lists[at(kMasks, walk)] & kAllOfWalk : 0;
    if (mask != 0) {
      lists[at(kWalks, walkPlace)] = walk;
      lists[at(kFirsts, walk)] = nodePlace;
      ++walkPlace;
    }
    [[unroll]] for (uint k = 0; k < kWalk; ++k) {
      if ((mask >> k & 1) != 0) {
        uint row = walk / system.columns * kWalk + k;
        lists[at(kNodes, nodePlace)] = row * system.columns + walk % system.columns;
        ++nodePlace;
      }
    }
    ++i;
  } while (i < share);
  if (self() == 0) {
    listed[0] = all.x;
    listed[1] = all.y;
  }
  finishPass();
}

// Place of a node among those listed. The node must be one of them.
uint placeOfNode(uint node) {
  uint row = node / system.columns;
  uint walk = row / kWalk * system.columns + node % system.columns;
  uint before = lists[at(kMasks, walk)] & ((1u << row % kWalk) - 1);
  return lists[at(kFirsts, walk)] + bitCount(before);
}

// True if the round before solved for the node.
bool isContinued(uint node) {
  uint row = node / system.columns;
  uint walk = row / kWalk * system.columns + node % system.columns;
  return (lists[at(kMasks, walk)] >> (kWalk + row % kWalk) & 1) != 0;
}

// Lists the nodes of a round in `kNodes`.
void findNodes(uint round) {
  uint seeds = 0;
  if (round == 0) {
    seeds = listWalks(true, kWalks);
  } else {
    seeds = listed[0];
  }
  flagAround(seeds);
  uint tested = listWalks(false, kTested);
  testWalks(tested);
  listNodes(tested);
}

#endif

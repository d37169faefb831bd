// SPDX-License-Identifier: MIT
// Separates pairs (kSlide), or limits the motion of their nodes. The direction of a pair is that of the
// shortest line between its sides at the substep's start.
//
// Separation: what would bring the nearest points closer than the gap is shared among the nodes by weight and
// inverse mass; slide_nodes.comp takes the weighted mean of a node's corrections.
//
// Limit: a plane across that direction separates both sides at the start. Each side may advance up to the
// plane, which stands where both demand the same share of the room. A node gets the largest share of its
// motion that keeps it on its side of all planes. Sides are convex, so that they stay apart all the way.
//
// Writes are atomic minima and sums of integers, whose order does not matter. If the list is too short, no
// node moves, so that nothing needs to be computed.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

#include "shaders/motion_bound/motion_bound.h"
#include "shaders/motion_bound/shortest_line.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const bool kEdges = false;
layout(constant_id = 2) const bool kSlide = false;

layout(binding = 0) uniform samplerBuffer parts;   // PartRecord
layout(binding = 1) uniform samplerBuffer faces;   // FaceRecord
layout(binding = 2) uniform samplerBuffer starts;  // positions at the substep's start
layout(binding = 3) uniform samplerBuffer ends;    // and at its end; w: inverse mass
layout(std430, binding = 4) readonly buffer Pairs {
  uvec2 pairs[];
};
layout(std430, binding = 5) readonly buffer Groups {
  PairCounts counts;
};
layout(std430, binding = 6) buffer Corrections {
  int corrections[];  // x, y, z in units and weight, by node
};
layout(std430, binding = 7) buffer Shares {
  uint shares[];  // bits of a float from 0 to 1, by node
};

layout(push_constant) uniform Push {
  PairPush push;
};

const float kIntersecting = 1e-12;  // m^2, squared distance of a pair that already intersects
const float kApproach = 0.1;        // share of the gap by which a pair that is too near separates
const float kFloor = 0.1;           // share of the gap that no pair gives up
const float kLeastShare = 1.0 / kCorrectionWeight;
const float kRounding = 0.999;       // share of a limit that is used
const float kMostCorrection = 0.05;  // m

// The weight of a correction is the share of the node in the end of the pair's line.
void correct(uint node, float share, vec3 by) {
  precise vec3 units = kCorrectionUnits * by;
  precise float weight = kCorrectionWeight * share;
  atomicAdd(corrections[4 * node], int(units.x));
  atomicAdd(corrections[4 * node + 1], int(units.y));
  atomicAdd(corrections[4 * node + 2], int(units.z));
  atomicAdd(corrections[4 * node + 3], int(weight));
}

void limitTo(uint node, float share) {
  precise float used = kRounding * share;
  atomicMin(shares[node], floatBitsToUint(used));
}

void main() {
  uint place = push.firstPair + gl_GlobalInvocationID.x;
  uint capacity = kEdges ? push.edgePairs : push.nodePairs;
  if (gl_GlobalInvocationID.x >= kPartPairs || place >= counts.count || counts.count > capacity) {
    return;
  }
  uvec2 pair = pairs[place];
  uint nodes[4];
  if (kEdges) {
    PartRecord part = partAt(parts, pair.x);
    PartRecord other = partAt(parts, pair.y);
    nodes = uint[4](uint(part.first), uint(part.second), uint(other.first), uint(other.second));
  } else {
    vec3 corners = faceAt(faces, pair.y).corners;
    nodes = uint[4](pair.x, uint(corners.x), uint(corners.y), uint(corners.z));
  }
  vec3 from[4], to[4];
  float masses[4];
  vec3 origin = texelFetch(starts, int(nodes[0])).xyz;
  [[unroll]] for (int k = 0; k < 4; ++k) {
    vec4 end = texelFetch(ends, int(nodes[k]));
    precise vec3 begun = texelFetch(starts, int(nodes[k])).xyz - origin;
    precise vec3 ended = end.xyz - origin;
    from[k] = begun;
    to[k] = ended;
    masses[k] = end.w;
  }
  // The first side has positive weights, the second one negative weights.
  vec4 weights = kEdges ? shortestBetweenEdges(from[0], from[1], from[2], from[3])
                        : shortestToTriangle(from[0], from[1], from[2], from[3]);
  precise vec3 line = weights.x * from[0] + weights.y * from[1] + weights.z * from[2] + weights.w * from[3];
  float squared = dotProduct(line, line);
  if (!(squared > kIntersecting)) {
    return;
  }
  float inverse = reciprocalSquareRoot(squared);
  precise vec3 normal = inverse * line;
  precise float distance = squared * inverse;
  float before[4], after[4];
  [[unroll]] for (int k = 0; k < 4; ++k) {
    before[k] = dotProduct(normal, from[k]);
    after[k] = dotProduct(normal, to[k]);
  }

  if (kSlide) {
    precise float apart =
        weights.x * after[0] + weights.y * after[1] + weights.z * after[2] + weights.w * after[3];
    precise float further = distance + kApproach * push.gap;
    precise float lacking = (further < push.gap ? further : push.gap) - apart;
    precise vec4 moved = weights * vec4(masses[0], masses[1], masses[2], masses[3]);
    precise float give =
        moved.x * weights.x + moved.y * weights.y + moved.z * weights.z + moved.w * weights.w;
    if (lacking > 0.0 && give > 0.0) {
      precise float most = lacking < kMostCorrection ? lacking : kMostCorrection;
      precise float strength = most * reciprocal(max(give, 1e-20));
      [[unroll]] for (int k = 0; k < 4; ++k) {
        float share = abs(weights[k]);
        precise float along = share * (strength * moved[k]);
        if (along != 0.0 && share >= kLeastShare) {
          precise vec3 by = along * normal;
          correct(nodes[k], share, by);
        }
      }
    }
    return;
  }

  const int second = kEdges ? 2 : 1;
  float lowest = 1e30, lowestAfter = 1e30, highest = -1e30, highestAfter = -1e30;
  [[unroll]] for (int k = 0; k < 4; ++k) {
    if (k < second) {
      lowest = min(lowest, before[k]);
      lowestAfter = min(lowestAfter, after[k]);
    } else {
      highest = max(highest, before[k]);
      highestAfter = max(highestAfter, after[k]);
    }
  }
  precise float room = lowest - highest;
  // Rounding spoiled the direction: nothing of this pair moves.
  precise float leastRoom = 0.5 * distance;
  if (!(room >= leastRoom)) {
    [[unroll]] for (int k = 0; k < 4; ++k) {
      limitTo(nodes[k], 0.0);
    }
    return;
  }
  precise float free = max(room - kFloor * push.gap, 0.0);
  precise float down = max(lowest - lowestAfter, 0.0);
  precise float up = max(highestAfter - highest, 0.0);
  precise float demand = down + up;
  if (demand <= free) {
    return;
  }
  precise float freeShare = free * reciprocal(max(demand, 1e-20));
  precise float lowLimit = lowest - freeShare * down;
  precise float highLimit = highest + freeShare * up;
  [[unroll]] for (int k = 0; k < 4; ++k) {
    precise float allowed = k < second ? before[k] - lowLimit : highLimit - before[k];
    precise float wanted = k < second ? before[k] - after[k] : after[k] - before[k];
    if (wanted > allowed) {
      precise float share = max(allowed, 0.0) * reciprocal(max(wanted, 1e-20));
      limitTo(nodes[k], share < 1.0 ? share : 1.0);
    }
  }
}

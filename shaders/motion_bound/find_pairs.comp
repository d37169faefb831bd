// SPDX-License-Identifier: MIT
// Lists the pairs of a node and a triangle, or of two edges, without a common node, that could meet in the
// substep. A pair farther apart than its longest motions and the gap is omitted.
//
// The order of the pairs is arbitrary: their results are minima and sums of integers. If there are more than
// the list holds, their number says so.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

const int kStartBinding = 2;

#include "shaders/motion_bound/moving_node.glsl"

layout(local_size_x_id = 0) in;
// True: pairs of edges. False: pairs of a node and a triangle.
layout(constant_id = 1) const bool kEdges = false;

layout(binding = 0) uniform samplerBuffer parts;  // PartRecord
layout(binding = 1) uniform samplerBuffer faces;  // FaceRecord
layout(std430, binding = 4) readonly buffer Boxes {
  vec4 boxes[];
};
layout(std430, binding = 5) writeonly buffer Pairs {
  uvec2 pairs[];  // part, and triangle or other part
};
layout(std430, binding = 6) buffer Groups {
  PairGroups groups;
};

layout(push_constant) uniform Push {
  PairPush push;
};

// True if two groups of points, which lie at least `apart` / |u| from each other along u, could meet.
bool mayMeet(float apart, vec3 u, float reach) {
  precise float least = reach * reach * dotProduct(u, u);
  precise float squared = apart * apart;
  return !(apart > 0.0 && squared > 1.001 * least);
}

bool nodeMayMeet(vec3 node, Moving a, Moving b, Moving c, float reach) {
  precise vec3 toA = a.at - node;
  precise vec3 toB = b.at - node;
  precise vec3 toC = c.at - node;
  precise vec3 u = 0.33333334 * (toA + toB + toC);
  float atA = dotProduct(toA, u), atB = dotProduct(toB, u), atC = dotProduct(toC, u);
  float least = min(atA, min(atB, atC));
  return mayMeet(least, u, reach);
}

bool edgesMayMeet(Moving a, Moving b, Moving c, Moving d, float reach) {
  precise vec3 half1 = 0.5 * (b.at - a.at);
  precise vec3 half2 = 0.5 * (d.at - c.at);
  precise vec3 u = (c.at + half2) - (a.at + half1);
  precise float apart = dotProduct(u, u) - abs(dotProduct(half1, u)) - abs(dotProduct(half2, u));
  return mayMeet(apart, u, reach);
}

void add(uint part, uint other) {
  uint place = atomicAdd(groups.count, 1u);
  if (place < push.capacity) {
    pairs[place] = uvec2(part, other);
    atomicMax(groups.x, place / gl_WorkGroupSize.x + 1);
  }
}

void addEdges(uint part, uvec2 own, Moving a, Moving b, float edge) {
  PartRecord other = partAt(parts, edge > float(part) ? uint(edge) : part);
  uvec2 nodes = uvec2(other.first, other.second);
  bool apart = edge > float(part) && nodes.x != own.x && nodes.x != own.y && nodes.y != own.x && nodes.y != own.y;
  Moving c = movingNode(nodes.x), d = movingNode(nodes.y);
  precise float reach = max(a.way, b.way) + max(c.way, d.way) + push.gap;
  if (apart && edgesMayMeet(a, b, c, d, reach)) {
    add(part, uint(edge));
  }
}

void addNode(uint part, uint node, Moving here, uint face) {
  uvec3 corners = uvec3(faceAt(faces, face).corners);
  bool apart = corners.x != node && corners.y != node && corners.z != node;
  Moving a = movingNode(corners.x), b = movingNode(corners.y), c = movingNode(corners.z);
  precise float reach = here.way + max(a.way, max(b.way, c.way)) + push.gap;
  if (apart && nodeMayMeet(here.at, a, b, c, reach)) {
    add(part, face);
  }
}

// Each round takes the next triangle whose box the part meets: nodes that a device runs together test their
// pairs at the same time.
void main() {
  if (gl_GlobalInvocationID.x >= push.partCount) {
    return;
  }
  uint part = push.firstPart + gl_GlobalInvocationID.x;
  PartRecord record = partAt(parts, part);
  uvec2 nodes = uvec2(record.first, record.second);
  Moving a = movingNode(nodes.x), b = movingNode(nodes.y);
  precise float reach = max(a.way, b.way) + 0.5 * push.gap;
  precise vec3 low = min(a.at, b.at) - reach;
  precise vec3 high = max(a.at, b.at) + reach;
  for (uint box = 0; box < push.boxCount;) {
    vec4 otherLow = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box];
    vec4 otherHigh = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box + 1];
    bool meets = all(lessThanEqual(low, otherHigh.xyz)) && all(greaterThanEqual(high, otherLow.xyz));
    box = meets ? box + 1 : uint(otherLow.w);
    if (meets && otherHigh.w >= 0.0) {
      uint face = uint(otherHigh.w);
      if (kEdges) {
        vec3 edges = faceAt(faces, face).edges;
        addEdges(part, nodes, a, b, edges.x);
        addEdges(part, nodes, a, b, edges.y);
        addEdges(part, nodes, a, b, edges.z);
      } else {
        addNode(part, nodes.x, a, face);
      }
    }
  }
}

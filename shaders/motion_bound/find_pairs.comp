// SPDX-License-Identifier: MIT
// Lists the pairs of a node and a triangle, and of two edges, without a common node, that could meet in the
// substep: those of two triangles whose boxes overlap. Each node and each edge belongs to one triangle. A
// pair farther apart than its longest motions and the gap is omitted. If the list of triangles is too short,
// no node moves, so that nothing needs to be found.
//
// The order of the pairs is arbitrary, and does not change the result. If there are more than a list holds,
// their number says so.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

const int kStartBinding = 1;

#include "shaders/motion_bound/moving_node.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer faces;  // FaceRecord
layout(std430, binding = 3) readonly buffer FacePairs {
  uvec2 facePairs[];
};
layout(std430, binding = 4) readonly buffer FaceGroups {
  PairCounts faceCounts;
};
layout(std430, binding = 5) writeonly buffer NodePairs {
  uvec2 nodePairs[];  // node and triangle
};
layout(std430, binding = 6) buffer NodeGroups {
  PairCounts nodeCounts;
  uint nodeSizes[];
};
layout(std430, binding = 7) writeonly buffer EdgePairs {
  uvec2 edgePairs[];  // two edges
};
layout(std430, binding = 8) buffer EdgeGroups {
  PairCounts edgeCounts;
  uint edgeSizes[];
};

layout(push_constant) uniform Push {
  PairPush push;
};

struct Face {
  uint number;
  uint nodes[3];
  Moving corners[3];
  vec3 edges;
  uint owned;
};

Face fetchFace(uint number) {
  FaceRecord record = faceAt(faces, number);
  uint a = uint(record.corners.x), b = uint(record.corners.y), c = uint(record.corners.z);
  return Face(number, uint[3](a, b, c), Moving[3](movingNode(a), movingNode(b), movingNode(c)), record.edges,
              uint(record.owned));
}

// True if two groups of points, which lie at least `apart` / |u| from each other along u, could meet.
bool mayMeet(float apart, vec3 u, float reach) {
  precise float least = reach * reach * dotProduct(u, u);
  precise float squared = apart * apart;
  precise float most = 1.001 * least;
  return !(apart > 0.0 && squared > most);
}

bool nodeMayMeet(Moving node, Moving a, Moving b, Moving c) {
  precise vec3 toA = a.at - node.at;
  precise vec3 toB = b.at - node.at;
  precise vec3 toC = c.at - node.at;
  precise vec3 u = 0.33333334 * (toA + toB + toC);
  float atA = dotProduct(toA, u), atB = dotProduct(toB, u), atC = dotProduct(toC, u);
  precise float reach = node.way + max(a.way, max(b.way, c.way)) + push.gap;
  return mayMeet(min(atA, min(atB, atC)), u, reach);
}

bool edgesMayMeet(Moving a, Moving b, Moving c, Moving d) {
  precise vec3 half1 = 0.5 * (b.at - a.at);
  precise vec3 half2 = 0.5 * (d.at - c.at);
  precise vec3 u = (c.at + half2) - (a.at + half1);
  precise float apart = dotProduct(u, u) - abs(dotProduct(half1, u)) - abs(dotProduct(half2, u));
  precise float reach = max(a.way, b.way) + max(c.way, d.way) + push.gap;
  return mayMeet(apart, u, reach);
}

// Loops that run at most once are branches that lavapipe skips if no invocation takes them.
void addNodes(Face one, Face other) {
  [[unroll]] for (int i = 0; i < 3; ++i) {
    uint node = one.nodes[i];
    bool apart = (one.owned >> i & 1u) != 0 && node != other.nodes[0] && node != other.nodes[1] &&
                 node != other.nodes[2];
    for (bool found =
             apart && nodeMayMeet(one.corners[i], other.corners[0], other.corners[1], other.corners[2]);
         found; found = false) {
      uint place = atomicAdd(nodeCounts.count, 1u);
      if (place < push.nodePairs) {
        nodePairs[place] = uvec2(node, other.number);
        atomicMax(nodeSizes[3 * (place / kPartPairs)], place % kPartPairs / gl_WorkGroupSize.x + 1);
      }
    }
  }
}

void addEdges(Face one, Face other) {
  [[unroll]] for (int i = 0; i < 3; ++i) {
    [[unroll]] for (int k = 0; k < 3; ++k) {
      const int i2 = (i + 1) % 3, k2 = (k + 1) % 3;
      bool apart = one.edges[i] >= 0.0 && other.edges[k] >= 0.0 && one.nodes[i] != other.nodes[k] &&
                   one.nodes[i] != other.nodes[k2] && one.nodes[i2] != other.nodes[k] &&
                   one.nodes[i2] != other.nodes[k2];
      for (bool found =
               apart && edgesMayMeet(one.corners[i], one.corners[i2], other.corners[k], other.corners[k2]);
           found; found = false) {
        uint place = atomicAdd(edgeCounts.count, 1u);
        if (place < push.edgePairs) {
          edgePairs[place] = uvec2(one.edges[i], other.edges[k]);
          atomicMax(edgeSizes[3 * (place / kPartPairs)], place % kPartPairs / gl_WorkGroupSize.x + 1);
        }
      }
    }
  }
}

void main() {
  uint place = push.firstPair + gl_GlobalInvocationID.x;
  if (gl_GlobalInvocationID.x >= kPartPairs || place >= faceCounts.count ||
      faceCounts.count > push.facePairs) {
    return;
  }
  uvec2 pair = facePairs[place];
  Face one = fetchFace(pair.x), other = fetchFace(pair.y);
  addNodes(one, other);
  addNodes(other, one);
  addEdges(one, other);
}

// SPDX-License-Identifier: MIT
// Nodes and parts of cloths and hulls.
layout(set = 0, binding = kPositionsBinding, std430) readonly buffer Positions {
  float positions[];
};
layout(set = 0, binding = kVerticesBinding, std430) readonly buffer Vertices {
  VertexRecord vertices[];
};
layout(set = 0, binding = kPartsBinding, std430) readonly buffer Parts {
  PartRecord parts[];
};

vec3 positionOf(uint node) {
  return vec3(positions[3 * node], positions[3 * node + 1], positions[3 * node + 2]);
}

// SPDX-License-Identifier: MIT
// Moves the coarse nodes of one cloth until linked ones are at most as far apart as they may be: Gauss-Seidel
// sweeps over the links, colour by colour. One workgroup does all.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/coarse/coarse.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer coarseNodes;  // CoarseNodeRecord
layout(binding = 1) uniform samplerBuffer parts;
layout(binding = 2) uniform samplerBuffer means;    // two CoarseShare per texel
layout(binding = 3) uniform samplerBuffer colours;  // ListRecord of links
layout(binding = 4) uniform samplerBuffer links;    // CoarseLinkRecord
layout(binding = 5) uniform samplerBuffer positions;
layout(std430, binding = 6) writeonly buffer Corrections {
  vec4 corrections[];  // of each coarse node, m
};

layout(push_constant) uniform Push {
  CoarsePush push;
};

shared vec3 places[CLOTHSTREAM_COARSE_NODES];
shared vec3 starts[CLOTHSTREAM_COARSE_NODES];

vec3 meanOfMesh(uint node) {
  precise vec3 mean = vec3(0.0);
  int first = int(push.firstPart + node * push.parts);
  for (int part = 0; part < int(push.parts); ++part) {
    mean = mean + texelFetch(parts, first + part).xyz;
  }
  return mean;
}

// Adds the rows of average_rows.comp with the weights of the coarse row.
vec3 meanOfGrid(uint node) {
  uint coarseRow = node / push.coarseColumns;
  uint coarseColumn = node - coarseRow * push.coarseColumns;
  CoarseHat hat =
      coarseHat(coarseRow, push.coarseRows, push.stride, push.rows, push.inverseStride, push.inverseLastRows);
  precise vec3 sum = vec3(0.0);
  precise float weights = 0.0;
  for (uint row = hat.first; row <= hat.last; ++row) {
    float weight = coarseWeight(hat, row);
    vec4 part = texelFetch(parts, int(push.firstPart + row * push.coarseColumns + coarseColumn));
    sum = sum + weight * part.xyz;
    weights = weights + weight * part.w;
  }
  precise vec3 mean = sum * reciprocal(weights);
  return mean;
}

void load(uint node) {
  CoarseNodeRecord record = coarseNodeAt(coarseNodes, push.firstCoarse + node);
  vec3 mean;
  if (record.isMovable == 0.0) {
    vec4 pin = texelFetch(means, int(wholeNumber(record.firstLow, record.firstHigh)));
    mean = texelFetch(positions, int(pin.x)).xyz;
  } else {
    mean = push.rows > 0 ? meanOfGrid(node) : meanOfMesh(node);
  }
  places[node] = mean;
  starts[node] = mean;
}

void hold(CoarseLinkRecord link) {
  uint a = uint(link.a);
  uint b = uint(link.b);
  precise vec3 apart = places[b] - places[a];
  float square = dotProduct(apart, apart);
  precise float longestSquare = link.longest * link.longest;
  if (square <= longestSquare) {
    return;
  }
  precise vec3 move = (1.0 - link.longest * reciprocalSquareRoot(square)) * apart;
  precise float partOfB = 1.0 - link.partOfA;
  precise vec3 newA = places[a] + link.partOfA * move;
  precise vec3 newB = places[b] - partOfB * move;
  places[a] = newA;
  places[b] = newB;
}

// Writes cannot race: links of a colour have no common coarse node.
void main() {
  uint lane = gl_LocalInvocationID.x;
  for (uint node = lane; node < push.coarseCount; node += gl_WorkGroupSize.x) {
    load(node);
  }
  for (uint sweep = 0; sweep < push.sweeps; ++sweep) {
    for (uint colour = 0; colour < push.colourCount; ++colour) {
      barrier();
      TexelRange range = rangeOf(listAt(colours, push.firstColour + colour));
      for (int i = range.first + int(lane); i < range.end; i += int(gl_WorkGroupSize.x)) {
        hold(coarseLinkAt(links, i));
      }
    }
  }
  barrier();
  for (uint node = lane; node < push.coarseCount; node += gl_WorkGroupSize.x) {
    precise vec3 correction = places[node] - starts[node];
    corrections[push.firstCoarse + node] = vec4(correction, 0.0);
  }
}

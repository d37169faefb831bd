// SPDX-License-Identifier: MIT
// What the constraints at a node add up to there.
#ifndef CLOTHSTREAM_SHADERS_CONSTRAINT_INCIDENCE_GLSL
#define CLOTHSTREAM_SHADERS_CONSTRAINT_INCIDENCE_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/shared/simulation.h"
#include "shaders/shared/whole_number.glsl"

layout(binding = 0) uniform samplerBuffer cloths;      // ClothRecord
layout(binding = 1) uniform samplerBuffer systems;     // SystemRecord
layout(binding = 2) uniform samplerBuffer incidences;  // IncidenceRecord, a node
layout(binding = 3) uniform samplerBuffer lists;
layout(binding = 4) uniform samplerBuffer rows;  // a constraint: its direction from a to b; 0: not active

// Loops whose number of rounds differs between invocations test first: lavapipe 22.3 lets those that are done
// run on in a loop that tests at its end.
//
// J^T x at a node, by its constraints in their order. `SCALAR(i)` gives x of the scene's constraint i.
#define GATHER(result, incidence, firstLink, SCALAR)                                    \
  {                                                                                     \
    int texel = int(wholeNumber(incidence.x, incidence.y));                             \
    int end = texel + int(incidence.z);                                                 \
    precise vec3 sum = vec3(0.0);                                                       \
    while (texel < end) {                                                               \
      vec4 four = texelFetch(lists, texel);                                             \
      [[unroll]] for (int k = 0; k < 4; ++k) {                                          \
        float number = four[k];                                                         \
        uint link = firstLink + uint(max(abs(number), 1.0)) - 1;                        \
        float along = number == 0.0 ? 0.0 : (number < 0.0 ? -1.0 : 1.0) * SCALAR(link); \
        sum = sum + along * texelFetch(rows, int(link)).xyz;                            \
      }                                                                                 \
      ++texel;                                                                          \
    }                                                                                   \
    result = sum;                                                                       \
  }

#endif

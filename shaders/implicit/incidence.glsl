// SPDX-License-Identifier: MIT
// Which springs of implicit cloths meet at a node.
#ifndef CLOTHSTREAM_SHADERS_IMPLICIT_INCIDENCE_GLSL
#define CLOTHSTREAM_SHADERS_IMPLICIT_INCIDENCE_GLSL

#include "shaders/shared/simulation.h"
#include "shaders/shared/whole_number.glsl"

layout(binding = 0) uniform samplerBuffer cloths;      // ClothRecord
layout(binding = 1) uniform samplerBuffer systems;     // SystemRecord
layout(binding = 2) uniform samplerBuffer incidences;  // IncidenceRecord, a node
layout(binding = 3) uniform samplerBuffer lists;       // SpringEndsRecord
layout(binding = 4) uniform samplerBuffer rows;        // a spring: prepare_springs.comp

struct SpringList {
  int first;
  int end;
};

SpringList springsOf(uint node) {
  vec4 list = texelFetch(incidences, int(node));
  int first = int(wholeNumber(list.x, list.y));
  return SpringList(first, first + int(list.z));
}

// 0 where the list only fills its last texel.
float signOf(float number) {
  return number == 0.0 ? 0.0 : (number < 0.0 ? -1.0 : 1.0);
}

int springOf(float number, uint firstSpring) {
  return int(firstSpring + uint(max(abs(number), 1.0)) - 1);
}

#endif

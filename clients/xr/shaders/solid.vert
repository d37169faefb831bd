#version 450
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/frame.glsl"
#include "clients/xr/shaders/solid.glsl"

layout(location = 0) out vec3 outPlace;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec3 outLocal;
layout(location = 3) flat out uint outSolid;

void main() {
  SolidRecord solid = solids[gl_InstanceIndex];
  SolidVertex vertex = vertexOf(solid, gl_VertexIndex);
  outPlace = placeOf(solid, vertex.local);
  outNormal = turned(solid.orientation, vertex.normal);
  outLocal = vertex.local;
  outSolid = gl_InstanceIndex;
  gl_Position = frame.viewProjection[gl_ViewIndex] * vec4(outPlace, 1.0);
}

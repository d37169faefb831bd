// SPDX-License-Identifier: MIT
// Vertices of spheres, capsules, boxes and planes, from their index. Those of a capsule are in rows of equal
// latitude.
layout(set = 0, binding = kSolidsBinding, std430) readonly buffer Solids {
  SolidRecord solids[];
};

const uint kBox = 1;
const uint kPlane = 2;

vec3 turned(vec4 q, vec3 v) {
  return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

struct SolidVertex {
  vec3 local;   // in the frame of the solid
  vec3 normal;  // likewise
};

SolidVertex capsuleVertex(vec4 shape, uint index, uint rows, uint columns) {
  uint row = index / columns;
  float longitude = 6.28318531 * float(index % columns) / float(columns);
  // Half of the rows are on each ball. The cone between them touches both at the same latitude.
  bool isUpper = row > rows;
  float rise = clamp((shape.y - shape.x) / max(shape.z, 1e-6), -0.99, 0.99);
  float touching = shape.z > 1e-6 ? -asin(rise) : 0.0;
  float part = float(isUpper ? row - rows - 1 : row) / float(rows);
  float latitude = isUpper ? mix(touching, 1.57079633, part) : mix(-1.57079633, touching, part);
  float radius = isUpper ? shape.y : shape.x;
  SolidVertex vertex;
  vertex.normal = vec3(cos(latitude) * cos(longitude), sin(latitude), -cos(latitude) * sin(longitude));
  vertex.local = radius * vertex.normal + vec3(0.0, isUpper ? 0.5 * shape.z : -0.5 * shape.z, 0.0);
  return vertex;
}

// Corner `index`, 0 to 35, of a cube's triangles.
SolidVertex boxVertex(vec4 shape, uint index) {
  uint face = index / 6;
  uint axis = face >> 1;
  float side = (face & 1u) == 0 ? 1.0 : -1.0;
  const vec2 corners[6] =
      vec2[](vec2(-0.5), vec2(0.5, -0.5), vec2(0.5), vec2(-0.5), vec2(0.5), vec2(-0.5, 0.5));
  vec2 c = corners[index % 6];
  c.x *= side;
  SolidVertex vertex;
  vertex.normal = vec3(axis == 0, axis == 1, axis == 2) * side;
  vec3 place = axis == 0 ? vec3(0.5 * side, c) : axis == 1 ? vec3(c.y, 0.5 * side, c.x) : vec3(c, 0.5 * side);
  vertex.local = place * shape.xyz;
  return vertex;
}

SolidVertex planeVertex(vec4 shape, uint index) {
  const vec2 corners[6] =
      vec2[](vec2(-0.5), vec2(0.5), vec2(0.5, -0.5), vec2(-0.5), vec2(-0.5, 0.5), vec2(0.5));
  vec2 c = corners[index % 6];
  SolidVertex vertex;
  vertex.local = vec3(c.x * shape.x, 0.0, c.y * shape.z);
  vertex.normal = vec3(0.0, 1.0, 0.0);
  return vertex;
}

// The kind of a capsule has the number of rows of each of its balls in bits 8 to 15 and that of its columns
// in bits 16 and above.
SolidVertex vertexOf(SolidRecord solid, uint index) {
  uint kind = floatBitsToUint(solid.shape.w);
  SolidVertex vertex;
  if ((kind & 0xFFu) == kBox)
    vertex = boxVertex(solid.shape, index);
  else if ((kind & 0xFFu) == kPlane)
    vertex = planeVertex(solid.shape, index);
  else
    vertex = capsuleVertex(solid.shape, index, (kind >> 8) & 0xFFu, kind >> 16);
  vertex.local *= solid.stretch.xyz;
  vertex.normal /= solid.stretch.xyz;
  return vertex;
}

vec3 placeOf(SolidRecord solid, vec3 local) {
  return solid.position.xyz + turned(solid.orientation, local);
}

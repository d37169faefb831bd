// SPDX-License-Identifier: MIT
// Signed distances of a mesh between the points of its grid (sample_distances.comp), by trilinear
// interpolation. Outside of the grid: a lower bound, from the nearest point of the grid.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_DISTANCE_GRID_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_DISTANCE_GRID_GLSL

#include "shaders/collision/solid_nearest.glsl"

// Whether a mesh of the scene has a grid of distances, and whether one has none.
layout(constant_id = 1) const bool kGrids = false;
layout(constant_id = 2) const bool kTriangles = true;

struct DistanceGrid {
  vec3 origin;
  float cell;
  uvec3 counts;
  float inverseCell;
  uint firstPoint;
};

DistanceGrid gridOf(SolidRecord solid) {
  uint texel = uint(solid.firstGrid);
  vec4 place = texelFetch(solids, int(texel));
  vec4 counts = texelFetch(solids, int(texel) + 1);
  return DistanceGrid(place.xyz, place.w, uvec3(counts.xyz), counts.w,
                      texel + CLOTHSTREAM_DISTANCE_GRID_TEXELS);
}

// A texel has the distances of four points: its own, that at y + 1, that at z + 1, and that at both.
uint distanceTexel(DistanceGrid grid, uvec3 point) {
  return grid.firstPoint + point.x + grid.counts.x * (point.y + grid.counts.y * point.z);
}

// Bilinear interpolation between four such points.
float between4(vec4 corners, float y, float z) {
  precise float low = corners.x + y * (corners.y - corners.x);
  precise float high = corners.z + y * (corners.w - corners.z);
  precise float at = low + z * (high - low);
  return at;
}

Nearest nearestInGrid(SolidRecord solid, vec3 p, float bound) {
  DistanceGrid grid = gridOf(solid);
  vec3 last = vec3(grid.counts - uvec3(1u));
  precise vec3 free = grid.inverseCell * (p - grid.origin);
  vec3 place = clamp(free, vec3(0.0), last);
  uvec3 corner = uvec3(min(floor(place), last - vec3(1.0)));
  precise vec3 part = place - vec3(corner);
  uint texel = distanceTexel(grid, corner);
  vec4 near = texelFetch(solids, int(texel));
  vec4 far = texelFetch(solids, int(texel) + 1);
  precise vec4 across = far - near;
  precise vec4 middle = near + part.x * across;
  float inside = between4(middle, part.y, part.z);
  precise float lowerY = middle.y - middle.x;
  precise float upperY = middle.w - middle.z;
  precise float slopeY = lowerY + part.z * (upperY - lowerY);
  precise float lowerZ = middle.z - middle.x;
  precise float upperZ = middle.w - middle.y;
  precise float slopeZ = lowerZ + part.y * (upperZ - lowerZ);
  vec3 slope = vec3(between4(across, part.y, part.z), slopeY, slopeZ);
  precise vec3 along = slope * reciprocalSquareRoot(max(dotProduct(slope, slope), 1e-24));
  precise vec3 beyond = grid.cell * (free - place);
  float outside = dotProduct(beyond, beyond);
  precise float squared = inside * inside + outside;
  float inverse = reciprocalSquareRoot(max(squared, 1e-24));
  bool isOutside = outside > 0.0;
  precise float size = squared * inverse;
  float distance_ = isOutside ? size : inside;
  precise vec3 outwards = (inside * along + beyond) * inverse;
  vec3 normal = isOutside ? outwards : along;
  precise vec3 point = p - distance_ * normal;
  return Nearest(abs(distance_) < bound, distance_, point, normal, vec3(0.0));
}

// The nearest point of a mesh: on its triangles, or where its grid of distances says.
Nearest nearestPoint(SolidRecord solid, float progress, vec3 p, float bound) {
  if (kGrids && (!kTriangles || solid.firstGrid > 0.0)) {
    return nearestInGrid(solid, p, bound);
  }
  return nearestOnSolid(solid, progress, p, bound);
}

#endif

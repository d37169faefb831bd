// SPDX-License-Identifier: MIT
// The shortest line between two edges, or from a point to a triangle, as weights of the four nodes. The
// weights of the first side are positive and add up to 1, those of the second side to -1.
#ifndef CLOTHSTREAM_SHADERS_MOTION_BOUND_SHORTEST_LINE_GLSL
#define CLOTHSTREAM_SHADERS_MOTION_BOUND_SHORTEST_LINE_GLSL

#include "shaders/shared/arithmetic.glsl"

float clampedShare(float share) {
  return share < 0.0 ? 0.0 : (share < 1.0 ? share : 1.0);
}

// Share of the way from a to b of the point that is nearest to p.
float nearestShare(vec3 p, vec3 a, vec3 b) {
  precise vec3 ab = b - a;
  precise vec3 ap = p - a;
  precise float share = dotProduct(ap, ab) * reciprocal(max(dotProduct(ab, ab), 1e-20));
  return clampedShare(share);
}

// The shorter of two lines.
struct Line {
  float squared;
  vec4 weights;
};

Line shorter(Line best, vec4 weights, vec3 a, vec3 b, vec3 c, vec3 d) {
  precise vec3 line = weights.x * a + weights.y * b + weights.z * c + weights.w * d;
  float squared = dotProduct(line, line);
  bool better = squared < best.squared;
  return Line(better ? squared : best.squared, better ? weights : best.weights);
}

vec4 edgeWeights(float s, float t) {
  precise vec4 weights = vec4(1.0 - s, s, t - 1.0, -t);
  return weights;
}

// Edges ab and cd. The line starts at an end of one of them, or it is the common perpendicular. Every case is
// computed, so that nearly parallel edges are no special case.
vec4 shortestBetweenEdges(vec3 a, vec3 b, vec3 c, vec3 d) {
  Line best = Line(1e30, vec4(1.0, 0.0, -1.0, 0.0));
  best = shorter(best, edgeWeights(0.0, nearestShare(a, c, d)), a, b, c, d);
  best = shorter(best, edgeWeights(1.0, nearestShare(b, c, d)), a, b, c, d);
  best = shorter(best, edgeWeights(nearestShare(c, a, b), 0.0), a, b, c, d);
  best = shorter(best, edgeWeights(nearestShare(d, a, b), 1.0), a, b, c, d);
  precise vec3 u = b - a;
  precise vec3 v = d - c;
  precise vec3 w = a - c;
  float uu = dotProduct(u, u), uv = dotProduct(u, v), vv = dotProduct(v, v);
  float uw = dotProduct(u, w), vw = dotProduct(v, w);
  precise float determinant = uu * vv - uv * uv;
  precise float s = (uv * vw - vv * uw) * reciprocal(max(determinant, 1e-20));
  s = clampedShare(s);
  precise vec3 on = a + s * u;
  return shorter(best, edgeWeights(s, nearestShare(on, c, d)), a, b, c, d).weights;
}

vec4 cornerWeights(float b, float c) {
  precise vec4 weights = vec4(1.0, b + c - 1.0, -b, -c);
  return weights;
}

// From p to the triangle abc.
vec4 shortestToTriangle(vec3 p, vec3 a, vec3 b, vec3 c) {
  Line best = Line(1e30, vec4(1.0, -1.0, 0.0, 0.0));
  float ab = nearestShare(p, a, b), ac = nearestShare(p, a, c), bc = nearestShare(p, b, c);
  precise float rest = 1.0 - bc;
  best = shorter(best, cornerWeights(ab, 0.0), p, a, b, c);
  best = shorter(best, cornerWeights(0.0, ac), p, a, b, c);
  best = shorter(best, cornerWeights(rest, bc), p, a, b, c);
  precise vec3 u = b - a;
  precise vec3 v = c - a;
  precise vec3 w = p - a;
  precise vec3 area = crossProduct(u, v);
  float square = dotProduct(area, area);
  float inverse = reciprocal(max(square, 1e-20));
  precise float second = dotProduct(crossProduct(w, v), area) * inverse;
  precise float third = dotProduct(crossProduct(u, w), area) * inverse;
  precise float sum = second + third;
  bool inside = square > 1e-20 && second >= 0.0 && third >= 0.0 && sum <= 1.0;
  return inside ? shorter(best, cornerWeights(second, third), p, a, b, c).weights : best.weights;
}

#endif

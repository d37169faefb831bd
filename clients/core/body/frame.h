// SPDX-License-Identifier: MIT
// Vectors, rotations and rigid frames in double precision, for bodies.
#pragma once

#include <algorithm>
#include <cmath>

namespace clothstream::client::body {

struct Point {
  double x = 0, y = 0, z = 0;
};

inline Point operator+(const Point& a, const Point& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Point operator*(double factor, const Point& a) {
  return {factor * a.x, factor * a.y, factor * a.z};
}
inline double dot(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Point& a) {
  return std::sqrt(dot(a, a));
}
// Returns `otherwise` for a vector without a direction.
inline Point direction(const Point& a, const Point& otherwise) {
  const double size = length(a);
  return size > 1e-9 ? (1 / size) * a : otherwise;
}
// Part of `a` that is perpendicular to the unit vector `axis`.
inline Point across(const Point& a, const Point& axis) {
  return a - dot(a, axis) * axis;
}
inline Point horizontal(const Point& a) {
  return {a.x, 0, a.z};
}

// Unit quaternion.
struct Rotation {
  double x = 0, y = 0, z = 0, w = 1;
};

inline Rotation operator*(const Rotation& a, const Rotation& b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
inline Rotation inverse(const Rotation& q) {
  return {-q.x, -q.y, -q.z, q.w};
}
inline Point operator*(const Rotation& q, const Point& v) {
  const Point axis{q.x, q.y, q.z};
  const Point twice = 2 * cross(axis, v);
  return v + q.w * twice + cross(axis, twice);
}
// Returns no rotation for numbers that are all zero.
inline Rotation normalised(const Rotation& q) {
  const double square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(square > 1e-18)) return {};
  const double scale = 1 / std::sqrt(square);
  return {scale * q.x, scale * q.y, scale * q.z, scale * q.w};
}
// Rotation by an angle in radians about a unit vector.
inline Rotation about(const Point& axis, double angle) {
  const double sine = std::sin(angle / 2);
  return {sine * axis.x, sine * axis.y, sine * axis.z, std::cos(angle / 2)};
}
// Smallest rotation that turns the unit vector `a` to the unit vector `b`. For opposite vectors it turns
// about an axis that is perpendicular to both.
inline Rotation between(const Point& a, const Point& b) {
  const double cosine = dot(a, b);
  if (cosine < -1 + 1e-12) {
    const Point helper = std::abs(a.x) < 0.6 ? Point{1, 0, 0} : Point{0, 1, 0};
    return about(direction(cross(a, helper), {0, 0, 1}), 3.14159265358979323846);
  }
  const Point axis = cross(a, b);
  return normalised({axis.x, axis.y, axis.z, 1 + cosine});
}
// Angle in radians, 0 to pi, and axis of a rotation; part of it.
inline Rotation part(const Rotation& q, double fraction) {
  const Point axis{q.x, q.y, q.z};
  const double sine = length(axis);
  if (sine < 1e-12) return {};
  const double angle = 2 * std::atan2(sine, std::abs(q.w));
  return about((q.w < 0 ? -1 : 1) / sine * axis, fraction * angle);
}
// Rotation of the frame whose first axis is the unit vector `along`, and whose second one is the part of
// `towards` that is perpendicular to it.
Rotation basis(const Point& along, const Point& towards);

struct Frame {
  Rotation rotation;
  Point position;
};
inline Point operator*(const Frame& frame, const Point& point) {
  return frame.position + frame.rotation * point;
}
inline Frame operator*(const Frame& a, const Frame& b) {
  return {a.rotation * b.rotation, a * b.position};
}
inline Frame inverse(const Frame& frame) {
  const Rotation back = inverse(frame.rotation);
  return {back, -1.0 * (back * frame.position)};
}

// Seven numbers: position, then the quaternion x, y, z, w.
inline Frame frameOf(const float* numbers) {
  return {normalised({numbers[3], numbers[4], numbers[5], numbers[6]}), {numbers[0], numbers[1], numbers[2]}};
}
inline void write(const Frame& frame, float* numbers) {
  const Rotation q = normalised(frame.rotation);
  const double all[7] = {frame.position.x, frame.position.y, frame.position.z, q.x, q.y, q.z, q.w};
  std::transform(all, all + 7, numbers, [](double number) { return static_cast<float>(number); });
}

}  // namespace clothstream::client::body

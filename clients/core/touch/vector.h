// SPDX-License-Identifier: MIT
// Vectors of three numbers, for geometry.
#pragma once

#include <cmath>
#include <cstddef>

namespace clothstream::client {

struct Vector {
  float x = 0, y = 0, z = 0;
};

// Vector number `index` of numbers that are stored one after the other.
inline Vector vectorAt(const float* numbers, std::size_t index) {
  const float* at = numbers + 3 * index;
  return {at[0], at[1], at[2]};
}

inline Vector operator+(const Vector& a, const Vector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector operator-(const Vector& a, const Vector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector operator*(float factor, const Vector& a) {
  return {factor * a.x, factor * a.y, factor * a.z};
}
inline float dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(const Vector& a) {
  return std::sqrt(dot(a, a));
}

}  // namespace clothstream::client

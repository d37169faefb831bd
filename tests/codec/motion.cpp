// SPDX-License-Identifier: MIT
// Cloth-like motions for tests of the codec.
#include "tests/codec/motion.h"

#include <array>
#include <cmath>
#include <random>

namespace clothstream::codec {
namespace {

void append(std::vector<float>& out, double x, double y, double z) {
  out.insert(out.end(), {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
}

void appendUnit(std::vector<float>& out, double x, double y, double z) {
  const double length = std::sqrt(x * x + y * y + z * z);
  append(out, x / length, y / length, z / length);
}

}  // namespace

MotionFrame sampleMotion(const StreamLayout& layout, std::uint64_t tick, float amplitude) {
  MotionFrame frame;
  const double a = static_cast<double>(amplitude), t = static_cast<double>(tick);
  double depth = -1;
  for (const ClothLayout& cloth : layout.cloths) {
    const std::uint32_t columns = cloth.columns == 0 ? cloth.vertexCount : cloth.columns;
    for (std::uint32_t i = 0; i < cloth.vertexCount; ++i) {
      const double x = 0.02 * (i % columns), y = -0.02 * (i / columns);
      const double slow = 6 * x + 2 * y + 0.21 * t, fast = 17 * y - 5 * x - 0.33 * t;
      append(frame.positions, x + 0.3 * a * std::sin(0.1 * t + 4 * y), y + 0.2 * a * std::cos(slow),
             depth + a * std::sin(slow) + 0.3 * a * std::sin(fast));
      appendUnit(frame.normals, -a * (6 * std::cos(slow) - 1.5 * std::cos(fast)),
                 -a * (2 * std::cos(slow) + 5 * std::cos(fast)), std::cos(0.02 * t));
    }
    depth += 0.5;
  }
  return frame;
}

MotionFrame scatter(const StreamLayout& layout, std::uint32_t seed, float extent) {
  MotionFrame frame;
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 2147483648.0 - 1.0; };
  for (std::uint32_t i = 0; i < layout.vertexCount(); ++i) {
    const double e = static_cast<double>(extent);
    // Separate statements, because compilers evaluate function arguments in any order.
    std::array<double, 6> any;
    for (double& value : any) value = uniform();
    append(frame.positions, e * any[0], e * any[1], e * any[2]);
    appendUnit(frame.normals, any[3], any[4], any[5] + 1e-3);
  }
  return frame;
}

StreamLayout mixedLayout(NormalMode normals) {
  return {.epoch = 7,
          .maxError = 0.0005f,
          .normals = normals,
          .cloths = {{.vertexCount = 9 * 7, .rows = 9, .columns = 7},
                     {.vertexCount = 13, .rows = 1, .columns = 13},
                     {.vertexCount = 1, .rows = 1, .columns = 1},
                     {.vertexCount = 10, .rows = 0, .columns = 0},
                     {.vertexCount = 2 * 31, .rows = 2, .columns = 31}}};
}

double degreesBetween(const float* a, const float* b) {
  double dot = 0, cross = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    dot += static_cast<double>(a[i]) * static_cast<double>(b[i]);
    const double c = static_cast<double>(a[j]) * static_cast<double>(b[k]) -
                     static_cast<double>(a[k]) * static_cast<double>(b[j]);
    cross += c * c;
  }
  return std::atan2(std::sqrt(cross), dot) * 57.29577951308232;
}

}  // namespace clothstream::codec

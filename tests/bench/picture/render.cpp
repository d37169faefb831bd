// SPDX-License-Identifier: MIT
// Renders triangles on the CPU: first the visible triangle of each sample, then its light.
#include "tests/bench/picture/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace clothstream::bench {
namespace {

using model::Vec3;

constexpr std::uint32_t kSamples = 3;  // samples a pixel along each axis
constexpr int kShadowSize = 2048;
constexpr float kShadowReach = 12, kShadowBias = 0.06f;  // m
constexpr float kFar = std::numeric_limits<float>::max();

const Vec3 kLamp = Vec3(0.45f, 0.8f, 0.4f).normalized();  // direction towards the lamp
const Vec3 kSky(0.93f, 0.95f, 0.97f);
const Vec3 kFloor(0.78f, 0.79f, 0.80f);

// A point in a raster: x to the right and y down in samples, its depth, and the factor by which perspective
// reduces its weight.
struct Projected {
  float x, y, depth, nearness;
};

// Directions right, up and forward of the viewer or of the lamp.
struct Frame {
  Vec3 origin, right, up, forward;

  Frame(const Vec3& eye, const Vec3& towards) : origin(eye), forward((towards - eye).normalized()) {
    right = forward.cross(Vec3::UnitY()).normalized();
    up = right.cross(forward);
  }
  Vec3 of(const Vec3& point) const {
    const Vec3 away = point - origin;
    return {right.dot(away), up.dot(away), forward.dot(away)};
  }
};

// Visible triangle of a sample, and the weights of its corners.
struct Seen {
  float depth = kFar;
  std::uint32_t surface = 0, triangle = 0;
  Vec3 weights = Vec3::Zero();
};

class Raster {
 public:
  Raster(int width, int height)
      : width_(width),
        height_(height),
        seen_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  const Seen& at(int x, int y) const { return seen_[index(x, y)]; }

  template <typename Project>
  void draw(std::span<const Surface> surfaces, const Project& project) {
    std::vector<Projected> projected;
    for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
      projected.clear();
      for (const Vec3& position : surfaces[s].positions) projected.push_back(project(position));
      for (std::uint32_t t = 0; t < surfaces[s].triangles.size(); ++t) {
        const auto& [a, b, c] = surfaces[s].triangles[t];
        drawTriangle(projected[a], projected[b], projected[c], s, t);
      }
    }
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  void drawTriangle(const Projected& a, const Projected& b, const Projected& c, std::uint32_t surface,
                    std::uint32_t triangle) {
    // Behind the eye, or part of a cloth that blew up.
    for (const Projected& corner : {a, b, c})
      if (!(corner.depth > 0 && std::abs(corner.x) < 1e6f && std::abs(corner.y) < 1e6f)) return;
    const auto twice = [](const Projected& p, const Projected& q, float x, float y) {
      return (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    };
    const float area = twice(a, b, c.x, c.y);
    if (area == 0) return;
    const auto first = [](float edge) { return std::max(0, static_cast<int>(std::floor(edge))); };
    const int endX = std::min(width_, static_cast<int>(std::ceil(std::max({a.x, b.x, c.x}))) + 1);
    const int endY = std::min(height_, static_cast<int>(std::ceil(std::max({a.y, b.y, c.y}))) + 1);
    for (int y = first(std::min({a.y, b.y, c.y})); y < endY; ++y)
      for (int x = first(std::min({a.x, b.x, c.x})); x < endX; ++x) {
        const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;
        Vec3 weights(twice(b, c, px, py) / area, twice(c, a, px, py) / area, twice(a, b, px, py) / area);
        if (weights.minCoeff() < 0) continue;
        weights = weights.cwiseProduct(Vec3(a.nearness, b.nearness, c.nearness));
        weights /= weights.sum();
        const float depth = weights.dot(Vec3(a.depth, b.depth, c.depth));
        Seen& sample = seen_[index(x, y)];
        if (depth < sample.depth) sample = {depth, surface, triangle, weights};
      }
  }

  int width_, height_;
  std::vector<Seen> seen_;
};

std::vector<Vec3> normalsOf(const Surface& surface) {
  std::vector<Vec3> normals(surface.positions.size(), Vec3::Zero());
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3 area =
        (surface.positions[b] - surface.positions[a]).cross(surface.positions[c] - surface.positions[a]);
    for (const std::uint32_t node : {a, b, c}) normals[node] += area;
  }
  for (Vec3& normal : normals) normal.stableNormalize();
  return normals;
}

// Depth map of the lamp, without perspective.
class Shadows {
 public:
  Shadows(std::span<const Surface> surfaces, const Vec3& target)
      : frame_(target + 4 * kShadowReach * kLamp, target), raster_(kShadowSize, kShadowSize) {
    raster_.draw(surfaces, [&](const Vec3& point) { return project(point); });
  }

  // Part of the nine samples around the point that are lit, 0 to 1.
  float light(const Vec3& point) const {
    const Projected at = project(point);
    int lit = 0;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const int x = static_cast<int>(at.x) + 2 * dx, y = static_cast<int>(at.y) + 2 * dy;
        if (x < 0 || y < 0 || x >= kShadowSize || y >= kShadowSize ||
            raster_.at(x, y).depth > at.depth - kShadowBias)
          ++lit;
      }
    return static_cast<float>(lit) / 9;
  }

 private:
  Projected project(const Vec3& point) const {
    const Vec3 seen = frame_.of(point);
    constexpr float kScale = kShadowSize / (2 * kShadowReach);
    return {kShadowSize / 2.0f + kScale * seen.x(), kShadowSize / 2.0f - kScale * seen.y(), seen.z(), 1};
  }

  Frame frame_;
  Raster raster_;
};

// Darkens near a whole number of either coordinate.
float lined(const Eigen::Vector2f& at) {
  const Eigen::Array2f away = (at.array() - at.array().round()).abs();
  return away.minCoeff() < 0.06f ? 0.72f : 1.0f;
}

Vec3 surfaceColour(const Surface& surface, std::span<const Vec3> normals, const Seen& seen, const Vec3& eye,
                   const Shadows& shadows) {
  const auto& triangle = surface.triangles[seen.triangle];
  Vec3 normal = Vec3::Zero(), point = Vec3::Zero();
  Eigen::Vector2f lines = Eigen::Vector2f::Constant(0.5f);
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t node = triangle[static_cast<std::size_t>(i)];
    normal += seen.weights[i] * normals[node];
    point += seen.weights[i] * surface.positions[node];
    if (!surface.lines.empty())
      lines = i == 0 ? Eigen::Vector2f(seen.weights[0] * surface.lines[node])
                     : Eigen::Vector2f(lines + seen.weights[i] * surface.lines[node]);
  }
  normal.stableNormalize();
  const Vec3 toEye = (eye - point).normalized();
  const bool front = normal.dot(toEye) > 0;
  if (!front) normal = -normal;
  const float facing = std::max(0.0f, normal.dot(kLamp));
  const float light = facing > 0 ? shadows.light(point + 0.02f * normal) : 0;
  const float shine = std::pow(std::max(0.0f, normal.dot((kLamp + toEye).normalized())), 24.0f);
  const float sky = 0.32f + 0.14f * normal.y();
  const Vec3 colour = (front ? surface.front : surface.back) * lined(lines);
  return colour * (sky + 0.72f * facing * light) + Vec3::Constant(0.10f * shine * light);
}

// The floor fades into the sky.
Vec3 floorColour(const Vec3& eye, const Vec3& ray, const Vec3& target, const Shadows& shadows) {
  if (ray.y() >= -1e-3f) return kSky;
  const Vec3 point = eye - eye.y() / ray.y() * ray;
  const float away = (point - Vec3(target.x(), 0, target.z())).norm() / kShadowReach;
  const float fade = std::min(1.0f, away * away);
  const Vec3 colour = kFloor * (0.62f + 0.38f * shadows.light(point));
  return (1 - fade) * colour + fade * kSky;
}

// From 0 to 1 to a gamma-corrected byte in 64 steps: smooth to the eye, and small in a file.
std::uint8_t toByte(float light) {
  const float bright = std::pow(std::clamp(light, 0.0f, 1.0f), 1 / 2.2f);
  return static_cast<std::uint8_t>(std::lround(bright * 63) * 255 / 63);
}

}  // namespace

Surface sphereSurface(const Vec3& centre, float radius, const Vec3& colour) {
  constexpr std::uint32_t kSlices = 96, kStacks = 48;
  Surface sphere{{}, {}, colour, colour, {}};
  for (std::uint32_t stack = 0; stack <= kStacks; ++stack)
    for (std::uint32_t slice = 0; slice <= kSlices; ++slice) {
      const float down = std::numbers::pi_v<float> * static_cast<float>(stack) / kStacks;
      const float round = 2 * std::numbers::pi_v<float> * static_cast<float>(slice) / kSlices;
      sphere.positions.push_back(centre + radius * Vec3(std::sin(down) * std::cos(round), std::cos(down),
                                                        -std::sin(down) * std::sin(round)));
    }
  for (std::uint32_t stack = 0; stack < kStacks; ++stack)
    for (std::uint32_t slice = 0; slice < kSlices; ++slice) {
      const std::uint32_t a = stack * (kSlices + 1) + slice, b = a + kSlices + 1;
      sphere.triangles.push_back({a, b, a + 1});
      sphere.triangles.push_back({a + 1, b, b + 1});
    }
  return sphere;
}

Picture render(const View& view, std::span<const Surface> surfaces) {
  const int width = static_cast<int>(view.width * kSamples), height = static_cast<int>(view.rows * kSamples);
  const Frame camera(view.eye, view.target);
  const float scale = static_cast<float>(height) / view.height * (view.target - view.eye).norm();
  const float middleX = static_cast<float>(width) / 2, middleY = static_cast<float>(height) / 2;
  Raster raster(width, height);
  raster.draw(surfaces, [&](const Vec3& point) -> Projected {
    const Vec3 seen = camera.of(point);
    return {middleX + scale * seen.x() / seen.z(), middleY - scale * seen.y() / seen.z(), seen.z(),
            1 / seen.z()};
  });
  const Shadows shadows(surfaces, view.target);
  std::vector<std::vector<Vec3>> normals;
  for (const Surface& surface : surfaces) normals.push_back(normalsOf(surface));

  Picture picture{view.width, view.rows, {}};
  for (std::uint32_t y = 0; y < view.rows; ++y)
    for (std::uint32_t x = 0; x < view.width; ++x) {
      Vec3 sum = Vec3::Zero();
      for (std::uint32_t sample = 0; sample < kSamples * kSamples; ++sample) {
        const int sx = static_cast<int>(x * kSamples + sample % kSamples);
        const int sy = static_cast<int>(y * kSamples + sample / kSamples);
        const Seen& seen = raster.at(sx, sy);
        if (seen.depth < kFar) {
          sum += surfaceColour(surfaces[seen.surface], normals[seen.surface], seen, view.eye, shadows);
        } else {
          const Vec3 ray = camera.forward + (static_cast<float>(sx) + 0.5f - middleX) / scale * camera.right -
                           (static_cast<float>(sy) + 0.5f - middleY) / scale * camera.up;
          sum += floorColour(view.eye, ray, view.target, shadows);
        }
      }
      for (int channel = 0; channel < 3; ++channel)
        picture.pixels.push_back(toByte(sum[channel] / (kSamples * kSamples)));
    }
  return picture;
}

}  // namespace clothstream::bench

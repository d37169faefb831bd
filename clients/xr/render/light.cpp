// SPDX-License-Identifier: MIT
#include "clients/xr/render/light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace clothstream::xr {
namespace {

constexpr float kPi = 3.14159265F;
constexpr float kExposure = 1.35F;
// Width and depth range of the shadow map, in radii of the lit sphere. The light is 4 radii from its centre.
constexpr float kWidth = 3.2F, kDistance = 4, kNear = 1, kFar = 9;
constexpr int kProbeColumns = 48, kProbeRows = 24;

struct Sky {
  Colour above = fromSrgb(0x8e9196), level = fromSrgb(0x787570), below = fromSrgb(0x66553f);
  Colour key = 3 * fromSrgb(0xfff3e2), rim = 2 * fromSrgb(0xcfe2fa);
};

Eigen::Vector3f rimDirection() {
  return Eigen::Vector3f(-0.8F, 0.5F, -0.7F).normalized();
}

float smoothstep(float x, float low, float high) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

// A window: full inside a cone of the half-angle, with a soft edge.
float window(const Eigen::Vector3f& direction, const Eigen::Vector3f& middle, float halfAngle) {
  const float angle = std::acos(std::clamp(direction.dot(middle), -1.0F, 1.0F));
  return 1 - smoothstep(angle, 0.75F * halfAngle, 1.25F * halfAngle);
}

Colour radiance(const Sky& sky, const Eigen::Vector3f& direction) {
  const float up = direction.y();
  const float part = std::min(1.0F, std::abs(up) * (up > 0 ? 1.3F : 3.0F));
  const Colour end = up > 0 ? sky.above : sky.below;
  return sky.level + part * (end - sky.level) + window(direction, keyDirection(), 0.42F) * sky.key +
         window(direction, rimDirection(), 0.5F) * sky.rim;
}

// Basis of spherical harmonics, as in three.js.
std::array<float, 9> basis(const Eigen::Vector3f& d) {
  return {0.282095F,
          0.488603F * d.y(),
          0.488603F * d.z(),
          0.488603F * d.x(),
          1.092548F * d.x() * d.y(),
          1.092548F * d.y() * d.z(),
          0.315392F * (3 * d.z() * d.z() - 1),
          1.092548F * d.x() * d.z(),
          0.546274F * (d.x() * d.x() - d.y() * d.y())};
}

shaders::vec4 widened(const Eigen::Vector3f& v, float w = 0) {
  return {v.x(), v.y(), v.z(), w};
}

}  // namespace

Eigen::Vector3f keyDirection() {
  return Eigen::Vector3f(0.8F, 1.0F, 0.65F).normalized();
}

void setLight(shaders::Frame& frame) {
  const Sky sky;
  frame.keyDirection = widened(keyDirection());
  frame.keyLight = widened(4.6F * fromSrgb(0xfff3e2));
  frame.rimDirection = widened(rimDirection());
  frame.rimLight = widened(0.7F * fromSrgb(0xcfe0f5));
  frame.skyAbove = widened(sky.above);
  frame.skyLevel = widened(sky.level);
  frame.skyBelow = widened(sky.below);
  frame.skyKey = widened(sky.key);
  frame.skyRim = widened(sky.rim);
  frame.exposure = kExposure;
  for (shaders::vec4& coefficient : frame.irradiance) coefficient.setZero();
  for (int row = 0; row < kProbeRows; ++row) {
    const float latitude = ((static_cast<float>(row) + 0.5F) / kProbeRows - 0.5F) * kPi;
    const float solidAngle = std::cos(latitude) * (kPi / kProbeRows) * (2 * kPi / kProbeColumns);
    for (int column = 0; column < kProbeColumns; ++column) {
      const float longitude = ((static_cast<float>(column) + 0.5F) / kProbeColumns - 0.5F) * 2 * kPi;
      const Eigen::Vector3f direction(std::cos(latitude) * std::cos(longitude), std::sin(latitude),
                                      std::cos(latitude) * std::sin(longitude));
      const Colour light = solidAngle * radiance(sky, direction);
      const std::array<float, 9> weights = basis(direction);
      for (std::size_t i = 0; i < 9; ++i) frame.irradiance[i] += widened(weights[i] * light);
    }
  }
}

Eigen::Matrix4f shadowMatrix(const Eigen::Vector3f& centre, float radius) {
  const Eigen::Vector3f back = keyDirection();
  const Eigen::Vector3f right = Eigen::Vector3f::UnitY().cross(back).normalized();
  const Eigen::Vector3f up = back.cross(right);
  const float width = kWidth * radius, range = (kFar - kNear) * radius;
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix.block<1, 3>(0, 0) = right.transpose() / width;
  matrix.block<1, 3>(1, 0) = -up.transpose() / width;
  matrix.block<1, 3>(2, 0) = -back.transpose() / range;
  const Eigen::Vector3f moved = matrix.block<3, 3>(0, 0) * centre;
  matrix.block<3, 1>(0, 3) = Eigen::Vector3f(0.5F, 0.5F, (kDistance - kNear) / (kFar - kNear)) - moved;
  return matrix;
}

void fitToStage(const Stage& stage, shaders::Frame& frame) {
  frame.shadow = shadowMatrix(stage.centre, stage.radius);
  frame.keyLight.w() = 3 * kWidth * stage.radius / static_cast<float>(kShadowTexels);
  // A scene near the origin has the origin in the middle of the floor.
  const bool isNear = std::hypot(stage.centre.x(), stage.centre.z()) < 2;
  const float reach = std::max(14.0F, 9 * stage.radius);
  frame.floorMiddle = {isNear ? 0 : stage.centre.x(), stage.floor, isNear ? 0 : stage.centre.z(), reach};
  frame.floorColour = widened(fromSrgb(0xa09789), 0.5F);
  frame.outside = widened(fromSrgb(0xcbc6bd));
  frame.zenith = widened(fromSrgb(0xeef0f0));
  frame.background = static_cast<std::uint32_t>(stage.background);
}

}  // namespace clothstream::xr

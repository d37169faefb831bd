// SPDX-License-Identifier: MIT
// Draws stages into memory for tests.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/xr/render/frame_commands.h"
#include "clients/xr/render/offscreen.h"
#include "clients/xr/render/own_device.h"
#include "clients/xr/render/renderer.h"

namespace clothstream::xr::tests {

// A Vulkan device for a test, if there is one.
class Device {
 public:
  Device() {
    try {
      openVulkanLoader();
      device_ = std::make_unique<OwnDevice>(std::span<const char* const>(), std::span<const char* const>());
    } catch (const std::runtime_error& error) {
      why_ = error.what();
    }
  }
  // Null without a device; why() says why then.
  const OwnDevice* get() const { return device_.get(); }
  const std::string& why() const { return why_; }
  const GraphicsDevice& graphics() const { return device_->get(); }

 private:
  std::unique_ptr<OwnDevice> device_;
  std::string why_;
};

// Camera at `eye` that looks at `at`, with the same tangent to all four sides.
inline View look(const Eigen::Vector3f& eye, const Eigen::Vector3f& at, float tangent = 0.5f) {
  const Eigen::Vector3f back = (eye - at).normalized();
  const Eigen::Vector3f right = Eigen::Vector3f::UnitY().cross(back).normalized();
  View view;
  view.view.setIdentity();
  view.view.block<1, 3>(0, 0) = right.transpose();
  view.view.block<1, 3>(1, 0) = back.cross(right).transpose();
  view.view.block<1, 3>(2, 0) = back.transpose();
  view.view.block<3, 1>(0, 3) = -view.view.block<3, 3>(0, 0) * eye;
  view.projection = projectionOf(-tangent, tangent, tangent, -tangent, 0.05f, 50);
  return view;
}

// A renderer with a square target.
class Drawn {
 public:
  Drawn(const GraphicsDevice& device, std::uint32_t size, std::uint32_t views, std::uint32_t samples = 1)
      : target_(device, {size, size}, views, true),
        renderer_(device,
                  {.samples = samplesOf(device.physical, samples), .views = views, .largest = {size, size}}),
        commands_(device) {}

  // Draws the stage and waits for the picture.
  void draw(const Stage& stage, std::span<const View> views) {
    record(stage, views, true);
    commands_.finish();
  }
  // Draws without waiting; with `reads`, pixels can be read when the frame is complete.
  void record(const Stage& stage, std::span<const View> views, bool reads = false) {
    if (stage.topology != uploaded_) renderer_.upload(stage);
    uploaded_ = stage.topology;
    const VkCommandBuffer commands = commands_.begin();
    renderer_.record(commands, target_.target(), views, stage);
    if (reads) target_.recordRead(commands);
    commands_.submit();
  }

  struct Pixel {
    int red, green, blue, alpha;
    int brightness() const { return red + green + blue; }
    bool operator==(const Pixel&) const = default;
  };
  Pixel at(std::uint32_t x, std::uint32_t y, std::uint32_t view = 0) const {
    const std::uint8_t* p = &target_.pixels(view)[4 * (std::size_t{y} * target_.size().width + x)];
    return {p[0], p[1], p[2], p[3]};
  }
  float depthAt(std::uint32_t x, std::uint32_t y, std::uint32_t view = 0) const {
    return target_.depths(view)[std::size_t{y} * target_.size().width + x];
  }
  std::vector<std::uint8_t> pixels(std::uint32_t view = 0) const {
    const auto all = target_.pixels(view);
    return {all.begin(), all.end()};
  }
  std::uint32_t size() const { return target_.size().width; }
  const Offscreen& target() const { return target_; }

  // Pixel in which a point is drawn, and its depth; none outside of the picture.
  struct Place {
    std::uint32_t x, y;
    float depth;
  };
  std::optional<Place> placeOf(const Eigen::Vector3f& point, const View& view) const {
    const Eigen::Vector4f clip = view.projection * view.view * point.homogeneous();
    const Eigen::Vector3f ndc = clip.head<3>() / clip.w();
    if (clip.w() <= 0 || std::abs(ndc.x()) >= 1 || std::abs(ndc.y()) >= 1) return std::nullopt;
    const auto pixel = [&](float at) {
      return static_cast<std::uint32_t>((0.5f + 0.5f * at) * static_cast<float>(size()));
    };
    return Place{pixel(ndc.x()), pixel(ndc.y()), ndc.z()};
  }

 private:
  Offscreen target_;
  Renderer renderer_;
  FrameCommands commands_;
  std::uint64_t uploaded_ = 0;
};

}  // namespace clothstream::xr::tests

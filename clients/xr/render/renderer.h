// SPDX-License-Identifier: MIT
// Draws a stage into an image: shadow map, then one pass for all views (multiview).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>

#include "clients/xr/render/device.h"
#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

// Number of frames whose commands may be executing while the next one is recorded, plus 1. record() writes to
// memory that the frame kFramesInFlight calls earlier has read, so that frame must be complete: wait for its
// fence first.
inline constexpr std::uint32_t kFramesInFlight = 3;

// Cost of shadows: filters of few samples for weak devices, or shadows that are softer with distance.
enum class ShadowDetail : std::uint32_t { kReduced = 0, kFull = 1 };

struct RendererOptions {
  // An sRGB format, such as VK_FORMAT_R8G8B8A8_SRGB, or a UNORM format, which gets colours in sRGB encoding
  // too.
  VkFormat colour = VK_FORMAT_R8G8B8A8_SRGB;
  VkFormat depth = VK_FORMAT_D32_SFLOAT;
  VkSampleCountFlagBits samples = VK_SAMPLE_COUNT_4_BIT;  // must be allowed for both formats
  std::uint32_t views = 1;                                // 1, or 2 for both eyes
  VkExtent2D largest{};                                   // largest Target::size
  ShadowDetail shadows = ShadowDetail::kFull;
  // Whether each target has a density map. The device then has what hasDensityMaps() asks for.
  bool hasDensity = false;
};

// Image to draw to. The image views have the type VK_IMAGE_VIEW_TYPE_2D_ARRAY, RendererOptions::views layers,
// one level and the formats of the options. Framebuffers are kept for each pair of image views, for
// swapchains.
struct Target {
  VkImageView colour = VK_NULL_HANDLE;
  // Gets the depth of the nearest sample: 0 at the near plane, 1 at the far plane. May be null.
  VkImageView depth = VK_NULL_HANDLE;
  VkExtent2D size{};  // drawn part, from the upper left corner
  // Fragments per texel of the picture (VK_EXT_fragment_density_map), with RendererOptions::hasDensity; else
  // null. The format is VK_FORMAT_R8G8_UNORM. The map is read in
  // VK_IMAGE_LAYOUT_FRAGMENT_DENSITY_MAP_OPTIMAL_EXT, and keeps this layout.
  VkImageView density = VK_NULL_HANDLE;
};

// One eye. Both matrices are OpenGL-like in their signs: the eye looks along -Z, with +Y up.
struct View {
  Eigen::Matrix4f view = Eigen::Matrix4f::Identity();  // from the frame of the scene to the frame of the eye
  // To clip coordinates of Vulkan: +Y down, depth 0 to 1. See projectionOf().
  Eigen::Matrix4f projection = Eigen::Matrix4f::Identity();
};

// Projection for the tangents of the four half-angles of a view; left and down are negative. The distances of
// the near and far planes are m.
Eigen::Matrix4f projectionOf(float left, float right, float up, float down, float near, float far);

class Renderer {
 public:
  // `device` must outlive the renderer. Throws std::runtime_error that names what failed.
  Renderer(const GraphicsDevice& device, const RendererOptions& options);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Copies what does not change from frame to frame. Call before record() if Stage::topology has changed.
  // Waits until the device is idle. Throws std::runtime_error without memory.
  void upload(const Stage& stage);

  // Records all commands of a frame. `commands` is in the recording state and outside of a render pass, and
  // is submitted to the queue of the device. The image views of the target are in
  // VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL and VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL afterwards;
  // their contents before are discarded. `views` has RendererOptions::views elements. Requires upload() for
  // Stage::topology. After the first frames with a stage, nothing is allocated; new framebuffers, longer
  // lists of solids and new labels are exceptions.
  void record(VkCommandBuffer commands, const Target& target, std::span<const View> views,
              const Stage& stage);

  // Forgets the framebuffers of all targets. Call before the image views of a swapchain are destroyed, when
  // the device is idle.
  void forgetTargets();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace clothstream::xr

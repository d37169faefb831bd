// SPDX-License-Identifier: MIT
// Render passes of the shadow map and of the picture, their attachments and framebuffers.
#pragma once

#include <array>
#include <vector>

#include "clients/xr/render/images.h"
#include "clients/xr/render/renderer.h"

namespace clothstream::xr {

class Passes {
 public:
  Passes(const GraphicsDevice& device, const RendererOptions& options);

  VkRenderPass shadow() const { return shadow_.get(); }
  VkFramebuffer shadowFramebuffer() const { return shadowFramebuffer_.get(); }
  const Image& shadowMap() const { return shadowMap_; }

  // Pass for pictures. With more than one sample, it resolves into the target.
  VkRenderPass picture(bool givesDepth) const { return pictures_[givesDepth ? 1 : 0].get(); }
  // Framebuffer of a target, which is kept. Makes it on first use.
  VkFramebuffer framebuffer(const Target& target);
  void forgetTargets() { framebuffers_.clear(); }

 private:
  struct Known {
    VkImageView colour, depth, density;
    VkExtent2D size;
    Owned<VkFramebuffer> framebuffer;
  };

  void makeShadowPass();
  void makePicturePass(bool givesDepth);

  GraphicsDevice device_;
  RendererOptions options_;
  Owned<VkRenderPass> shadow_;
  std::array<Owned<VkRenderPass>, 2> pictures_;  // without and with depth of the target
  Image shadowMap_;
  Owned<VkFramebuffer> shadowFramebuffer_;
  Image colour_, depth_;  // with several samples; depth_ also with one, for targets without depth
  std::vector<Known> framebuffers_;
};

}  // namespace clothstream::xr

// SPDX-License-Identifier: MIT
// Images that fragments read: weaves of fabrics, the panel, and names. And their samplers.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "clients/xr/render/images.h"
#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

class Textures {
 public:
  // Computes the weaves, and fills everything else with transparent texels. Waits for the device.
  explicit Textures(const GraphicsDevice& device);

  const Image& weaveColours() const { return weaveColours_; }
  const Image& weaveReliefs() const { return weaveReliefs_; }
  const Image& panel() const { return panel_; }
  const Image& labels() const { return labels_; }
  VkSampler tiled() const { return tiled_.get(); }        // repeats
  VkSampler clamped() const { return clamped_.get(); }    // with levels
  VkSampler texels() const { return texels_.get(); }      // without a filter
  VkSampler compared() const { return compared_.get(); }  // depth, 1 where the reference is not behind it

  // Bytes of the staging buffer that record() needs.
  static VkDeviceSize stagingBytes();
  // Records copies of pictures of the stage that have changed; of the panel, only what has changed. `staging`
  // is mapped, and not read by the device now. At most a few new labels are copied in one frame; the others
  // follow in the next frames. If there are more labels than layers, the last ones are not drawn.
  void record(VkCommandBuffer commands, const Stage& stage, const Buffer& staging);
  // Layer of a label; -1 if its picture has not been copied.
  int layerOf(const Label& label) const;

 private:
  struct Layer {
    std::uint64_t id = 0, revision = 0;  // revision 0: unused
    std::uint64_t usedIn = 0;            // number of a call of record()
  };
  static constexpr std::size_t kLabelLayers = 32;

  // Null if all layers are used by other labels of this frame.
  Layer* layerFor(const Label& label);
  void recordPanel(VkCommandBuffer commands, const Picture& picture, const Buffer& staging);
  void makeSamplers(const GraphicsDevice& device);
  void makeWeaves(const GraphicsDevice& device);

  Image weaveColours_, weaveReliefs_, panel_, labels_;
  Owned<VkSampler> tiled_, clamped_, texels_, compared_;
  std::array<Layer, kLabelLayers> layers_{};
  std::uint64_t calls_ = 0;
  std::uint64_t panelRevision_ = 0;
  std::vector<VkBufferImageCopy> panelCopies_;
};

}  // namespace clothstream::xr

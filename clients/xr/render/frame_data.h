// SPDX-License-Identifier: MIT
// What the device reads of a stage: copies that stay until the topology changes, and slots of mapped memory
// for frames in flight.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/xr/render/pipelines.h"
#include "clients/xr/render/textures.h"
#include "clients/xr/shaders/records.h"

namespace clothstream::xr {

// Classes of solids in the order in which they are drawn, and shapes within a class.
enum class SolidClass : std::size_t { kHides, kOpaque, kFaint };
enum class SolidMesh : std::size_t { kFine, kCoarse, kBox, kPlane };
inline constexpr std::size_t kSolidClasses = 3, kSolidMeshes = 4;

// Solids that are drawn at once.
struct SolidRange {
  std::uint32_t first = 0, count = 0;
};
using SolidRanges = std::array<std::array<SolidRange, kSolidMeshes>, kSolidClasses>;

struct IndexRange {
  std::uint32_t first = 0, count = 0;
};

class FrameData {
 public:
  FrameData(const GraphicsDevice& device, const Pipelines& pipelines, const Passes& passes,
            const Textures& textures);

  // Copies the lists of the topology. The device must be idle. Throws std::runtime_error if they are larger
  // than the device allows, or without memory.
  void upload(const Stage& stage);

  // Starts the next frame: writes everything of the stage into the memory of its slot. Returns the set with
  // all of it.
  VkDescriptorSet write(const Stage& stage, std::span<const View> views, const shaders::Frame& frame);
  // Staging buffer of the slot.
  const Buffer& staging() const { return slots_[slot_].staging; }
  // Writes the names and the panel. Call it after Textures::record(). Returns their number, the farthest
  // first.
  std::uint32_t writeQuads(const Stage& stage, std::span<const View> views, const Textures& textures);

  std::uint64_t topology() const { return topology_; }
  const SolidRanges& solidRanges() const { return ranges_; }
  VkBuffer meshIndices() const { return indices_.get(); }
  VkBuffer solidIndices() const { return solidIndices_.get(); }
  IndexRange solidIndexRange(SolidMesh mesh) const {
    return solidIndexRanges_[static_cast<std::size_t>(mesh)];
  }

 private:
  struct Slot {
    Buffer frame, positions, normals, parts, solids, quads, staging;
    VkDescriptorSet set = VK_NULL_HANDLE;
  };

  void makeSolidIndices();
  void bind(Slot& slot, std::uint32_t binding, const VkDescriptorBufferInfo* buffer,
            const VkDescriptorImageInfo* image) const;
  void bindBuffer(Slot& slot, std::uint32_t binding, VkBuffer buffer) const;
  void bindImage(Slot& slot, std::uint32_t binding, VkImageView view, VkSampler sampler,
                 VkImageLayout layout) const;
  // Replaces a mapped buffer of the slot by a larger one if it has fewer bytes.
  void grow(Slot& slot, Buffer& buffer, std::uint32_t binding, VkDeviceSize bytes) const;
  void writeParts(const Stage& stage, Slot& slot) const;
  void writeSolids(const Stage& stage, Slot& slot);

  GraphicsDevice device_;
  VkDeviceSize mostBytes_ = 0;  // of a storage buffer
  Owned<VkDescriptorPool> pool_;
  Buffer vertices_, indices_, fanStarts_, fans_;
  Buffer solidIndices_;
  std::array<IndexRange, kSolidMeshes> solidIndexRanges_{};
  std::array<Slot, kFramesInFlight> slots_;
  std::size_t slot_ = 0;
  std::uint64_t topology_ = 0;
  SolidRanges ranges_{};
  std::vector<shaders::QuadRecord> quads_;
};

}  // namespace clothstream::xr

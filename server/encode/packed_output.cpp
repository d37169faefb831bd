// SPDX-License-Identifier: MIT
// Codec 3: the device packs residuals, and the CPU copies the bytes.
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "kernels/pack_normals.h"
#include "kernels/pack_residuals.h"
#include "proto/codec/hierarchical/packed_blocks.h"
#include "proto/codec/hierarchical/packet_assembly.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/hierarchical/weight_plan.h"
#include "server/encode/device_output.h"

namespace clothstream::encode {
namespace {

using vulkan::BindingKind;
using vulkan::Buffer;
using vulkan::BufferPurpose;

static_assert(shared::kPackedBlock == codec::hierarchical::kBlockVertices &&
              shared::kPackedGroup == codec::hierarchical::kGroupVertices &&
              shared::kPackedModes == codec::hierarchical::kModes);
// The extra words have room for a block of one vertex, the last block.
static_assert(32 * shared::kPackedWords * shared::kPackedBlock >=
              codec::hierarchical::kComponents *
                  (codec::hierarchical::kMostModeBits +
                   shared::kPackedBlock * codec::hierarchical::kMostNumberBits));
static_assert(32 * shared::kPackedNormalWords * shared::kPackedBlock >=
              2 * (codec::hierarchical::kMostModeBits +
                   shared::kPackedBlock * codec::hierarchical::kMostNumberBits));
static_assert(32 * shared::kPackedExtraWords >=
              codec::hierarchical::kComponents * codec::hierarchical::kMostModeBits + 1);

std::uint32_t groupsOf(std::uint32_t vertices) {
  return (vertices + shared::kPackedGroup - 1) / shared::kPackedGroup;
}

// The groups of all vertices' residuals, or of their normals' residuals.
class GroupKernel {
 public:
  // `sources` are the buffers of each slot that the kernel packs.
  GroupKernel(const vulkan::Device& device, const char* name, std::span<const std::uint32_t> spirv,
              std::uint32_t vertices, std::uint32_t groups, std::uint32_t vertexWords,
              const std::array<std::vector<const Buffer*>, kFrameSlots>& sources)
      : groups_(groups),
        vertexWords_(vertexWords),
        kernel_(device, {.name = name,
                         .spirv = spirv,
                         .bindings = std::vector(3 + sources[0].size(), BindingKind::storage),
                         .pushConstantBytes = sizeof(shared::PackPush),
                         .workgroupSize = codec::hierarchical::kGroupBlocks}),
        scratch_(device, BufferPurpose::state, bytes(vertices)) {
    for (std::uint32_t slot = 0; slot < kFrameSlots; ++slot) {
      words_[slot] = Buffer(device, BufferPurpose::readback, bytes(vertices));
      sizes_[slot] = Buffer(device, BufferPurpose::readback, groups * sizeof(std::uint32_t));
      std::vector<const Buffer*> buffers{&scratch_, &words_[slot], &sizes_[slot]};
      buffers.insert(buffers.end(), sources[slot].begin(), sources[slot].end());
      bindings_.emplace_back(device, kernel_, buffers);
    }
  }

  void record(vulkan::Recorder& recorder, const shared::PackPush& push, std::uint32_t slot) const {
    recorder.dispatch(bindings_[slot], push, std::uint64_t{kernel_.workgroupSize()} * groups_);
  }

  // Copies the groups from `begin` on. The vertices of the first group start at `first`.
  std::byte* copy(std::uint32_t slot, std::uint32_t begin, std::uint32_t end, std::uint32_t first,
                  std::byte* out) const {
    for (std::uint32_t group = begin; group < end; ++group, first += shared::kPackedGroup)
      out = std::ranges::copy(bytesOf(slot, group, first), out).out;
    return out;
  }

 private:
  std::size_t bytes(std::uint32_t vertices) const {
    return sizeof(std::uint32_t) *
           (std::size_t{vertexWords_} * vertices + std::size_t{shared::kPackedExtraWords} * groups_);
  }
  std::span<const std::byte> bytesOf(std::uint32_t slot, std::uint32_t group, std::uint32_t first) const {
    const std::size_t word =
        std::size_t{vertexWords_} * first + std::size_t{shared::kPackedExtraWords} * group;
    return words_[slot].mapped().subspan(sizeof(std::uint32_t) * word,
                                         sizes_[slot].mapped<std::uint32_t>()[group]);
  }

  std::uint32_t groups_, vertexWords_;
  vulkan::Kernel kernel_;
  Buffer scratch_;
  std::array<Buffer, kFrameSlots> words_, sizes_;
  std::vector<vulkan::Bindings> bindings_;  // by slot
};

class PackedOutput final : public DeviceOutput {
 public:
  PackedOutput(const vulkan::Device& device, const DevicePredictor& predictor,
               const codec::StreamLayout& layout)
      : packet_(layout),
        push_{.vertexCount = layout.vertexCount(), .coarseVertices = predictor.hierarchy().coarseVertices},
        coarseGroups_(groupsOf(push_.coarseVertices)),
        groups_(coarseGroups_ + groupsOf(push_.vertexCount - push_.coarseVertices)) {
    std::array<std::vector<const Buffer*>, kFrameSlots> residuals, ofNormals;
    for (std::uint32_t slot = 0; slot < kFrameSlots; ++slot) {
      const DevicePredictor::Residuals of = predictor.residuals(slot);
      residuals[slot] = {of.residuals, of.wideResiduals};
      ofNormals[slot] = {of.normalResiduals};
    }
    residuals_.emplace(device, "pack_residuals", kernels::pack_residuals, push_.vertexCount, groups_,
                       shared::kPackedWords, residuals);
    if (layout.normals == codec::NormalMode::octahedral)
      normals_.emplace(device, "pack_normals", kernels::pack_normals, push_.vertexCount,
                       groupsOf(push_.vertexCount), shared::kPackedNormalWords, ofNormals);
  }

  std::size_t packetBound() const override {
    using namespace codec::hierarchical;
    return packet_.headerBound() + WeightPlan::kMaxBytes + groupsBound(kComponents, push_.vertexCount) +
           groupsBound(kComponents, 0) + (normals_ ? groupsBound(2, push_.vertexCount) : 0);
  }

  void record(vulkan::Recorder& recorder, std::uint32_t slot) override {
    recorder.barrier();
    residuals_->record(recorder, push_, slot);
    if (normals_) normals_->record(recorder, push_, slot);
  }

  Written write(std::uint32_t slot, const codec::FrameRole& role, std::span<const std::byte> weights,
                std::span<std::byte> out) override {
    std::byte* const start = std::ranges::copy(weights, packet_.begin(role, out)).out;
    packet_.endSection(start);
    std::byte* end = residuals_->copy(slot, 0, coarseGroups_, 0, start);
    packet_.endSection(end);
    end = residuals_->copy(slot, coarseGroups_, groups_, push_.coarseVertices, end);
    // A group with a number takes at least nine bits; other groups take one bit.
    const bool any = static_cast<std::size_t>(end - start) > groups_;
    if (normals_) end = normals_->copy(slot, 0, groupsOf(push_.vertexCount), 0, end);
    packet_.endSection(end);
    return {packet_.finish(), any};
  }

 private:
  codec::hierarchical::PacketAssembly packet_;
  shared::PackPush push_;
  std::uint32_t coarseGroups_, groups_;
  std::optional<GroupKernel> residuals_, normals_;
};

}  // namespace

std::unique_ptr<DeviceOutput> makePackedOutput(const vulkan::Device& device, const DevicePredictor& predictor,
                                               const codec::StreamLayout& layout) {
  return std::make_unique<PackedOutput>(device, predictor, layout);
}

}  // namespace clothstream::encode

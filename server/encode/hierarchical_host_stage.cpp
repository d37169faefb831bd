// SPDX-License-Identifier: MIT
// Codec 2: positions are read back, all else is done on the CPU.
#include <array>
#include <vector>

#include "proto/codec/encoder.h"
#include "server/encode/encode_stage.h"
#include "shaders/shared/types.h"

namespace clothstream::encode {
namespace {

class HierarchicalHostStage final : public EncodeStage {
 public:
  HierarchicalHostStage(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                        const codec::StreamLayout& layout)
      : simulation_(simulation),
        encoder_(codec::Encoder::make(layout)),
        positions_(3 * simulation.nodeCount()) {
    for (vulkan::Buffer& slot : slots_) {
      slot = vulkan::Buffer(device, vulkan::BufferPurpose::readback, simulation.positions(0).bytes());
    }
  }

  std::size_t packetBound() const override { return encoder_->packetBound(); }

  void record(vulkan::Recorder& recorder, std::uint32_t slot, bool) override {
    const vulkan::Buffer& present = simulation_.positions(simulation_.presentIndex());
    recorder.copy(present, slots_[slot], present.bytes());
  }

  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out) override {
    float* position = positions_.data();
    for (const shared::vec4& node : slots_[frame.slot].mapped<shared::vec4>().first(positions_.size() / 3)) {
      *position++ = node.x;
      *position++ = node.y;
      *position++ = node.z;
    }
    // The frames before it may be of a history that was given up, and of later ticks.
    if (frame.kind == codec::PacketKind::key) encoder_->forgetHistory();
    const std::size_t bytes = encoder_->encode(frame.tick, frame.kind, positions_, {}, out);
    return {.bytes = bytes, .reconstructionHash = encoder_->reconstructionHash()};
  }

 private:
  const simulation::ClothSimulation& simulation_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::vector<float> positions_;
  std::array<vulkan::Buffer, kFrameSlots> slots_;
};

}  // namespace

std::unique_ptr<EncodeStage> makeHierarchicalHostStage(const vulkan::Device& device,
                                                       const simulation::ClothSimulation& simulation,
                                                       const codec::StreamLayout& layout) {
  return std::make_unique<HierarchicalHostStage>(device, simulation, layout);
}

}  // namespace clothstream::encode

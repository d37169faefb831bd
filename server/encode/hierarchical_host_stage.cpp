// SPDX-License-Identifier: MIT
// Prediction on the host: the device only copies positions, and normals if they are sent.
#include <array>
#include <utility>
#include <vector>

#include "proto/codec/encoder.h"
#include "server/encode/encode_stage.h"
#include "shaders/shared/types.h"

namespace clothstream::encode {
namespace {

class HierarchicalHostStage final : public EncodeStage {
 public:
  HierarchicalHostStage(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                        const codec::StreamLayout& layout, std::unique_ptr<codec::Encoder> encoder)
      : simulation_(simulation),
        encoder_(std::move(encoder)),
        positions_(3 * simulation.nodeCount()),
        normals_(layout.normals == codec::NormalMode::octahedral ? positions_.size() : 0) {
    for (Slot& slot : slots_) {
      slot.positions =
          vulkan::Buffer(device, vulkan::BufferPurpose::readback, simulation.positions(0).bytes());
      if (!normals_.empty())
        slot.normals = vulkan::Buffer(device, vulkan::BufferPurpose::readback, simulation.normals().bytes());
    }
  }

  std::size_t packetBound() const override { return encoder_->packetBound(); }

  void record(vulkan::Recorder& recorder, std::uint32_t slot, bool) override {
    const vulkan::Buffer& present = simulation_.positions(simulation_.presentIndex());
    recorder.copy(present, slots_[slot].positions, present.bytes());
    if (!normals_.empty())
      recorder.copy(simulation_.normals(), slots_[slot].normals, simulation_.normals().bytes());
  }

  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out) override {
    const Slot& slot = slots_[frame.slot];
    unpack(slot.positions, positions_);
    if (!normals_.empty()) unpack(slot.normals, normals_);
    // Earlier frames may belong to a history that was dropped, with later ticks.
    if (frame.kind == codec::PacketKind::key) encoder_->forgetHistory();
    const std::size_t bytes = encoder_->encode(frame.tick, frame.kind, positions_, normals_, out);
    return {.bytes = bytes,
            .reconstructionHash = encoder_->reconstructionHash(),
            .kind = encoder_->kind(),
            .referenceTick = encoder_->referenceTick()};
  }

 private:
  struct Slot {
    vulkan::Buffer positions, normals;
  };

  // Copies three of four components.
  static void unpack(const vulkan::Buffer& buffer, std::vector<float>& out) {
    float* component = out.data();
    for (const shared::vec4& vector : buffer.mapped<shared::vec4>().first(out.size() / 3)) {
      *component++ = vector.x;
      *component++ = vector.y;
      *component++ = vector.z;
    }
  }

  const simulation::ClothSimulation& simulation_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::vector<float> positions_, normals_;
  std::array<Slot, kFrameSlots> slots_;
};

}  // namespace

std::unique_ptr<EncodeStage> makeHierarchicalHostStage(const vulkan::Device& device,
                                                       const simulation::ClothSimulation& simulation,
                                                       const codec::StreamLayout& layout,
                                                       std::unique_ptr<codec::Encoder> encoder) {
  return std::make_unique<HierarchicalHostStage>(device, simulation, layout, std::move(encoder));
}

}  // namespace clothstream::encode

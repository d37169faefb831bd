// SPDX-License-Identifier: MIT
// Prediction and choice of residuals on the device: kernels, tables and what is read back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/frame_writer.h"
#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/hierarchical/weight_fitter.h"
#include "server/encode/encode_stage.h"
#include "server/vulkan/kernel.h"
#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {

// Records on the device's thread; what is read back of a frame belongs to whoever entropy-codes it.
class DevicePredictor {
 public:
  // Throws std::runtime_error where it is not supported or memory runs out.
  DevicePredictor(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                  const codec::StreamLayout& layout);

  // One temporal layer, no more than the device's buffers and dispatches hold.
  static bool supports(const vulkan::Device& device, const codec::StreamLayout& layout);

  struct FrameWeights {
    const codec::hierarchical::Weights *used, *left;  // in the frame, if it is not at rest, and after it
  };
  // The frame so many after its key frame. Without weights it uses those that its reference left. `chunks`
  // are summed up.
  void record(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t sinceKey,
              const FrameWeights* weights, std::span<const codec::hierarchical::Phase> chunks);

  // Of a slot whose recording is complete.
  const shared::SlotStatus& status(std::uint32_t slot) const;
  codec::hierarchical::ChunkProducts products(std::uint32_t slot, std::size_t chunk) const;
  // By vertex: what u and v of its normal are off the prediction, a byte each; empty where there are none.
  std::span<const std::uint32_t> normalResiduals(std::uint32_t slot) const;
  // Returns whether one of them stays or has a residual that is not 0.
  bool read(std::uint32_t slot, std::uint32_t begin, std::uint32_t count,
            codec::hierarchical::ChunkResiduals& out) const;

  const codec::hierarchical::Hierarchy& hierarchy() const { return hierarchy_; }

 private:
  // Buffers of one frame: the first five are read back, the others are written by the CPU.
  struct Slot {
    vulkan::Buffer status, residuals, wideResiduals, normalResiduals, products;
    vulkan::Buffer weights, chunks;
  };
  // Phases that one dispatch takes: a large one, or several small ones in one workgroup.
  struct Step {
    std::uint32_t firstPhase, endPhase, vertices;
    bool isSmall;
  };

  void makeSteps();
  void makeNormals(const vulkan::Device& device, const codec::StreamLayout& layout);
  void makeBindings(const vulkan::Device& device);
  void uploadTables(vulkan::Recorder& recorder);

  const simulation::ClothSimulation& simulation_;
  std::uint32_t vertices_;
  bool hasNormals_;
  codec::hierarchical::LatticeUnit unit_;
  codec::hierarchical::Hierarchy hierarchy_;
  std::vector<Step> steps_;

  std::array<vulkan::Buffer, 2> moments_;  // of the reference and of the frame, by turns
  vulkan::Buffer links_, linksUpload_, slotTable_, slotTableUpload_, model_, modelUpload_;
  vulkan::Buffer wanted_, status_, weights_, sentNormals_;
  vulkan::Buffer faces_, facesUpload_, facesOf_, facesOfUpload_;  // where there are normals
  std::array<Slot, kFrameSlots> slots_;
  vulkan::Kernel quantise_, predictPhase_, predictSmallPhases_, sumProducts_, predictNormals_, finish_;
  // By the present positions, then the turn; by the turn, then the slot; by the turn.
  std::vector<vulkan::Bindings> quantiseBindings_, phaseBindings_, smallPhaseBindings_, sumBindings_,
      normalBindings_, finishBindings_;

  shared::PredictPush push_{};
  std::uint32_t turn_ = 0;  // whose moment is the reference's
  bool started_ = false;
};

}  // namespace clothstream::encode

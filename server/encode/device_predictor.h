// SPDX-License-Identifier: MIT
// Prediction and choice of residuals on the device: kernels, tables and readback.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/frame_writer.h"
#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/hierarchical/weight_fitter.h"
#include "server/encode/encode_stage.h"
#include "server/encode/hierarchy_tables.h"
#include "server/encode/normal_predictor.h"
#include "server/vulkan/kernel.h"
#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {

// Records on the device's thread. The readback of a frame belongs to the thread that entropy-codes it.
class DevicePredictor {
 public:
  // Throws std::runtime_error if the layout is not supported or memory runs out.
  DevicePredictor(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                  const codec::StreamLayout& layout);

  // True if the device's buffers and dispatches are large enough.
  static bool supports(const vulkan::Device& device, const codec::StreamLayout& layout);

  // Weights in the frame, if it is not at rest, and weights after it.
  struct FrameWeights {
    const codec::hierarchical::Weights *used, *left;
  };
  // Records the frame that comes `sinceKey` frames after its key frame. Without `weights` it uses those that
  // its reference left. `chunks` are summed up.
  void record(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t sinceKey,
              const FrameWeights* weights, std::span<const codec::hierarchical::Phase> chunks);

  // Status of a slot whose recording is complete.
  const shared::SlotStatus& status(std::uint32_t slot) const;
  codec::hierarchical::ChunkProducts products(std::uint32_t slot, std::size_t chunk) const;
  // By vertex: residuals of u and v of its normal, a byte each. Empty without normals.
  std::span<const std::uint32_t> normalResiduals(std::uint32_t slot) const;
  // Returns true if a vertex stays or has a residual other than 0.
  bool read(std::uint32_t slot, std::uint32_t begin, std::uint32_t count,
            codec::hierarchical::ChunkResiduals& out) const;

  const codec::hierarchical::Hierarchy& hierarchy() const { return hierarchy_; }

 private:
  // Buffers of one frame: the first four are read back, the others are written by the CPU.
  struct Slot {
    vulkan::Buffer status, residuals, wideResiduals, products;
    vulkan::Buffer weights, chunks;
  };
  // Phases of one dispatch: a large phase, or several small phases in one workgroup.
  struct Step {
    std::uint32_t firstPhase, endPhase, vertices;
    bool isSmall;
  };

  void makeSlots(const vulkan::Device& device);
  void makeSteps(std::uint32_t smallPhasesWorkgroup);
  void makeBindings(const vulkan::Device& device);
  void recordTables(vulkan::Recorder& recorder) const;

  const simulation::ClothSimulation& simulation_;
  codec::hierarchical::Hierarchy hierarchy_;
  std::vector<Step> steps_;

  HierarchyTables tables_;
  std::array<vulkan::Buffer, 2> moments_;  // of the reference and of the frame, alternating
  vulkan::Buffer wanted_, sentNormals_, status_, weights_;
  std::array<Slot, kFrameSlots> slots_;
  std::optional<NormalPredictor> normals_;
  // Indexed by the present positions and then referenceIndex_; by referenceIndex_ and then the slot; or by
  // referenceIndex_.
  std::vector<vulkan::Bindings> quantiseBindings_, phaseBindings_, smallPhaseBindings_, sumBindings_,
      finishBindings_;

  shared::PredictPush push_;
  std::uint32_t referenceIndex_ = 0;  // index of the reference's moment
  bool started_ = false;
};

}  // namespace clothstream::encode

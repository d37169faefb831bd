// SPDX-License-Identifier: MIT
// Frames from simulation state: prepared on the device, packets by the CPU.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/encoder.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"
#include "proto/codec/workers.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::encode {

// Which of codec::kCodecs a scene's stream is in.
std::uint8_t codecOf(const model::Scene& scene);

// The layout of a scene's stream.
codec::StreamLayout streamLayout(const model::Scene& scene, std::uint32_t epoch);

// Where frames are predicted: on GPUs on the device, on the host where the device is software (a dispatch
// costs more there than the CPU's vectors do), where there are temporal layers, or where the device's buffers
// are too small.
enum class Prediction : std::uint8_t { automatic, onHost, onDevice };

// The packets of frames that are predicted on the device are those of a codec::Encoder of this lag: the
// weights of a frame are known when it is recorded, whatever of the frames before it is still to be
// entropy-coded.
inline constexpr std::uint32_t kWeightLag = 3;

// The readback of one recorded frame, waiting to be entropy-coded.
struct RecordedFrame {
  std::uint32_t slot = 0;
  std::uint64_t tick = 0;
  codec::PacketKind kind = codec::PacketKind::key;
  std::uint64_t referenceTick = 0;  // of a predicted frame of a stream of one temporal layer
};

struct EncodedFrame {
  std::size_t bytes = 0;  // written to `out`
  std::uint64_t reconstructionHash = 0;
  // As in the packet's header.
  std::uint8_t layer = 0;
  std::uint64_t referenceTick = 0;  // of a predicted frame; else 0
};

// record() belongs to the device's thread, entropyCode() to one other thread (or the same).
class FrameEncoder {
 public:
  // Frames that may be recorded and not yet entropy-coded.
  static constexpr std::uint32_t kSlots = kWeightLag;

  // Throws std::runtime_error where `prediction` is asked for and cannot be. `workers`, if any, predict large
  // frames on the host and outlive the encoder.
  FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
               const codec::StreamLayout& layout, Prediction prediction = Prediction::automatic,
               codec::Workers* workers = nullptr);
  // Predicted on the host by this encoder, which is of that layout.
  FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
               const codec::StreamLayout& layout, std::unique_ptr<codec::Encoder> encoder);
  ~FrameEncoder();
  FrameEncoder(const FrameEncoder&) = delete;
  FrameEncoder& operator=(const FrameEncoder&) = delete;

  // Whether a slot is free.
  bool canRecord() const;
  // Whether all are: no frame waits to be entropy-coded.
  bool isIdle() const;

  // Takes the simulation's present positions (and normals, which must have been recorded,
  // where the layout has them). `tick` must grow from call to call, but where history was forgotten. A
  // predicted frame refers to the frame recorded before, or with temporal layers as codec::Encoder has it;
  // the first is always a key frame, whatever is asked.
  RecordedFrame record(vulkan::Recorder& recorder, std::uint64_t tick, bool forceKey);

  // After a rollback or restore: the next frame is a key frame.
  void forgetHistory();

  // Once the recording is complete on the device, in the order of record(); frees the slot. `out` holds at
  // least packetBound() bytes.
  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out);

  std::size_t packetBound() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::encode

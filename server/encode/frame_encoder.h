// SPDX-License-Identifier: MIT
// Encodes simulation states as frames: the device prepares them, the CPU writes packets.
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

// The layout of a scene's stream.
codec::StreamLayout streamLayout(const model::Scene& scene, std::uint32_t epoch);

// The place of prediction. `automatic` chooses the device on GPUs. It chooses the host on software devices,
// where a dispatch costs more than the CPU's vectors, and if the device's buffers are too small.
enum class Prediction : std::uint8_t { automatic, onHost, onDevice };

// Lag of the weights, in frames. Frames that the device predicts have the packets of a codec::Encoder with
// this lag. The weights of a frame are known when it is recorded, although earlier frames may still wait for
// entropy coding.
inline constexpr std::uint32_t kWeightLag = 3;

// A recorded frame that waits for entropy coding.
struct RecordedFrame {
  std::uint32_t slot = 0;
  std::uint64_t tick = 0;
  codec::PacketKind kind = codec::PacketKind::key;
  std::uint64_t referenceTick = 0;  // of a predicted frame
};

struct EncodedFrame {
  std::size_t bytes = 0;  // written to `out`
  std::uint64_t reconstructionHash = 0;
  // As in the packet's header.
  codec::PacketKind kind = codec::PacketKind::key;
  std::uint64_t referenceTick = 0;  // of a predicted frame; else 0
};

// record() belongs to the device's thread, entropyCode() to one other thread at a time (or the same).
class FrameEncoder {
 public:
  // Largest number of frames that are recorded and not yet entropy-coded.
  static constexpr std::uint32_t kSlots = kWeightLag;

  // Throws std::runtime_error if the requested `prediction` is not possible. `workers`, if given, predict
  // large frames on the host and must outlive the encoder.
  FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
               const codec::StreamLayout& layout, Prediction prediction = Prediction::automatic,
               codec::Workers* workers = nullptr);
  // Predicts on the host by `encoder`, which has the same layout.
  FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
               const codec::StreamLayout& layout, std::unique_ptr<codec::Encoder> encoder);
  ~FrameEncoder();
  FrameEncoder(const FrameEncoder&) = delete;
  FrameEncoder& operator=(const FrameEncoder&) = delete;

  // True if a slot is free.
  bool canRecord() const;
  // True if all slots are free: no frame waits for entropy coding.
  bool isIdle() const;

  // Records a frame of the simulation's present positions, and of its normals if the layout has them; these
  // must be recorded before. `tick` must grow from call to call, unless history was forgotten. A predicted
  // frame refers to the frame recorded before. The first frame is always a key frame.
  RecordedFrame record(vulkan::Recorder& recorder, std::uint64_t tick, bool forceKey);

  // Makes the next frame a key frame, after a rollback or restore.
  void forgetHistory();

  // Codes a frame whose recording is complete, in the order of record(). Frees the slot. `out` has at least
  // packetBound() bytes.
  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out);

  std::size_t packetBound() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::encode

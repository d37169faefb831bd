// SPDX-License-Identifier: MIT
// Reads the messages that only recordings have (proto/clothstream/v1/recording.proto) into plain structs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <clothstream/recording.h>

#include "clients/core/wire/wire.h"

namespace clothstream::client {

struct RecordedTick {
  std::uint64_t tick = 0, stateHash = 0;
  bool unhealthy = false, savesState = false;
  std::uint32_t recovery = 0, substeps = 0;
  Vec3 gravity{}, wind{};
  float airDensity = 0;
  std::vector<cs_recorded_collider> colliders;
  std::vector<cs_recorded_pose> attachments;
  std::vector<cs_recorded_grab> grabs;
};

struct Checkpoint {
  std::uint64_t tick = 0;
  std::vector<float> state;  // 6 floats per node
};

struct ParticipantEvent {
  std::uint64_t id = 0;
  std::uint32_t kind = 0;
  std::string name, clientName;
};

inline constexpr std::size_t kMaxAttachments = 65536;
inline constexpr std::size_t kMaxRecordedGrabs = 4096;

// The functions return nullopt if the message is not well formed, a number is not finite, there are more
// elements than allowed, or a state is not a number of whole nodes.
[[nodiscard]] std::optional<RecordedTick> readRecordedTick(Bytes message);
[[nodiscard]] std::optional<Checkpoint> readCheckpoint(Bytes message);
[[nodiscard]] std::optional<ParticipantEvent> readParticipantEvent(Bytes message);

}  // namespace clothstream::client

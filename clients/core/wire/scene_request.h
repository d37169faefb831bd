// SPDX-License-Identifier: MIT
// Serialises requests about scenes (proto/clothstream/v1/session.proto), and reads their answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/core/wire/wire.h"

namespace clothstream::client {

// Each function replaces the content of `out`.

// Definition of a new scene. Exactly one member is set.
struct SceneSource {
  std::optional<std::string_view> scene;   // serialised Scene
  std::optional<std::uint64_t> contentId;  // of an upload
  std::optional<std::string_view> named;   // scene that is copied
};
void writeCreateScene(std::string& out, std::uint64_t requestId, const SceneSource& source,
                      std::string_view name, std::uint32_t maxParticipants);
struct UploadPiece {
  std::uint64_t contentId = 0;
  std::uint32_t index = 0, count = 0;
  std::uint64_t totalBytes = 0;
  std::string_view data;
};
void writeUploadPiece(std::string& out, std::uint64_t requestId, const UploadPiece& piece);
void writeDeleteScene(std::string& out, std::uint64_t requestId, std::string_view name);
void writeStartRecording(std::string& out, std::uint64_t requestId, std::string_view scene,
                         std::string_view file);
void writeStopRecording(std::string& out, std::uint64_t requestId, std::string_view scene);
void writeGetScene(std::string& out, std::uint64_t requestId, std::string_view name);
void writeListBans(std::string& out, std::uint64_t requestId, std::string_view scene);
void writeLiftBan(std::string& out, std::uint64_t requestId, std::string_view scene,
                  std::string_view subject);

struct SceneSummary {
  std::string name, description;
  std::uint32_t vertices = 0, cloths = 0, participants = 0, maxParticipants = 0;
  bool running = false, paused = false, created = false, recorded = false, isRecording = false;
};

struct Ban {
  std::string subject, displayName, tenant;
};

struct StoppedRecording {
  std::string file;
  std::uint64_t bytes = 0;
};

inline constexpr std::size_t kMaxScenes = 65536;
inline constexpr std::size_t kMaxSceneTextBytes = 4096;  // of each name and description
inline constexpr std::size_t kMaxBans = 4096;
inline constexpr std::size_t kMaxDefinitionBytes = 1 << 20;
inline constexpr std::size_t kMaxRepairBytes = 1 << 18;  // of all sentences

// The functions return nullopt if the message is not well formed, a text is not UTF-8, or a limit above is
// exceeded.
[[nodiscard]] std::optional<std::vector<SceneSummary>> readScenes(Bytes message);
struct SceneAnswer {
  std::string name;
  std::string repairs;  // one sentence a line
};
// Reads a CreateSceneResponse or ControlSceneResponse.
[[nodiscard]] std::optional<SceneAnswer> readSceneAnswer(Bytes message);
[[nodiscard]] std::optional<std::string> readStartedRecording(Bytes message);
[[nodiscard]] std::optional<StoppedRecording> readStoppedRecording(Bytes message);
// Returns the serialised Scene of a GetSceneResponse.
[[nodiscard]] std::optional<std::string> readDefinition(Bytes message);
[[nodiscard]] std::optional<std::vector<Ban>> readBans(Bytes message);

}  // namespace clothstream::client

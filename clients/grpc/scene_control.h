// SPDX-License-Identifier: MIT
// Creates, deletes, controls and records scenes of a server without joining them.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "clients/native/address.h"
#include "clients/native/failure.h"
#include "clothstream/v1/session.pb.h"

namespace clothstream {

struct CreateSceneOptions {
  std::string named;                  // scene of the server to copy; empty: use `scene`
  v1::Scene scene;                    // with the geometry of its meshes
  std::string name;                   // replaces the scene's name; empty: keep it
  std::uint32_t maxParticipants = 0;  // 0: the server's limit
  std::chrono::milliseconds timeout{120'000};
  // Called with the bytes sent so far and in total. May be empty.
  std::function<void(std::size_t, std::size_t)> progress;
};

// Returns the summary of the new scene and what was repaired in its meshes. `address` must come from
// completeAddress().
[[nodiscard]] tl::expected<v1::CreateSceneResponse, Failure> createScene(const ServerAddress& address,
                                                                         const CreateSceneOptions& options);

[[nodiscard]] tl::expected<void, Failure> deleteScene(const ServerAddress& address, const std::string& name);

// Pauses or resumes the scene, and resets its cloths to their start. An empty name is the default scene.
[[nodiscard]] tl::expected<void, Failure> controlScene(const ServerAddress& address, const std::string& name,
                                                       std::optional<bool> paused, bool reset);

// Definition of the scene with its current parameters. An empty name is the default scene.
[[nodiscard]] tl::expected<v1::Scene, Failure> getScene(const ServerAddress& address,
                                                        const std::string& name);

// Records the scene to a file on the server and returns the name of the file. If `file` is empty, the server
// chooses the name.
[[nodiscard]] tl::expected<std::string, Failure> startRecording(const ServerAddress& address,
                                                                const std::string& scene,
                                                                const std::string& file);
[[nodiscard]] tl::expected<v1::StopRecordingResponse, Failure> stopRecording(const ServerAddress& address,
                                                                             const std::string& scene);

// Sends a whole request and returns the state of the scene after it.
[[nodiscard]] tl::expected<v1::SceneSummary, Failure> controlScene(const ServerAddress& address,
                                                                   const v1::ControlSceneRequest& request);

}  // namespace clothstream

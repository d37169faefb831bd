// SPDX-License-Identifier: MIT
// Scenes of a server made, ended, and stopped for a while, without joining any.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "clients/grpc/failure.h"
#include "clothstream/v1/session.pb.h"

namespace clothstream {

struct CreateSceneOptions {
  std::string named;                  // one that the server knows how to make; empty: `scene`
  v1::Scene scene;                    // its meshes with their geometry
  std::string name;                   // instead of the scene's own; empty: that
  std::uint32_t maxParticipants = 0;  // 0: the server's limit
  std::chrono::milliseconds timeout{120'000};
  // Bytes sent so far, and in all. May be empty.
  std::function<void(std::size_t, std::size_t)> progress;
};

// `address` as completeAddress gives it. Gives the scene's name; sends as many pieces as it takes.
[[nodiscard]] tl::expected<std::string, Failure> createScene(const std::string& address,
                                                             const CreateSceneOptions& options);

[[nodiscard]] tl::expected<void, Failure> deleteScene(const std::string& address, const std::string& name);

// Stops the scene's clock or lets it run; puts its cloths back to where they start. `name` empty: the default
// scene.
[[nodiscard]] tl::expected<void, Failure> controlScene(const std::string& address, const std::string& name,
                                                       std::optional<bool> paused, bool reset);

// All that happens in the scene goes to a file on the server; gives its name there. `file` empty: the
// server's choice.
[[nodiscard]] tl::expected<std::string, Failure> startRecording(const std::string& address,
                                                                const std::string& scene,
                                                                const std::string& file);
[[nodiscard]] tl::expected<v1::StopRecordingResponse, Failure> stopRecording(const std::string& address,
                                                                             const std::string& scene);

// All that can be asked of a scene's clock; gives the scene as it is then.
[[nodiscard]] tl::expected<v1::SceneSummary, Failure> controlScene(const std::string& address,
                                                                   const v1::ControlSceneRequest& request);

}  // namespace clothstream

// SPDX-License-Identifier: MIT
// The unary call ListScenes.
#include "clients/grpc/scene_list.h"

#include "clients/grpc/channel.h"
#include "clothstream/v1/session.grpc.pb.h"

namespace clothstream {

tl::expected<std::vector<SceneSummary>, Failure> listScenes(const ServerAddress& address,
                                                            std::chrono::milliseconds timeout) {
  const auto response = callServer<v1::ListScenesResponse>(address, v1::ListScenesRequest(),
                                                           &v1::ClothStream::Stub::ListScenes, timeout);
  if (!response) return tl::unexpected(response.error());
  std::vector<SceneSummary> scenes;
  for (const v1::SceneSummary& scene : response->scenes()) {
    scenes.push_back({.name = scene.name(),
                      .description = scene.description(),
                      .vertexCount = scene.vertex_count(),
                      .clothCount = scene.cloth_count(),
                      .participants = scene.participants(),
                      .maxParticipants = scene.max_participants(),
                      .running = scene.running(),
                      .paused = scene.paused(),
                      .created = scene.created()});
  }
  return scenes;
}

}  // namespace clothstream

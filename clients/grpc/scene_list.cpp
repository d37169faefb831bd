// SPDX-License-Identifier: MIT
// The unary call ListScenes.
#include "clients/grpc/scene_list.h"

#include "clients/grpc/channel.h"
#include "clothstream/v1/session.grpc.pb.h"

namespace clothstream {

tl::expected<std::vector<SceneSummary>, Failure> listScenes(const ServerAddress& address,
                                                            std::chrono::milliseconds timeout) {
  const auto stub = v1::ClothStream::NewStub(makeChannel(address));
  grpc::ClientContext context;
  authorize(context, address);
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  v1::ListScenesResponse response;
  const grpc::Status status = stub->ListScenes(&context, {}, &response);
  if (!status.ok()) return tl::unexpected(notJoined(address, status));
  std::vector<SceneSummary> scenes;
  for (const v1::SceneSummary& scene : response.scenes()) {
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

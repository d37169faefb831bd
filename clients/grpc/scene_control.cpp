// SPDX-License-Identifier: MIT
// CreateScene uses a stream for the upload; the others are unary calls.
#include "clients/grpc/scene_control.h"

#include <algorithm>
#include <utility>

#include "clients/grpc/channel.h"

namespace clothstream {
namespace {

constexpr std::size_t kPieceBytes = 48 * 1024;  // a message is at most 64 KiB
constexpr std::uint64_t kContentId = 1;

using Stream = grpc::ClientReaderWriter<v1::ClientMessage, v1::ServerMessage>;

bool upload(Stream& stream, const std::string& bytes, const CreateSceneOptions& options) {
  const std::size_t count = std::max<std::size_t>(1, (bytes.size() + kPieceBytes - 1) / kPieceBytes);
  v1::ClientMessage message;
  v1::Chunk& chunk = *message.mutable_upload();
  chunk.set_content_id(kContentId);
  chunk.set_kind(v1::CONTENT_KIND_SCENE);
  chunk.set_count(static_cast<std::uint32_t>(count));
  chunk.set_total_bytes(bytes.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * kPieceBytes;
    chunk.set_index(static_cast<std::uint32_t>(i));
    chunk.set_data(bytes.substr(first, kPieceBytes));
    if (!stream.Write(message)) return false;
    if (options.progress) options.progress(first + chunk.data().size(), bytes.size());
  }
  return true;
}

tl::expected<void, Failure> nothingOf(tl::expected<v1::SceneSummary, Failure> scene) {
  if (!scene) return tl::unexpected(std::move(scene).error());
  return {};
}

}  // namespace

tl::expected<v1::CreateSceneResponse, Failure> createScene(const ServerAddress& address,
                                                           const CreateSceneOptions& options) {
  const auto stub = v1::ClothStream::NewStub(makeChannel(address));
  grpc::ClientContext context;
  authorize(context, address);
  context.set_deadline(std::chrono::system_clock::now() + options.timeout);
  const std::unique_ptr<Stream> stream = stub->Join(&context);
  v1::ClientMessage message;
  message.set_request_id(1);
  v1::CreateSceneRequest& request = *message.mutable_create_scene();
  request.set_name(options.name);
  request.set_max_participants(options.maxParticipants);
  bool sent = true;
  if (options.named.empty()) {
    sent = upload(*stream, options.scene.SerializeAsString(), options);
    request.set_uploaded_content_id(kContentId);
  } else {
    request.set_named(options.named);
  }
  sent = sent && stream->Write(message);
  v1::ServerMessage answer;
  while (stream->Read(&answer) && !answer.has_error() && !answer.has_create_scene()) {
  }
  // Closing the sending half leaves the scene, so it must follow the answer.
  stream->WritesDone();
  if (answer.has_create_scene() || answer.has_error()) context.TryCancel();
  const grpc::Status status = stream->Finish();
  if (answer.has_create_scene()) return std::move(*answer.mutable_create_scene());
  if (answer.has_error())
    return tl::unexpected(Failure{Failure::Kind::refused,
                                  "The server at " + address.address + " refuses: " + answer.error().text()});
  return tl::unexpected(sent ? notJoined(address, status) : lost(address, status));
}

tl::expected<void, Failure> deleteScene(const ServerAddress& address, const std::string& name) {
  v1::DeleteSceneRequest request;
  request.set_name(name);
  const auto done =
      callServer<v1::DeleteSceneResponse>(address, request, &v1::ClothStream::Stub::DeleteScene);
  if (!done) return tl::unexpected(done.error());
  return {};
}

tl::expected<void, Failure> controlScene(const ServerAddress& address, const std::string& name,
                                         std::optional<bool> paused, bool reset) {
  v1::ControlSceneRequest request;
  request.set_name(name);
  if (paused) request.set_paused(*paused);
  request.set_reset(reset);
  return nothingOf(controlScene(address, request));
}

tl::expected<v1::SceneSummary, Failure> controlScene(const ServerAddress& address,
                                                     const v1::ControlSceneRequest& request) {
  auto response =
      callServer<v1::ControlSceneResponse>(address, request, &v1::ClothStream::Stub::ControlScene);
  if (!response) return tl::unexpected(std::move(response).error());
  return std::move(*response->mutable_scene());
}

tl::expected<v1::Scene, Failure> getScene(const ServerAddress& address, const std::string& name) {
  v1::GetSceneRequest request;
  request.set_name(name);
  auto response = callServer<v1::GetSceneResponse>(address, request, &v1::ClothStream::Stub::GetScene);
  if (!response) return tl::unexpected(std::move(response).error());
  return std::move(*response->mutable_scene());
}

tl::expected<std::string, Failure> startRecording(const ServerAddress& address, const std::string& scene,
                                                  const std::string& file) {
  v1::StartRecordingRequest request;
  request.set_scene(scene);
  request.set_name(file);
  auto response =
      callServer<v1::StartRecordingResponse>(address, request, &v1::ClothStream::Stub::StartRecording);
  if (!response) return tl::unexpected(std::move(response).error());
  return response->file();
}

tl::expected<v1::StopRecordingResponse, Failure> stopRecording(const ServerAddress& address,
                                                               const std::string& scene) {
  v1::StopRecordingRequest request;
  request.set_scene(scene);
  return callServer<v1::StopRecordingResponse>(address, request, &v1::ClothStream::Stub::StopRecording);
}

}  // namespace clothstream

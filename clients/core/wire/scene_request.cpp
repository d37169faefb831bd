// SPDX-License-Identifier: MIT
// Requests about scenes, field by field.
#include "clients/core/wire/scene_request.h"

#include <protozero/pbf_writer.hpp>

namespace clothstream::client {
namespace {

using Writer = protozero::pbf_writer;

// A nested Writer omits an empty message, so the body is built first.
template <typename Fill>
void writeRequest(std::string& out, std::uint64_t requestId, field::Field bodyField, Fill fill) {
  std::string content;
  Writer body(content);
  fill(body);
  out.clear();
  Writer message(out);
  message.add_uint64(field::ClientMessage::kRequestId.number, requestId);
  message.add_message(bodyField.number, content);
}

void addText(Writer& message, field::Field textField, std::string_view text) {
  if (!text.empty()) message.add_bytes(textField.number, text.data(), text.size());
}

bool setShortText(std::string& target, Reader& reader) {
  return setText(target, reader) && target.size() <= kMaxSceneTextBytes;
}

bool readSummary(Bytes message, SceneSummary& out) {
  using F = field::SceneSummary;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kName.tag:
        return setShortText(out.name, reader);
      case F::kDescription.tag:
        return setShortText(out.description, reader);
      case F::kVertexCount.tag:
        return set(out.vertices, reader.get_uint32());
      case F::kClothCount.tag:
        return set(out.cloths, reader.get_uint32());
      case F::kParticipants.tag:
        return set(out.participants, reader.get_uint32());
      case F::kRunning.tag:
        return set(out.running, reader.get_bool());
      case F::kPaused.tag:
        return set(out.paused, reader.get_bool());
      case F::kCreated.tag:
        return set(out.created, reader.get_bool());
      case F::kPlayback.tag:
        return set(out.isRecording, true) && skip(reader);
      case F::kRecorded.tag:
        return set(out.recorded, reader.get_bool());
      case F::kMaxParticipants.tag:
        return set(out.maxParticipants, reader.get_uint32());
      default:
        return skip(reader);
    }
  });
}

// Appends the sentences of a MeshRepair.
bool readRepairs(Bytes message, std::string& out) {
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag != field::MeshRepair::kSentences.tag) return skip(reader);
    std::string sentence;
    if (!setShortText(sentence, reader)) return false;
    if (!out.empty()) out += '\n';
    out += sentence;
    return out.size() <= kMaxRepairBytes;
  });
}

bool readBan(Bytes message, Ban& out) {
  using F = field::Ban;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kSubject.tag:
        return setShortText(out.subject, reader);
      case F::kDisplayName.tag:
        return setShortText(out.displayName, reader);
      case F::kTenant.tag:
        return setShortText(out.tenant, reader);
      default:
        return skip(reader);
    }
  });
}

}  // namespace

void writeCreateScene(std::string& out, std::uint64_t requestId, const SceneSource& source,
                      std::string_view name, std::uint32_t maxParticipants) {
  writeRequest(out, requestId, field::ClientMessage::kCreateScene, [&](Writer& message) {
    using F = field::CreateSceneRequest;
    if (source.scene) message.add_message(F::kScene.number, source.scene->data(), source.scene->size());
    if (source.contentId) message.add_uint64(F::kUploadedContentId.number, *source.contentId);
    if (source.named) message.add_bytes(F::kNamed.number, source.named->data(), source.named->size());
    addText(message, F::kName, name);
    if (maxParticipants != 0) message.add_uint32(F::kMaxParticipants.number, maxParticipants);
  });
}

void writeUploadPiece(std::string& out, std::uint64_t requestId, const UploadPiece& piece) {
  writeRequest(out, requestId, field::ClientMessage::kUpload, [&](Writer& message) {
    using F = field::Chunk;
    message.add_uint64(F::kContentId.number, piece.contentId);
    message.add_uint32(F::kKind.number, field::ContentKind::kScene);
    message.add_uint32(F::kIndex.number, piece.index);
    message.add_uint32(F::kCount.number, piece.count);
    message.add_uint64(F::kTotalBytes.number, piece.totalBytes);
    message.add_bytes(F::kData.number, piece.data.data(), piece.data.size());
  });
}

void writeDeleteScene(std::string& out, std::uint64_t requestId, std::string_view name) {
  writeRequest(out, requestId, field::ClientMessage::kDeleteScene,
               [&](Writer& message) { addText(message, field::DeleteSceneRequest::kName, name); });
}

void writeStartRecording(std::string& out, std::uint64_t requestId, std::string_view scene,
                         std::string_view file) {
  writeRequest(out, requestId, field::ClientMessage::kStartRecording, [&](Writer& message) {
    addText(message, field::StartRecordingRequest::kScene, scene);
    addText(message, field::StartRecordingRequest::kName, file);
  });
}

void writeStopRecording(std::string& out, std::uint64_t requestId, std::string_view scene) {
  writeRequest(out, requestId, field::ClientMessage::kStopRecording,
               [&](Writer& message) { addText(message, field::StopRecordingRequest::kScene, scene); });
}

void writeGetScene(std::string& out, std::uint64_t requestId, std::string_view name) {
  writeRequest(out, requestId, field::ClientMessage::kGetScene,
               [&](Writer& message) { addText(message, field::GetSceneRequest::kName, name); });
}

void writeListBans(std::string& out, std::uint64_t requestId, std::string_view scene) {
  writeRequest(out, requestId, field::ClientMessage::kListBans,
               [&](Writer& message) { addText(message, field::ListBansRequest::kScene, scene); });
}

void writeLiftBan(std::string& out, std::uint64_t requestId, std::string_view scene,
                  std::string_view subject) {
  writeRequest(out, requestId, field::ClientMessage::kLiftBan, [&](Writer& message) {
    addText(message, field::LiftBanRequest::kScene, scene);
    addText(message, field::LiftBanRequest::kSubject, subject);
  });
}

std::optional<std::vector<SceneSummary>> readScenes(Bytes message) {
  using F = field::ListScenesResponse;
  using Scenes = std::vector<SceneSummary>;
  return readMessage<Scenes>(message, [](Scenes& scenes, std::uint32_t tag, Reader& reader) {
    if (tag != F::kScenes.tag) return skip(reader);
    return scenes.size() < kMaxScenes && readSummary(reader.get_view(), scenes.emplace_back());
  });
}

std::optional<SceneAnswer> readSceneAnswer(Bytes message) {
  using F = field::CreateSceneResponse;
  static_assert(F::kScene.tag == field::ControlSceneResponse::kScene.tag);
  return readMessage<SceneAnswer>(message, [](SceneAnswer& answer, std::uint32_t tag, Reader& reader) {
    if (tag == F::kRepairs.tag) return readRepairs(reader.get_view(), answer.repairs);
    if (tag != F::kScene.tag) return skip(reader);
    SceneSummary summary;
    if (!readSummary(reader.get_view(), summary)) return false;
    answer.name = std::move(summary.name);
    return true;
  });
}

std::optional<std::string> readStartedRecording(Bytes message) {
  using F = field::StartRecordingResponse;
  return readMessage<std::string>(message, [](std::string& file, std::uint32_t tag, Reader& reader) {
    return tag == F::kFile.tag ? setShortText(file, reader) : skip(reader);
  });
}

std::optional<StoppedRecording> readStoppedRecording(Bytes message) {
  using F = field::StopRecordingResponse;
  return readMessage<StoppedRecording>(
      message, [](StoppedRecording& stopped, std::uint32_t tag, Reader& reader) {
        if (tag == F::kBytes.tag) return set(stopped.bytes, reader.get_uint64());
        return tag == F::kFile.tag ? setShortText(stopped.file, reader) : skip(reader);
      });
}

std::optional<std::string> readDefinition(Bytes message) {
  using F = field::GetSceneResponse;
  return readMessage<std::string>(message, [](std::string& scene, std::uint32_t tag, Reader& reader) {
    if (tag != F::kScene.tag) return skip(reader);
    return setBytes(scene, reader) && scene.size() <= kMaxDefinitionBytes;
  });
}

std::optional<std::vector<Ban>> readBans(Bytes message) {
  using F = field::ListBansResponse;
  using Bans = std::vector<Ban>;
  return readMessage<Bans>(message, [](Bans& bans, std::uint32_t tag, Reader& reader) {
    if (tag != F::kBans.tag) return skip(reader);
    return bans.size() < kMaxBans && readBan(reader.get_view(), bans.emplace_back());
  });
}

}  // namespace clothstream::client

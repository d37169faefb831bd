// SPDX-License-Identifier: MIT
// Requests about scenes, and their answers.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "clients/core/client.h"

namespace clothstream::client {
namespace {

std::optional<cs_request> requestOf(Body answer) {
  switch (answer) {
    case Body::createScene:
      return CS_REQUEST_CREATE_SCENE;
    case Body::deleteScene:
      return CS_REQUEST_DELETE_SCENE;
    case Body::controlScene:
      return CS_REQUEST_CONTROL_SCENE;
    case Body::startRecording:
      return CS_REQUEST_START_RECORDING;
    case Body::stopRecording:
      return CS_REQUEST_STOP_RECORDING;
    case Body::getScene:
      return CS_REQUEST_GET_SCENE;
    case Body::listBans:
      return CS_REQUEST_LIST_BANS;
    case Body::liftBan:
      return CS_REQUEST_LIFT_BAN;
    default:
      return std::nullopt;
  }
}

template <typename Value>
bool assign(Value& target, std::optional<Value> value) {
  if (!value) return false;
  target = std::move(*value);
  return true;
}

}  // namespace

template <typename Write>
std::uint64_t Client::request(cs_request kind, Write write) {
  if (state_ != CS_STATE_JOINED || requests_.isFull()) return 0;
  std::string message;
  const std::uint64_t id = ++lastRequestId_;
  write(message, id);
  send(std::move(message));
  if (state_ != CS_STATE_JOINED) return 0;  // the connection sends no messages
  requests_.add(id, kind);
  return id;
}

std::string_view Client::orJoined(std::string_view scene) const {
  return scene.empty() ? std::string_view(welcome_.scene) : scene;
}

std::uint64_t Client::createScene(std::string_view scene, std::string_view name,
                                  std::uint32_t maxParticipants) {
  if (scene.empty() || scene.size() > Upload::kMaxBytes || upload_.isActive()) return 0;
  // The rest of the message is at most the name, which the server limits.
  if (scene.size() + name.size() <= Upload::kPieceBytes)
    return request(CS_REQUEST_CREATE_SCENE, [&](std::string& message, std::uint64_t id) {
      writeCreateScene(message, id, {.scene = scene, .contentId = {}, .named = {}}, name, maxParticipants);
    });
  if (state_ != CS_STATE_JOINED || requests_.isFull()) return 0;
  const std::uint64_t id = ++lastRequestId_;
  std::string message;
  writeCreateScene(message, id, {.scene = {}, .contentId = id, .named = {}}, name, maxParticipants);
  upload_.begin(std::string(scene), std::move(message), id);
  requests_.add(id, CS_REQUEST_CREATE_SCENE);
  return id;
}

std::uint64_t Client::copyScene(std::string_view source, std::string_view name,
                                std::uint32_t maxParticipants) {
  return request(CS_REQUEST_CREATE_SCENE, [&](std::string& message, std::uint64_t id) {
    writeCreateScene(message, id, {.scene = {}, .contentId = {}, .named = orJoined(source)}, name,
                     maxParticipants);
  });
}

std::uint64_t Client::deleteScene(std::string_view scene) {
  return request(CS_REQUEST_DELETE_SCENE, [&](std::string& message, std::uint64_t id) {
    writeDeleteScene(message, id, orJoined(scene));
  });
}

std::uint64_t Client::controlScene(std::string_view scene, const SceneControl& control) {
  return request(CS_REQUEST_CONTROL_SCENE, [&](std::string& message, std::uint64_t id) {
    writeControlScene(message, id, orJoined(scene), control);
  });
}

std::uint64_t Client::startRecording(std::string_view scene, std::string_view file) {
  return request(CS_REQUEST_START_RECORDING, [&](std::string& message, std::uint64_t id) {
    writeStartRecording(message, id, orJoined(scene), file);
  });
}

std::uint64_t Client::stopRecording(std::string_view scene) {
  return request(CS_REQUEST_STOP_RECORDING, [&](std::string& message, std::uint64_t id) {
    writeStopRecording(message, id, orJoined(scene));
  });
}

std::uint64_t Client::requestDefinition(std::string_view scene) {
  return request(CS_REQUEST_GET_SCENE, [&](std::string& message, std::uint64_t id) {
    writeGetScene(message, id, orJoined(scene));
  });
}

std::uint64_t Client::listBans(std::string_view scene) {
  return request(CS_REQUEST_LIST_BANS, [&](std::string& message, std::uint64_t id) {
    writeListBans(message, id, orJoined(scene));
  });
}

std::uint64_t Client::liftBan(std::string_view scene, std::string_view subject) {
  return request(CS_REQUEST_LIFT_BAN, [&](std::string& message, std::uint64_t id) {
    writeLiftBan(message, id, orJoined(scene), subject);
  });
}

void Client::forgetRequests() {
  requests_.clear();
  upload_.end();
}

std::uint32_t Client::answerReceived(const ServerMessage& message) {
  const std::optional<cs_request> answered = requestOf(message.kind);
  const std::optional<cs_request> request = requests_.take(message.requestId);
  if (!request || request != answered) return 0;  // an answer that this client does not wait for
  answer_ = {.requestId = message.requestId,
             .request = *request,
             .error = 0,
             .errorText = {},
             .name = {},
             .bytes = 0,
             .repairs = {}};
  if (message.requestId == upload_.requestId()) upload_.end();
  if (!readAnswer(message)) return failMalformed("answer");
  return CS_EVENT_ANSWER;
}

bool Client::readAnswer(const ServerMessage& message) {
  switch (message.kind) {
    case Body::createScene:
    case Body::controlScene: {
      std::optional<SceneAnswer> scene = readSceneAnswer(message.body);
      if (!scene) return false;
      answer_.name = std::move(scene->name);
      answer_.repairs = std::move(scene->repairs);
      return true;
    }
    case Body::startRecording:
      return assign(answer_.name, readStartedRecording(message.body));
    case Body::stopRecording: {
      std::optional<StoppedRecording> stopped = readStoppedRecording(message.body);
      if (!stopped) return false;
      answer_.name = std::move(stopped->file);
      answer_.bytes = stopped->bytes;
      return true;
    }
    case Body::getScene:
      return assign(definition_, readDefinition(message.body));
    case Body::listBans:
      return assign(bans_, readBans(message.body));
    default:
      return wellFormed(message.body);
  }
}

}  // namespace clothstream::client

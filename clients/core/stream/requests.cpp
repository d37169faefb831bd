// SPDX-License-Identifier: MIT
#include "clients/core/stream/requests.h"

#include <algorithm>
#include <utility>

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

void Requests::upload(std::string content, std::string request, std::uint64_t id) {
  upload_.begin(std::move(content), std::move(request), id);
  add(id, CS_REQUEST_CREATE_SCENE);
}

void Requests::forget() {
  waiting_.clear();
  upload_.end();
}

std::optional<cs_request> Requests::take(std::uint64_t id) {
  const auto found =
      std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& one) { return one.id == id; });
  if (found == waiting_.end()) return std::nullopt;
  const cs_request request = found->request;
  waiting_.erase(found);
  return request;
}

Requests::Outcome Requests::answered(const ServerMessage& message) {
  const std::optional<cs_request> expected = requestOf(message.kind);
  const std::optional<cs_request> request = take(message.requestId);
  if (!request || request != expected) return Outcome::unknown;
  answer_ = {.requestId = message.requestId,
             .request = *request,
             .error = 0,
             .errorText = {},
             .name = {},
             .bytes = 0,
             .repairs = {}};
  if (message.requestId == upload_.requestId()) upload_.end();
  return read(message) ? Outcome::answered : Outcome::malformed;
}

Requests::Outcome Requests::refused(std::uint64_t id, ServerError& error) {
  const std::optional<cs_request> request = take(id);
  if (!request) return Outcome::unknown;
  if (id == upload_.requestId()) {
    endedUploadId_ = id;
    upload_.end();
  }
  answer_ = {.requestId = id,
             .request = *request,
             .error = error.code,
             .errorText = std::move(error.text),
             .name = {},
             .bytes = 0,
             .repairs = {}};
  return Outcome::answered;
}

bool Requests::read(const ServerMessage& message) {
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

// SPDX-License-Identifier: MIT
// Requests about scenes.
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "clients/core/client.h"

namespace clothstream::client {

template <typename Write>
std::uint64_t Client::request(cs_request kind, Write write) {
  if (state_ != CS_STATE_JOINED || requests_.isFull()) return 0;
  std::string message;
  const std::uint64_t id = requests_.nextId();
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
  if (scene.empty() || scene.size() > Upload::kMaxBytes || requests_.currentUpload().isActive()) return 0;
  // The rest of the message is at most the name, which the server limits.
  if (scene.size() + name.size() <= Upload::kPieceBytes)
    return request(CS_REQUEST_CREATE_SCENE, [&](std::string& message, std::uint64_t id) {
      writeCreateScene(message, id, {.scene = scene, .contentId = {}, .named = {}}, name, maxParticipants);
    });
  if (state_ != CS_STATE_JOINED || requests_.isFull()) return 0;
  const std::uint64_t id = requests_.nextId();
  std::string message;
  writeCreateScene(message, id, {.scene = {}, .contentId = id, .named = {}}, name, maxParticipants);
  requests_.upload(std::string(scene), std::move(message), id);
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

}  // namespace clothstream::client

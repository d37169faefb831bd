// SPDX-License-Identifier: MIT
// Reads the messages of the server (proto/clothstream/v1/session.proto) into plain structs. Members of type
// Bytes point into the message.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/limits.h"
#include "clients/core/wire/parameter_change.h"
#include "clients/core/wire/wire.h"

namespace clothstream::client {

// Bodies of ServerMessage. The values are field numbers.
enum class Body : std::uint32_t {
  none = 0,
  welcome = field::ServerMessage::kWelcome.number,
  chunk = field::ServerMessage::kChunk.number,
  frame = field::ServerMessage::kFrame.number,
  pong = field::ServerMessage::kPong.number,
  notice = field::ServerMessage::kNotice.number,
  parameterChanged = field::ServerMessage::kParameterChanged.number,
  error = field::ServerMessage::kError.number,
  tickEvents = field::ServerMessage::kTickEvents.number,
  moving = field::ServerMessage::kMoving.number,
  listScenes = field::ServerMessage::kListScenes.number,
  presence = field::ServerMessage::kPresence.number,
  playback = field::ServerMessage::kPlayback.number,
  operatingPoint = field::ServerMessage::kOperatingPoint.number,
  authenticate = field::ServerMessage::kAuthenticate.number,
  createPairingCode = field::ServerMessage::kCreatePairingCode.number,
  getScene = field::ServerMessage::kGetScene.number,
  createScene = field::ServerMessage::kCreateScene.number,
  deleteScene = field::ServerMessage::kDeleteScene.number,
  controlScene = field::ServerMessage::kControlScene.number,
  startRecording = field::ServerMessage::kStartRecording.number,
  stopRecording = field::ServerMessage::kStopRecording.number,
  listBans = field::ServerMessage::kListBans.number,
  liftBan = field::ServerMessage::kLiftBan.number,
  datagramAnswer = field::ServerMessage::kDatagramAnswer.number,
  roomSurfaces = field::ServerMessage::kRoomSurfaces.number,
  getSurfacePart = field::ServerMessage::kGetSurfacePart.number,
};

// An unknown kind of body is `none`.
struct ServerMessage {
  Body kind = Body::none;
  Bytes body;
  std::uint64_t requestId = 0;  // 0: not an answer
};

struct Participant {
  std::uint64_t id = 0;
  std::string name, clientName;
  std::uint32_t role = 0;
  bool away = false;
  std::string body;  // name of the collider that it wears; may be empty
};

struct Welcome {
  std::uint32_t protocolVersion = 0, codec = 0;
  std::uint64_t participantId = 0;
  std::string scene, serverName, deviceName;
  std::uint64_t contentId = 0;  // content id of the description
  std::uint32_t role = 0;
  std::string token;
  bool resumed = false;
  std::vector<Participant> participants;
  std::uint32_t graceMs = 0;
  bool acknowledgeEveryFrame = false;
  std::uint32_t surfacePolicy = 0;  // SurfacePolicy; 0: the server knows no surfaces
};

struct Presence {
  std::uint32_t kind = 0, reason = 0;
  Participant participant;
  std::uint64_t by = 0;
};

struct Notice {
  std::string text;
  std::uint64_t participantId = 0;
};

struct Chunk {
  std::uint64_t contentId = 0;
  std::uint32_t kind = 0, index = 0, count = 0;
  std::uint64_t totalBytes = 0;
  Bytes data;
};

struct ClothReport {
  float strainMax = 0, strainP99 = 0, strainMean = 0;
  float kineticEnergy = 0, elasticEnergy = 0, gravityEnergy = 0;
  std::uint32_t activeConstraints = 0, iterations = 0;
  float residual = 0, penetration = 0;
  std::vector<std::uint32_t> constraintEnds;  // two vertices of the cloth for each named constraint
};

inline constexpr std::size_t kMaxConstraintEnds = 2 * 16'384;  // of a cloth

struct SimulationReport {
  std::vector<ClothReport> cloths;
  double deviceSeconds = 0;
};

inline constexpr std::uint32_t kMaxFrameDivisor = 1000;

struct Frame {
  Bytes packet;
  std::uint64_t tickTimeUs = 0, packetTimeUs = 0;  // server's clock
  std::uint64_t reconstructionHash = 0;
  std::uint64_t stateHash = 0;   // of the simulation
  std::vector<Bytes> colliders;  // serialised ColliderStates
  std::optional<Bytes> report;   // a serialised SimulationReport
  std::uint32_t divisor = 1;     // the server sends each divisor-th frame
};

struct Pong {
  std::uint64_t clientTimeUs = 0, serverTimeUs = 0;
};

struct ServerError {
  std::uint32_t code = 0;
  std::string text;
  bool fatal = false;
  std::string server;  // DNS name of the server that has the scene; empty if none, or if it is not a DNS name
};

struct PairingCode {
  std::string code;  // six digits
  std::uint32_t role = 0, validSeconds = 0;
};

struct ContactEvent {
  std::uint32_t kind = 0, colliderId = 0;
  std::uint64_t participantId = 0;
  std::string collider, cloth;
  float impulse = 0, seconds = 0;
};

struct TickEvents {
  std::vector<cs_grab_event> grabs;
  std::vector<ContactEvent> contacts;
};

// The functions return nullopt or false if the message is not well formed, a number is not finite, or there
// are more elements than the protocol allows.
[[nodiscard]] std::optional<ServerMessage> readServerMessage(Bytes message);
// Reads one participant more than the limit, so that the caller can tell.
[[nodiscard]] std::optional<Welcome> readWelcome(Bytes message, const Limits& limits);
[[nodiscard]] std::optional<Chunk> readChunk(Bytes message);
// Reuses the memory of `frame`, whose views point into the message.
[[nodiscard]] bool readFrame(Bytes message, Frame& frame);
[[nodiscard]] std::optional<Pong> readPong(Bytes message);
[[nodiscard]] std::optional<Notice> readNotice(Bytes message);
[[nodiscard]] std::optional<Presence> readPresence(Bytes message);
// Also nullopt if the length is negative.
[[nodiscard]] std::optional<cs_playback> readPlayback(Bytes message);
// Quality that the server sends.
[[nodiscard]] std::optional<std::uint32_t> readOperatingPoint(Bytes message);
[[nodiscard]] std::optional<ParameterChange> readParameterChanged(Bytes message);
[[nodiscard]] std::optional<ServerError> readError(Bytes message);
// DNS name of the server to which the scene moves; empty if it is not a DNS name.
[[nodiscard]] std::optional<std::string> readMoving(Bytes message);
// Returns the token of an AuthenticateResponse; empty if it has none.
[[nodiscard]] std::optional<std::string> readToken(Bytes message);
[[nodiscard]] std::optional<PairingCode> readPairingCode(Bytes message);
[[nodiscard]] bool readTickEvents(Bytes message, TickEvents& events);
// Reuses the memory of `out`.
[[nodiscard]] bool readReport(Bytes message, SimulationReport& out);

inline constexpr std::size_t kMaxEvents = 65536;  // per kind

}  // namespace clothstream::client

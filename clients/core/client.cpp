// SPDX-License-Identifier: MIT
// The state machine: connection and messages of the server.
#include "clients/core/client.h"

#include <algorithm>
#include <span>
#include <utility>

#include "clients/core/stream/resume_token.h"
#include "proto/codec/packet_header.h"

namespace clothstream::client {

// Request ids of a mirror differ from those of the client that it follows.
constexpr std::uint64_t kFirstMirrorId = std::uint64_t{1} << 31;

Client::Client(Hello hello, Kind kind)
    : hello_(std::move(hello)),
      stream_(kind == Kind::mirror),
      requests_(kind == Kind::mirror ? kFirstMirrorId : 0) {
  sendHello();
}

void Client::sendHello() {
  if (stream_.newest().isMirror()) return;
  std::string hello;
  std::string proof;
  if (!credentials_.empty()) writeAuthenticate(proof, requests_.nextId(), credentials_.proof());
  outbox_.setProof(std::move(proof));
  writeHello(hello, requests_.nextId(), hello_);
  outbox_.setHello(std::move(hello));
}

void Client::prove(Proof proof) {
  credentials_.set(std::move(proof));
  if (outbox_.helloWaits()) sendHello();
}

bool Client::renew(std::string_view token) {
  if (state_ != CS_STATE_JOINED || token.empty()) return false;
  std::string message;
  writeAuthenticate(message, requests_.nextId(), credentials_.renew(token));
  send(std::move(message));
  return true;
}

bool Client::offerDatagrams(const cs_datagram_offer& offer) {
  if (!isAllowed(offer) || stream_.newest().isMirror() || state_ == CS_STATE_FAILED || !datagrams_.mayOffer())
    return false;
  const std::uint64_t id = requests_.nextId();
  std::string message;
  writeDatagramOffer(message, id, offer);
  outbox_.setOffer(std::move(message));
  datagrams_.offered(id);
  return true;
}

void Client::want(std::uint32_t finest) {
  hello_.quality = finest;
  if (outbox_.helloWaits()) sendHello();
}

bool Client::resume(std::string_view text) {
  std::optional<ResumeToken> token = readResumeToken(text);
  if (!token && !text.empty()) return false;
  hello_.token = token ? std::move(token->secret) : std::string();
  hello_.attempt = token ? token->attempt + 1 : 1;
  if (outbox_.helloWaits()) sendHello();
  return true;
}

std::string Client::resumeToken() const {
  return welcome_.token.empty() ? std::string() : toText({welcome_.token, hello_.attempt});
}

void Client::connecting(std::uint64_t nowUs) {
  if (state_ == CS_STATE_FAILED) return;
  credentials_.forgetRenewal();
  if (timer_.isWelcomed()) disconnected(nowUs);
  redirection_.attempting();
  datagrams_.connecting();
  outbox_.clear();
  requests_.forget();
  stream_.connecting();
  ++hello_.attempt;
  timer_.connecting(nowUs, std::uint64_t{1000} * welcome_.graceMs);
  sendHello();
}

void Client::disconnected(std::uint64_t nowUs) {
  if (state_ == CS_STATE_FAILED) return;
  if (!welcome_.token.empty()) state_ = CS_STATE_RECONNECTING;
  redirection_.ended();
  datagrams_.disconnected();
  stream_.acknowledgements().connectionEnded();
  outbox_.clear();
  requests_.forget();
  std::uint64_t seed = 0;
  for (const char byte : hello_.token) seed = seed * 257 + static_cast<unsigned char>(byte);
  timer_.lost(nowUs, std::uint64_t{1000} * welcome_.graceMs, seed);
}

std::uint64_t Client::connectAtUs() const {
  return state_ == CS_STATE_FAILED ? Reconnection::kNever : timer_.connectAtUs();
}

std::uint32_t Client::receive(Bytes bytes, std::uint64_t nowUs, const cs_decoded* decoded) {
  if (state_ == CS_STATE_FAILED) return 0;
  const std::optional<ServerMessage> message = readServerMessage(bytes);
  if (!message) return failMalformed("ServerMessage");
  // A frame may have come by datagrams, and then says nothing about the connection. Pongs never do.
  if (message->kind != Body::frame || !datagrams_.serverOpens()) timer_.heard(nowUs);
  switch (message->kind) {
    case Body::welcome:
      return welcomed(message->body, nowUs);
    case Body::chunk:
      return chunkReceived(message->body);
    case Body::frame:
      return frameReceived(message->body, nowUs, decoded);
    case Body::pong:
      return pongReceived(message->body, message->requestId, nowUs);
    case Body::notice:
      return noticeReceived(message->body);
    case Body::parameterChanged:
      return parametersReceived(message->body);
    case Body::error:
      return errorReceived(message->body, message->requestId, nowUs);
    case Body::tickEvents:
      return eventsReceived(message->body);
    case Body::moving:
      return movingReceived(message->body, nowUs);
    case Body::presence:
      return presenceReceived(message->body, nowUs);
    case Body::listScenes:
      return scenesReceived(message->body);
    case Body::playback:
      return playbackReceived(message->body, nowUs);
    case Body::operatingPoint:
      return operatingPointReceived(message->body);
    case Body::authenticate:
      return tokenReceived(message->body);
    case Body::createPairingCode:
      return pairingCodeReceived(message->body);
    case Body::datagramAnswer:
      return datagramAnswerReceived(message->body);
    case Body::roomSurfaces:
      return roomSurfacesReceived(message->body);
    case Body::getSurfacePart:
      return roomSurfaces_.answered(message->requestId, message->body) ? CS_EVENT_SURFACES : 0;
    case Body::getScene:
    case Body::createScene:
    case Body::deleteScene:
    case Body::controlScene:
    case Body::startRecording:
    case Body::stopRecording:
    case Body::listBans:
    case Body::liftBan:
      return answerReceived(*message);
    case Body::none:
      return 0;
  }
  return 0;
}

void Client::update(std::uint64_t nowUs) {
  timer_.update(nowUs);
  requests_.update(nowUs);
  surfaces_.update(nowUs);
  roomSurfaces_.update(nowUs);
  if (stream_.newest().isMirror() || !timer_.isWelcomed() || state_ == CS_STATE_FAILED ||
      !clock_.pingDue(nowUs))
    return;
  std::string ping;
  writePing(ping, requests_.nextId(), nowUs);
  send(std::move(ping));
  clock_.pingSent(nowUs);
}

std::uint32_t Client::welcomed(Bytes body, std::uint64_t nowUs) {
  std::optional<Welcome> welcome = readWelcome(body, limits_);
  if (!welcome) return failMalformed("Welcome");
  if (welcome->participants.size() > limits_.participants)
    return fail("The scene has more than " + std::to_string(limits_.participants) +
                " participants, the limit of this client (cs_limits.max_participants).");
  if (timer_.isWelcomed()) return fail("The server sent Welcome twice.");
  if (welcome->protocolVersion != CS_PROTOCOL_VERSION)
    return fail("The server uses protocol version " + std::to_string(welcome->protocolVersion) +
                "; this client uses version " + std::to_string(CS_PROTOCOL_VERSION) +
                ". Use a client and a server of the same release.");
  if (!codec::isCodec(welcome->codec))
    return fail("The server chose codec " + std::to_string(welcome->codec) + "; this client decodes codec " +
                std::to_string(codec::kCodecHierarchical) + ".");
  const bool returned = state_ == CS_STATE_RECONNECTING;
  // Whether this is the participant of an earlier client (resume).
  const bool inherited = !returned && welcome->resumed && !hello_.token.empty();
  // Whether the server resumed the participant and its description is still the one that this client has.
  const bool known = returned && welcome->resumed && stream_.begun() && hello_.contentId != 0 &&
                     welcome->contentId == hello_.contentId;
  welcome_ = std::move(*welcome);
  resumed_ = inherited || (returned && welcome_.resumed);
  participants_.begin(std::move(welcome_.participants));
  hello_.token = welcome_.token;
  hello_.scene = welcome_.scene;
  hello_.contentId = known ? welcome_.contentId : 0;
  timer_.welcomed(nowUs);
  redirection_.welcomed();
  stream_.welcomed();
  if (returned && !resumed_) clock_ = {};
  // The colliders and grabs of an earlier client end, even if this one has none yet.
  if (inherited || (returned && posed_)) sendPoses(nowUs);
  // A server that has forgotten this participant has given its body back.
  if (returned && worn_ && participants_.bodyOf(welcome_.participantId) != worn_->collider()) sendWearing();
  const std::uint32_t events = (participants_.all().empty() ? 0u : std::uint32_t{CS_EVENT_PARTICIPANTS}) |
                               (roomSurfaces_.forget() ? std::uint32_t{CS_EVENT_SURFACES} : 0u) |
                               sendSurfaces(resumed_);
  if (!known) return events;
  state_ = CS_STATE_JOINED;
  redirection_.joined();
  return events | CS_EVENT_RETURNED;
}

bool Client::maySendSurfaces() const {
  return welcome_.surfacePolicy == CS_SURFACES_OWN ||
         (welcome_.surfacePolicy == CS_SURFACES_EVERYONE && allowedSurfaces_ == CS_SURFACES_EVERYONE);
}

std::uint32_t Client::sendSurfaces(bool mayHaveOthers) {
  if (maySendSurfaces()) {
    surfaces_.sendAll(mayHaveOthers);
    return 0;
  }
  surfaces_.sendNothing(mayHaveOthers && welcome_.surfacePolicy == CS_SURFACES_EVERYONE);
  if (surfaces_.empty()) return 0;
  error_ = {
      .code = 0,
      .text = welcome_.surfacePolicy == CS_SURFACES_OFF
                  ? "The server takes no surfaces of the real room (--room-surfaces off), so that cloth "
                    "passes through yours."
              : welcome_.surfacePolicy == CS_SURFACES_EVERYONE
                  ? "The server sends surfaces of the real room to everyone in the scene (--room-surfaces "
                    "everyone), which the program does not allow, so that cloth passes through yours."
                  : "The server is of a release that knows no surfaces of the real room, so that cloth "
                    "passes through yours. Update the server.",
      .fatal = false,
      .server = {}};
  return CS_EVENT_ERROR;
}

std::uint32_t Client::presenceReceived(Bytes body, std::uint64_t nowUs) {
  std::optional<Presence> presence = readPresence(body);
  if (!presence) return failMalformed("Presence");
  participants_.change(std::move(*presence), limits_.participants);
  const Participant& who = participants_.newest().participant;
  if (who.id == welcome_.participantId && who.role != welcome_.role) {
    // The server drops the surfaces of viewers.
    if (std::exchange(welcome_.role, who.role) == CS_ROLE_VIEWER) sendSurfaces(false);
    if (posed_) sendPoses(nowUs);
  }
  if (who.id == welcome_.participantId && worn_) worn_->announced(who.body);
  if (worn_ && worn_->isLost()) worn_.reset();
  return CS_EVENT_PARTICIPANTS | CS_EVENT_PRESENCE;
}

std::uint32_t Client::chunkReceived(Bytes body) {
  const std::optional<Chunk> chunk = readChunk(body);
  if (!chunk) return failMalformed("Chunk");
  if (!timer_.isWelcomed()) return fail("The server sent a description before its Welcome.");
  auto begun = stream_.add(*chunk, limits_, resumed_);
  if (!begun) return fail(std::move(begun.error()));
  return *begun ? described() : 0;
}

std::uint32_t Client::described() {
  display_.begin(stream_.description());
  checkWorn();
  hello_.contentId = welcome_.contentId;
  const bool returned = state_ == CS_STATE_RECONNECTING;
  state_ = CS_STATE_JOINED;
  redirection_.joined();
  return returned ? CS_EVENT_DESCRIPTION | CS_EVENT_RETURNED : CS_EVENT_DESCRIPTION;
}

std::uint32_t Client::frameReceived(Bytes body, std::uint64_t nowUs, const cs_decoded* decoded) {
  if (state_ != CS_STATE_JOINED) return fail("The server sent a frame before the description.");
  const auto received = stream_.receive(body, decoded, nowUs);
  if (!received) return failMalformed(received.error());
  if (received->needsKeyFrame) requestKeyFrame(nowUs);
  if (!received->isNew) return 0;
  const std::uint64_t tick = stream_.newest().tick();
  const bool isMirror = stream_.newest().isMirror();
  if (!isMirror && stream_.acknowledgements().decoded(tick, inLockstep(), nowUs)) outbox_.setAck(tick);
  stream_.measure(clock_, nowUs);
  if (display_.playsOut()) {
    const auto decodeUs = static_cast<std::uint64_t>(1000 * stream_.newest().decodeMs());
    display_.add(stream_.displayable(received->isKey),
                 clock_.known() ? clock_.serverTimeUs(nowUs) + decodeUs : 0);
  }
  return received->hasReport ? CS_EVENT_FRAME | CS_EVENT_REPORT : CS_EVENT_FRAME;
}

void Client::acknowledgeSeen() {
  if (const auto tick = stream_.acknowledgements().seen()) outbox_.setAck(*tick);
}

void Client::requestKeyFrame(std::uint64_t nowUs, bool early) {
  // In lockstep the server waits for an answer to each frame: an acknowledgement or this request.
  if (!stream_.takeKeyFrameRequest(nowUs, !early && inLockstep())) return;
  std::string request;
  writeKeyFrameRequest(request, stream_.description().layout.epoch, early);
  send(std::move(request));
}

std::uint32_t Client::pongReceived(Bytes body, std::uint64_t requestId, std::uint64_t nowUs) {
  const std::optional<Pong> pong = readPong(body);
  if (!pong) return failMalformed("Pong");
  if (pong->clientTimeUs == 0) {  // the ping was part of an upload
    requests_.uploadPongReceived(requestId);
    return 0;
  }
  if (stream_.newest().isMirror()) clock_.pingSent(pong->clientTimeUs);
  clock_.pongReceived(*pong, nowUs);
  return 0;
}

std::uint32_t Client::eventsReceived(Bytes body) {
  TickEvents events;
  if (!readTickEvents(body, events)) return failMalformed("TickEvents");
  std::uint32_t changed = 0;
  if (!events.grabs.empty()) {
    events_.grabs = std::move(events.grabs);
    changed |= CS_EVENT_GRABS;
  }
  if (!events.contacts.empty()) {
    events_.contacts = std::move(events.contacts);
    changed |= CS_EVENT_CONTACTS;
  }
  return changed;
}

std::uint32_t Client::noticeReceived(Bytes body) {
  std::optional<Notice> notice = readNotice(body);
  if (!notice) return failMalformed("Notice");
  notice_ = std::move(*notice);
  return CS_EVENT_NOTICE;
}

std::uint32_t Client::parametersReceived(Bytes body) {
  const std::optional<ParameterChange> change = readParameterChanged(body);
  if (!change) return failMalformed("ParameterChanged");
  stream_.apply(*change);
  parametersParticipant_ = change->participantId;
  return CS_EVENT_PARAMETERS;
}

std::uint32_t Client::errorReceived(Bytes body, std::uint64_t requestId, std::uint64_t nowUs) {
  std::optional<ServerError> error = readError(body);
  if (!error) return failMalformed("Error");
  if (!error->fatal) {
    if (requestId != 0 && requestId == wearRequest_) wearingRefused();
    if (datagrams_.refused(requestId)) return CS_EVENT_DATAGRAMS;
    // Pieces that were under way when the server refused an upload are refused as well.
    if (requests_.isOfEndedUpload(requestId)) return 0;
    if (roomSurfaces_.refused(requestId, error->code == field::ErrorCode::kRateLimited)) return 0;
    if (requests_.refused(requestId, *error) == Requests::Outcome::answered) return CS_EVENT_ANSWER;
  }
  if (!error->fatal ||
      (error->code != field::ErrorCode::kNotFound && error->code != field::ErrorCode::kCutOff))
    error->server.clear();
  // A server that cuts off and names itself wants the client to come back.
  const bool names = redirection_.isEnabled() && !error->server.empty() &&
                     (error->code == field::ErrorCode::kNotFound || error->server != connectServer());
  const bool isRedirect = names && redirection_.follow(error->server, nowUs);
  if (error->fatal && !isRedirect && (names || !isTemporary(*error))) fail({});
  error_ = std::move(*error);
  return isRedirect ? 0 : CS_EVENT_ERROR;
}

std::uint32_t Client::movingReceived(Bytes body, std::uint64_t nowUs) {
  std::optional<std::string> server = readMoving(body);
  if (!server) return failMalformed("Moving");
  return redirection_.announce(std::move(*server), nowUs) ? CS_EVENT_MOVING : 0;
}

bool Client::isTemporary(const ServerError& error) const {
  using Code = field::ErrorCode;
  const bool reconnects = state_ == CS_STATE_RECONNECTING && !timer_.isWelcomed();
  // The client may try again if only the connection was cut off, or if a reconnect found the server full. It
  // also may if it has returned to its first server, and another one was named.
  return error.code == Code::kCutOff || (reconnects && error.code == Code::kResourceExhausted) ||
         (reconnects && error.code == Code::kNotFound && redirection_.isReturn());
}

std::uint32_t Client::scenesReceived(Bytes body) {
  auto scenes = readScenes(body);
  if (!scenes) return failMalformed("ListScenesResponse");
  scenes_ = std::move(*scenes);
  return CS_EVENT_SCENES;
}

std::uint32_t Client::tokenReceived(Bytes body) {
  std::optional<std::string> token = readToken(body);
  if (!token) return failMalformed("AuthenticateResponse");
  const std::uint32_t events = token->empty() ? 0 : CS_EVENT_TOKEN;
  credentials_.accepted(std::move(*token));
  return events;
}

std::uint32_t Client::pairingCodeReceived(Bytes body) {
  std::optional<PairingCode> made = readPairingCode(body);
  if (!made) return failMalformed("CreatePairingCodeResponse");
  pairingCode_ = std::move(*made);
  return CS_EVENT_PAIRING_CODE;
}

std::uint32_t Client::operatingPointReceived(Bytes body) {
  const std::optional<std::uint32_t> quality = readOperatingPoint(body);
  if (!quality) return failMalformed("OperatingPoint");
  stream_.operatingPoint(*quality);
  return 0;
}

std::uint32_t Client::datagramAnswerReceived(Bytes body) {
  std::optional<DatagramAnswer> answer = readDatagramAnswer(body);
  if (!answer) return failMalformed("DatagramAnswer");
  return datagrams_.answered(std::move(*answer)) ? CS_EVENT_DATAGRAMS : 0;
}

std::uint32_t Client::roomSurfacesReceived(Bytes body) {
  const std::optional<std::vector<RoomSurfaceEntry>> entries = readRoomSurfaces(body);
  if (!entries) return failMalformed("RoomSurfaces");
  return roomSurfaces_.listed(*entries, welcome_.participantId) ? CS_EVENT_SURFACES : 0;
}

std::uint32_t Client::playbackReceived(Bytes body, std::uint64_t nowUs) {
  const std::optional<cs_playback> playback = readPlayback(body);
  if (!playback) return failMalformed("Playback");
  playback_.told(*playback, nowUs);
  return CS_EVENT_PLAYBACK;
}

std::uint32_t Client::answerReceived(const ServerMessage& message) {
  switch (requests_.answered(message)) {
    case Requests::Outcome::unknown:
      return 0;
    case Requests::Outcome::malformed:
      return failMalformed("answer");
    case Requests::Outcome::answered:
      return CS_EVENT_ANSWER;
  }
  return 0;
}

const std::string* Client::nextOutgoing() {
  const std::string* message = outbox_.next();
  if (!message && isConnected()) message = requests_.nextOfUpload();
  if (!message && timer_.isWelcomed() && mayCollide()) message = surfaces_.next();
  if (!message && timer_.isWelcomed()) message = roomSurfaces_.next(requests_.lastId());
  // Attachments and joints stay where they were moved, so each pose is sent once.
  if (outbox_.poses().empty() && isConnected() && mayCollide()) {
    poses_.attachments.clear();
    poses_.joints.clear();
  }
  return message;
}

std::span<const float> Client::playedPositions() const {
  return display_.shows() ? display_.positions() : stream_.positions();
}

std::span<const float> Client::playedNormals() const {
  return display_.shows() ? display_.normals(stream_.description().layout) : stream_.normals();
}

const std::vector<Collider>& Client::playedColliders() const {
  return display_.shows() ? display_.colliders() : colliders();
}

std::uint64_t Client::shownTick() const {
  if (display_.playsOut()) return display_.shows() ? display_.tick() : 0;
  return stream_.newest().present() ? stream_.newest().tick() : 0;
}

cs_stage_statistics Client::stages() const {
  cs_stage_statistics stages = stream_.stages();
  display_.report(stages);
  return stages;
}

std::uint32_t Client::fail(std::string text, std::uint32_t code) {
  state_ = CS_STATE_FAILED;
  error_ = {.code = code, .text = std::move(text), .fatal = true, .server = {}};
  outbox_.clear();
  requests_.forget();
  return CS_EVENT_ERROR;
}

std::uint32_t Client::failMalformed(const char* what) {
  return fail(std::string("The server sent a malformed ") + what +
              ". Check that the address is a clothstream-server of the same release.");
}

void Client::send(std::string message) {
  if (state_ == CS_STATE_FAILED || !isConnected()) return;
  if (!outbox_.addControl(std::move(message)))
    fail("The connection sends no messages: " + std::to_string(Outbox::kMaxControl) + " are waiting.");
}

}  // namespace clothstream::client

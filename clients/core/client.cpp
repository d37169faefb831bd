// SPDX-License-Identifier: MIT
// The state machine: connection and messages of the server.
#include "clients/core/client.h"

#include <algorithm>
#include <span>
#include <utility>

#include "clients/core/stream/resume_token.h"
#include "clients/core/wire/description.h"
#include "proto/codec/packet_header.h"

namespace clothstream::client {

// Request ids of a mirror differ from those of the client that it follows.
constexpr std::uint64_t kFirstMirrorId = std::uint64_t{1} << 31;

namespace {

// True if the named constraints are between vertices of their cloths.
bool namesVertices(const SimulationReport& report, std::span<const codec::ClothLayout> cloths) {
  for (std::size_t i = 0; i < report.cloths.size(); ++i) {
    const std::vector<std::uint32_t>& ends = report.cloths[i].constraintEnds;
    const std::uint32_t vertices = i < cloths.size() ? cloths[i].vertexCount : 0;
    if (ends.size() % 2 != 0 ||
        std::any_of(ends.begin(), ends.end(), [&](auto end) { return end >= vertices; }))
      return false;
  }
  return true;
}

}  // namespace

Client::Client(Hello hello, Kind kind)
    : kind_(kind),
      hello_(std::move(hello)),
      newest_(kind == Kind::mirror),
      lastRequestId_(kind == Kind::mirror ? kFirstMirrorId : 0) {
  sendHello();
}

void Client::sendHello() {
  if (kind_ == Kind::mirror) return;
  std::string hello;
  std::string proof;
  if (!proof_.token.empty() || !proof_.pairingCode.empty())
    writeAuthenticate(proof, ++lastRequestId_, proof_);
  outbox_.setProof(std::move(proof));
  writeHello(hello, ++lastRequestId_, hello_);
  outbox_.setHello(std::move(hello));
}

void Client::prove(Proof proof) {
  proof_ = std::move(proof);
  if (outbox_.helloWaits()) sendHello();
}

bool Client::renew(std::string_view token) {
  if (state_ != CS_STATE_JOINED || token.empty()) return false;
  renewing_ = {.token = std::string(token), .pairingCode = {}};
  std::string message;
  writeAuthenticate(message, ++lastRequestId_, renewing_);
  send(std::move(message));
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
  renewing_ = {};
  if (welcomed_) disconnected(nowUs);
  redirection_.attempting();
  outbox_.clear();
  forgetRequests();
  assembly_ = {};
  keyFrameRequest_ = {};
  nextServer_.clear();
  ++hello_.attempt;
  connectAtUs_ = reconnection_.attemptEnd(nowUs, std::uint64_t{1000} * welcome_.graceMs);
  sendHello();
}

void Client::disconnected(std::uint64_t nowUs) {
  if (state_ == CS_STATE_FAILED) return;
  if (!welcome_.token.empty()) state_ = CS_STATE_RECONNECTING;
  welcomed_ = false;
  redirection_.ended();
  unseenTick_.reset();
  outbox_.clear();
  forgetRequests();
  std::uint64_t seed = 0;
  for (const char byte : hello_.token) seed = seed * 257 + static_cast<unsigned char>(byte);
  connectAtUs_ = reconnection_.lost(nowUs, std::uint64_t{1000} * welcome_.graceMs, seed);
}

std::uint64_t Client::connectAtUs() const {
  if (state_ == CS_STATE_FAILED) return Reconnection::kNever;
  return welcomed_ ? lastHeardUs_ + Reconnection::kSilenceUs : connectAtUs_;
}

std::uint32_t Client::receive(Bytes bytes, std::uint64_t nowUs, const cs_decoded* decoded) {
  if (state_ == CS_STATE_FAILED) return 0;
  const std::optional<ServerMessage> message = readServerMessage(bytes);
  if (!message) return failMalformed("ServerMessage");
  lastHeardUs_ = nowUs;
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
  // A long pause between two updates does not count as silence: messages that arrived meanwhile are not read
  // yet.
  const std::uint64_t pauseUs = nowUs - std::exchange(updatedUs_, nowUs);
  if (pauseUs > Reconnection::kLongestStepUs)
    lastHeardUs_ = std::min(nowUs, lastHeardUs_ + pauseUs - Reconnection::kLongestStepUs);
  upload_.update(nowUs);
  if (kind_ == Kind::mirror || !welcomed_ || state_ == CS_STATE_FAILED || !clock_.pingDue(nowUs)) return;
  std::string ping;
  writePing(ping, ++lastRequestId_, nowUs);
  send(std::move(ping));
  clock_.pingSent(nowUs);
}

std::uint32_t Client::welcomed(Bytes body, std::uint64_t nowUs) {
  std::optional<Welcome> welcome = readWelcome(body, limits_);
  if (!welcome) return failMalformed("Welcome");
  if (welcome->participants.size() > limits_.participants)
    return fail("The scene has more than " + std::to_string(limits_.participants) +
                " participants, the limit of this client (cs_limits.max_participants).");
  if (welcomed_) return fail("The server sent Welcome twice.");
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
  const bool known = returned && welcome->resumed && described() && hello_.contentId != 0 &&
                     welcome->contentId == hello_.contentId;
  welcome_ = std::move(*welcome);
  welcomed_ = true;
  resumed_ = inherited || (returned && welcome_.resumed);
  participants_ = std::move(welcome_.participants);
  hello_.token = welcome_.token;
  hello_.scene = welcome_.scene;
  hello_.contentId = known ? welcome_.contentId : 0;
  reconnection_.joined(nowUs);
  redirection_.welcomed();
  quality_ = 0;
  frameDivisor_ = 1;
  acknowledgement_ = {};
  if (returned && !resumed_) clock_ = {};
  // The colliders and grabs of an earlier client end, even if this one has none yet.
  if (inherited || (returned && posed_)) sendPoses(nowUs);
  const std::uint32_t events = participants_.empty() ? 0 : CS_EVENT_PARTICIPANTS;
  if (!known) return events;
  state_ = CS_STATE_JOINED;
  redirection_.joined();
  return events | CS_EVENT_RETURNED;
}

std::uint32_t Client::presenceReceived(Bytes body, std::uint64_t nowUs) {
  std::optional<Presence> presence = readPresence(body);
  if (!presence) return failMalformed("Presence");
  presence_ = std::move(*presence);
  const Participant& who = presence_.participant;
  const auto known = std::find_if(participants_.begin(), participants_.end(),
                                  [&](const Participant& one) { return one.id == who.id; });
  if (presence_.kind == CS_PRESENCE_LEFT) {
    if (known != participants_.end()) participants_.erase(known);
  } else if (known != participants_.end()) {
    *known = who;
  } else if (participants_.size() < limits_.participants) {
    participants_.push_back(who);
  }
  if (who.id == welcome_.participantId && who.role != welcome_.role) {
    welcome_.role = who.role;
    if (posed_) sendPoses(nowUs);
  }
  return CS_EVENT_PARTICIPANTS | CS_EVENT_PRESENCE;
}

std::uint32_t Client::chunkReceived(Bytes body) {
  const std::optional<Chunk> chunk = readChunk(body);
  if (!chunk) return failMalformed("Chunk");
  if (!welcomed_) return fail("The server sent a description before its Welcome.");
  auto content = assembly_.add(*chunk, limits_.contentBytes);
  if (!content) return fail("The server sent a wrong description: " + content.error() + ".");
  if (!*content) return 0;
  return described(**content);
}

std::uint32_t Client::described(Bytes content) {
  auto description = readDescription(content, limits_);
  if (!description)
    return fail("The server's description of the scene is wrong: " + description.error() + ".");
  if (!newest_.begin(description->layout))
    return fail("The server's description of the scene is wrong: its layout is not possible.");
  description_ = std::move(*description);
  keyFrameRequest_.answered();
  // After a resume the ticks continue, so frames missed during the outage count as dropped.
  if (!resumed_) statistics_.forgetTicks();
  report_ = {};
  if (playOut_) playOut_->begin(description_);
  if (contact_) contact_->begin(description_);
  shown_ = {};
  hello_.contentId = welcome_.contentId;
  const bool returned = state_ == CS_STATE_RECONNECTING;
  state_ = CS_STATE_JOINED;
  redirection_.joined();
  return returned ? CS_EVENT_DESCRIPTION | CS_EVENT_RETURNED : CS_EVENT_DESCRIPTION;
}

std::uint32_t Client::frameReceived(Bytes body, std::uint64_t nowUs, const cs_decoded* decoded) {
  if (!readFrame(body, frame_)) return failMalformed("Frame");
  if (state_ != CS_STATE_JOINED) return fail("The server sent a frame before the description.");
  description_.colliders.resize(frame_.colliders.size());
  for (std::size_t i = 0; i < frame_.colliders.size(); ++i) {
    if (!readCollider(frame_.colliders[i], description_.colliders[i])) return failMalformed("ColliderState");
  }
  const std::uint32_t events = packetReceived(nowUs, decoded);
  if (!frame_.report || (events & CS_EVENT_FRAME) == 0) return events;
  if (!readReport(*frame_.report, report_) || !namesVertices(report_, description_.layout.cloths))
    return failMalformed("SimulationReport");
  reportTick_ = newest_.tick();
  return events | CS_EVENT_REPORT;
}

std::uint32_t Client::packetReceived(std::uint64_t nowUs, const cs_decoded* given) {
  const auto packet = std::as_bytes(std::span(frame_.packet.data(), frame_.packet.size()));
  const auto parsed = codec::parsePacket(packet);
  // Frames that the server omits are not lost. At a change of the divisor, the larger distance between frames
  // counts.
  statistics_.arrived(parsed ? std::optional(parsed->header.tick) : std::nullopt, packet.size(),
                      description_.ticksPerFrame() * std::max(frameDivisor_, frame_.divisor), nowUs);
  frameDivisor_ = frame_.divisor;
  const bool isMirror = kind_ == Kind::mirror;
  const cs_decoding decoding = !isMirror ? decode(packet)
                               : parsed  ? newest_.take(given, parsed->header.tick)
                                         : CS_DECODING_REFUSED;
  if (decoding == CS_DECODING_SKIPPED) return 0;
  if (decoding == CS_DECODING_REFUSED) {
    statistics_.refused();
    if (!isMirror) requestKeyFrame(nowUs);
    return 0;
  }
  if (isMirror) decodeMs_ = given->decode_ms;
  const DecodedFrame decoded{
      .tick = newest_.tick(),
      .key = parsed->header.kind == codec::PacketKind::key,
      .hashMatches = newest_.hash() == frame_.reconstructionHash,
      .vertexCount = description_.layout.vertexCount(),
      .packetBytes = packet.size(),
  };
  statistics_.decoded(decoded, nowUs);
  if (decoded.key) keyFrameRequest_.answered();
  // A key frame makes the client's state equal to the server's again.
  if (!isMirror && !decoded.hashMatches) requestKeyFrame(nowUs);
  if (!isMirror) acknowledge(decoded.tick, nowUs);
  timeFrame(decoded.key, nowUs);
  return CS_EVENT_FRAME;
}

void Client::acknowledge(std::uint64_t tick, std::uint64_t nowUs) {
  if (inLockstep() && holdsAcknowledgements_)
    unseenTick_ = tick;
  else if (inLockstep() || acknowledgement_.due(nowUs))
    outbox_.setAck(tick);
}

void Client::acknowledgeSeen() {
  if (const auto tick = std::exchange(unseenTick_, std::nullopt)) outbox_.setAck(*tick);
}

void Client::timeFrame(bool key, std::uint64_t nowUs) {
  const std::uint64_t arrivedUs = clock_.serverTimeUs(nowUs);
  stages_ = {};
  if (clock_.known()) {
    stages_.server_ms = since(frame_.tickTimeUs, frame_.packetTimeUs) / 1000;
    stages_.network_ms = since(frame_.packetTimeUs, arrivedUs) / 1000;
    stages_.displayable_ms = since(frame_.tickTimeUs, arrivedUs) / 1000 + decodeMs_;
  }
  if (!playOut_) return;
  const bool sendsNormals = description_.layout.normals != codec::NormalMode::none;
  const auto decodeUs = static_cast<std::uint64_t>(1000 * decodeMs_);
  playOut_->add({.tick = newest_.tick(),
                 .timeUs = frame_.tickTimeUs,
                 .key = key,
                 .positions = newest_.positions(),
                 .normals = sendsNormals ? newest_.normals() : std::span<const float>(),
                 .colliders = description_.colliders},
                clock_.known() ? arrivedUs + decodeUs : 0);
}

cs_decoding Client::decode(std::span<const std::byte> packet) {
  if (!nowUs_) return newest_.decode(packet);
  const std::uint64_t start = nowUs_();
  const cs_decoding result = newest_.decode(packet);
  decodeMs_ = static_cast<double>(nowUs_() - start) / 1000;
  return result;
}

void Client::requestKeyFrame(std::uint64_t nowUs, bool early) {
  // In lockstep the server waits for an answer to each frame: an acknowledgement or this request.
  if (!keyFrameRequest_.wanted(nowUs) && (early || !inLockstep())) return;
  std::string request;
  writeKeyFrameRequest(request, description_.layout.epoch, early);
  send(std::move(request));
}

std::uint32_t Client::pongReceived(Bytes body, std::uint64_t requestId, std::uint64_t nowUs) {
  const std::optional<Pong> pong = readPong(body);
  if (!pong) return failMalformed("Pong");
  if (pong->clientTimeUs == 0) {  // the ping was part of an upload
    upload_.pongReceived(requestId);
    return 0;
  }
  if (kind_ == Kind::mirror) clock_.pingSent(pong->clientTimeUs);
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
  apply(*change, description_);
  parametersParticipant_ = change->participantId;
  return CS_EVENT_PARAMETERS;
}

std::uint32_t Client::errorReceived(Bytes body, std::uint64_t requestId, std::uint64_t nowUs) {
  std::optional<ServerError> error = readError(body);
  if (!error) return failMalformed("Error");
  if (!error->fatal) {
    // Pieces that were under way when the server refused an upload are refused as well.
    if (requestId != 0 && requestId == endedUploadId_) return 0;
    if (const std::optional<cs_request> request = requests_.take(requestId)) {
      if (requestId == upload_.requestId()) {
        endedUploadId_ = requestId;
        upload_.end();
      }
      answer_ = {.requestId = requestId,
                 .request = *request,
                 .error = error->code,
                 .errorText = std::move(error->text),
                 .name = {},
                 .bytes = 0,
                 .repairs = {}};
      return CS_EVENT_ANSWER;
    }
  }
  if (!error->fatal ||
      (error->code != field::ErrorCode::kNotFound && error->code != field::ErrorCode::kCutOff))
    error->server.clear();
  // A server that cuts off and names itself wants the client to come back.
  const bool names = follows_ && !error->server.empty() &&
                     (error->code == field::ErrorCode::kNotFound || error->server != connectServer());
  const bool isRedirect = names && redirection_.follow(error->server, nowUs);
  if (error->fatal && !isRedirect && (names || !isTemporary(*error))) fail({});
  errorCode_ = error->code;
  errorText_ = std::move(error->text);
  errorServer_ = std::move(error->server);
  return isRedirect ? 0 : CS_EVENT_ERROR;
}

std::uint32_t Client::movingReceived(Bytes body, std::uint64_t nowUs) {
  std::optional<std::string> server = readMoving(body);
  if (!server) return failMalformed("Moving");
  if (!follows_ || server->empty() || !redirection_.announce(*server, nowUs)) return 0;
  nextServer_ = std::move(*server);
  return CS_EVENT_MOVING;
}

bool Client::isTemporary(const ServerError& error) const {
  using Code = field::ErrorCode;
  const bool reconnects = state_ == CS_STATE_RECONNECTING && !welcomed_;
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
  if (!renewing_.token.empty()) proof_ = std::exchange(renewing_, {});
  if (token->empty()) return 0;
  // The code has been used; the next connection needs the token.
  proof_ = {.token = std::move(*token), .pairingCode = {}};
  return CS_EVENT_TOKEN;
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
  quality_ = *quality;
  return 0;
}

std::uint32_t Client::playbackReceived(Bytes body, std::uint64_t nowUs) {
  const std::optional<cs_playback> playback = readPlayback(body);
  if (!playback) return failMalformed("Playback");
  playback_ = playback;
  playbackUs_ = nowUs;
  return CS_EVENT_PLAYBACK;
}

std::optional<cs_playback> Client::playback(std::uint64_t nowUs) const {
  if (!playback_ || playback_->paused != 0 || nowUs < playbackUs_) return playback_;
  cs_playback now = *playback_;
  now.position =
      std::min(now.length, now.position + static_cast<double>(nowUs - playbackUs_) * 1e-6 * now.speed);
  return now;
}

const std::string* Client::nextOutgoing() {
  const std::string* message = outbox_.next();
  if (!message && isConnected()) message = upload_.next(lastRequestId_);
  // Attachments and joints stay where they were moved, so each pose is sent once.
  if (outbox_.poses().empty() && isConnected() && mayCollide()) {
    poses_.attachments.clear();
    poses_.joints.clear();
  }
  return message;
}

std::span<const float> Client::positions() const {
  if (newest_.present()) return newest_.positions();
  return description_.restPositions;
}

std::span<const float> Client::normals() const {
  if (newest_.present()) return newest_.normals();
  return description_.restNormals;
}

std::span<const float> Client::playedPositions() const {
  if (!shown_.empty()) return shown_;
  return playOut_ && playOut_->shows() ? playOut_->positions() : positions();
}

std::span<const float> Client::playedNormals() const {
  if (!shown_.empty()) return contact_->normals(description_.layout);
  return playOut_ && playOut_->shows() ? playOut_->normals(description_.layout) : normals();
}

std::uint64_t Client::shownTick() const {
  if (playOut_) return playOut_->shows() ? playedTick_ : 0;
  return newest_.present() ? newest_.tick() : 0;
}

const std::vector<Collider>& Client::playedColliders() const {
  return playOut_ && playOut_->shows() ? playOut_->colliders() : colliders();
}

cs_stage_statistics Client::stages() const {
  cs_stage_statistics stages = stages_;
  stages.decode_ms = decodeMs_;
  if (playOut_) playOut_->report(stages);
  return stages;
}

std::uint64_t Client::reconstructionHash() const {
  return newest_.present() ? newest_.hash() : 0;
}

std::uint32_t Client::fail(std::string text, std::uint32_t code) {
  state_ = CS_STATE_FAILED;
  errorCode_ = code;
  errorText_ = std::move(text);
  errorServer_.clear();
  outbox_.clear();
  forgetRequests();
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

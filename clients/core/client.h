// SPDX-License-Identifier: MIT
// The state machine of a client: joining, description, frames, reconnecting. The contract is in core.h.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/core/body/worn_body.h"
#include "clients/core/core.h"
#include "clients/core/display.h"
#include "clients/core/stream/connection_timer.h"
#include "clients/core/stream/credentials.h"
#include "clients/core/stream/datagram_negotiation.h"
#include "clients/core/stream/outbox.h"
#include "clients/core/stream/own_surfaces.h"
#include "clients/core/stream/participants.h"
#include "clients/core/stream/playback_position.h"
#include "clients/core/stream/received_stream.h"
#include "clients/core/stream/redirection.h"
#include "clients/core/stream/requests.h"
#include "clients/core/stream/room_surfaces.h"
#include "clients/core/stream/server_clock.h"
#include "clients/core/wire/client_message.h"
#include "clients/core/wire/limits.h"
#include "clients/core/wire/server_message.h"

namespace clothstream::client {

class Client {
 public:
  enum class Kind { whole, mirror };
  explicit Client(Hello hello, Kind kind = Kind::whole);

  // Returns a set of CS_EVENT bits. A mirror needs what the other client decoded.
  std::uint32_t receive(Bytes message, std::uint64_t nowUs, const cs_decoded* decoded = nullptr);
  void update(std::uint64_t nowUs);
  void connecting(std::uint64_t nowUs);
  void disconnected(std::uint64_t nowUs);
  std::uint64_t connectAtUs() const;
  // DNS name for the next connection. Empty: the address that the program was given.
  const std::string& connectServer() const { return redirection_.server(); }
  const std::string& nextServer() const { return redirection_.next(); }
  const std::string* nextOutgoing();

  // Used from the next connection on; also for the current one while its Hello waits. A token replaces a
  // pairing code.
  void prove(Proof proof);
  // Returns false before the client has joined, and for an empty token.
  bool renew(std::string_view token);
  // Returns false if the text is neither empty nor one of resumeToken().
  bool resume(std::string_view text);
  // Whether the program opens connections at connectServer().
  void followRedirects(bool on) { redirection_.enable(on); }
  // Returns false if the offer is not allowed, or cannot be made now.
  bool offerDatagrams(const cs_datagram_offer& offer);
  // Has no effect on the current connection if its Hello is sent already.
  void want(std::uint32_t finest);

  void setLimits(const Limits& limits) { limits_ = limits; }
  void setClock(std::uint64_t (*nowUs)()) { stream_.setClock(nowUs); }
  void setColliders(std::span<const cs_own_collider> colliders, std::uint64_t nowUs);
  // Four numbers per joint: {x, y, z, radius}. Empty removes the hand.
  void setHand(std::uint32_t side, std::span<const float> joints, std::uint64_t nowUs);
  void setHead(const std::optional<cs_own_collider>& head, std::uint64_t nowUs);
  void setGrabs(std::span<const cs_grab> grabs, std::uint64_t nowUs);
  void setWinds(std::span<const cs_own_wind> winds, std::uint64_t nowUs);
  // Among the positions that are shown.
  std::optional<cs_cloth_point> nearestPoint(const Vec3& point, float maxDistance) const;
  std::optional<cs_cloth_point> castRay(const Vec3& origin, const Vec3& direction, float maxDistance) const;
  void wantContacts(bool wants, std::uint64_t nowUs);
  void wantConstraints(bool wants, std::uint64_t nowUs);
  void move(AttachmentPose attachment, std::uint64_t nowUs);
  void move(ColliderJoints joints, std::uint64_t nowUs);
  // Takes the collider with this name as the own body, or gives the own one back for an empty name. Returns
  // false if it is not a human body.
  bool wear(std::string_view collider);
  // Returns false without a body.
  bool moveBody(const body::Tracked& tracked, std::uint64_t nowUs);
  // Returns false if the server of the scene takes no surfaces.
  bool setSurface(OwnSurface surface);
  OwnSurfaces& surfaces() { return surfaces_; }
  // Sets the widest policy under which surfaces are sent.
  void allowSurfaces(std::uint32_t policy);
  void followSurfaces(bool on) { roomSurfaces_.follow(on); }
  const RoomSurfaces& roomSurfaces() const { return roomSurfaces_; }
  void change(const ParameterChange& change);
  void changeCollider(std::string_view collider, const cs_collider_change& change);
  void listScenes();
  void setRole(std::uint64_t participant, std::uint32_t role);
  void remove(std::uint64_t participant, bool ban);
  void createPairingCode(std::uint32_t role);
  void control(const SceneControl& control);
  // Requests about scenes return their id, or 0 if they cannot be sent. An empty scene is the joined one.
  std::uint64_t createScene(std::string_view scene, std::string_view name, std::uint32_t maxParticipants);
  std::uint64_t copyScene(std::string_view source, std::string_view name, std::uint32_t maxParticipants);
  std::uint64_t deleteScene(std::string_view scene);
  std::uint64_t controlScene(std::string_view scene, const SceneControl& control);
  std::uint64_t startRecording(std::string_view scene, std::string_view file);
  std::uint64_t stopRecording(std::string_view scene);
  std::uint64_t requestDefinition(std::string_view scene);
  std::uint64_t listBans(std::string_view scene);
  std::uint64_t liftBan(std::string_view scene, std::string_view subject);
  void requestEarlyKeyFrame(std::uint64_t nowUs);
  // Whether the server plays a recording in lockstep.
  bool inLockstep() const { return welcome_.acknowledgeEveryFrame; }
  // In lockstep, frames are then acknowledged by acknowledgeSeen() only.
  void holdAcknowledgements(bool on) { stream_.acknowledgements().hold(on); }
  void acknowledgeSeen();
  // nullptr turns play-out off. Returns false if the options are not allowed.
  bool setPlayOut(const cs_play_out_options* options);
  void setLocalContact(bool on);
  // Length of the largest correction of the last play(), m.
  float largestCorrection() const { return display_.largestCorrection(); }
  // nullopt if play-out is off.
  std::optional<cs_played> play(std::uint64_t nowUs, std::uint64_t displayUs);

  cs_state state() const { return state_; }
  // The newest error of the server or of the client; its code is 0 if the client found it.
  const ServerError& error() const { return error_; }
  const Notice& notice() const { return notice_; }
  // Token given, or received after pairing.
  const std::string& token() const { return credentials_.proof().token; }
  const PairingCode& pairingCode() const { return pairingCode_; }
  bool resumed() const { return resumed_; }
  // Empty before the first Welcome.
  std::string resumeToken() const;
  // The answer to the newest offer on the present connection.
  const std::optional<DatagramAnswer>& datagramAnswer() const { return datagrams_.answer(); }
  const Participants& participants() const { return participants_; }
  const Welcome& welcome() const { return welcome_; }
  const ReceivedStream& stream() const { return stream_; }
  const ServerClock& clock() const { return clock_; }
  // State of the recording at this time.
  std::optional<cs_playback> playback(std::uint64_t nowUs) const { return playback_.at(nowUs); }
  const std::vector<SceneSummary>& scenes() const { return scenes_; }
  const Requests& requests() const { return requests_; }

  // Result of the last play(). While play-out shows no frame: that of stream().
  std::span<const float> playedPositions() const;
  std::span<const float> playedNormals() const;
  const std::vector<Collider>& playedColliders() const;
  cs_stage_statistics stages() const;
  std::uint64_t parametersParticipant() const { return parametersParticipant_; }
  const std::vector<cs_grab_event>& grabEvents() const { return events_.grabs; }
  const std::vector<ContactEvent>& contactEvents() const { return events_.contacts; }
  const std::vector<Collider>& colliders() const { return stream_.description().colliders; }
  // nullptr if this client wears no body.
  const body::WornBody* worn() const { return worn_ ? &*worn_ : nullptr; }

 private:
  // Skeleton of the collider of the scene with this name; nullopt if it is not a human body.
  std::optional<body::Humanoid> humanoidOf(std::string_view collider) const;
  void sendWearing();
  // The participant keeps the body that it had before.
  void wearingRefused();
  // Drops the own body if the server has given it back, or the description does not have it any more.
  void checkWorn();
  void sendPoses(std::uint64_t nowUs);
  // Tick of the frame that is shown; 0 before the first.
  std::uint64_t shownTick() const;
  std::optional<cs_cloth_point> seen(std::optional<cs_cloth_point> point) const;
  void sendHello();
  bool isConnected() const { return state_ != CS_STATE_RECONNECTING || timer_.isWelcomed(); }
  bool mayCollide() const;
  std::uint32_t welcomed(Bytes body, std::uint64_t nowUs);
  // Whether the policy of the server permits surfaces, and goes no further than the program allows.
  bool maySendSurfaces() const;
  // Sends surfaces of the real room if it may. Returns CS_EVENT_ERROR if there are some and it may not.
  // `mayHaveOthers`: OwnSurfaces::sendAll().
  std::uint32_t sendSurfaces(bool mayHaveOthers);
  std::uint32_t roomSurfacesReceived(Bytes body);
  std::uint32_t presenceReceived(Bytes body, std::uint64_t nowUs);
  std::uint32_t chunkReceived(Bytes body);
  std::uint32_t described();
  std::uint32_t frameReceived(Bytes body, std::uint64_t nowUs, const cs_decoded* decoded);
  void requestKeyFrame(std::uint64_t nowUs, bool early = false);
  std::uint32_t pongReceived(Bytes body, std::uint64_t requestId, std::uint64_t nowUs);
  std::uint32_t eventsReceived(Bytes body);
  std::uint32_t noticeReceived(Bytes body);
  std::uint32_t parametersReceived(Bytes body);
  std::uint32_t errorReceived(Bytes body, std::uint64_t requestId, std::uint64_t nowUs);
  std::uint32_t movingReceived(Bytes body, std::uint64_t nowUs);
  // Whether the error only ends the connection, so that the client may try again.
  bool isTemporary(const ServerError& error) const;
  std::uint32_t scenesReceived(Bytes body);
  std::uint32_t tokenReceived(Bytes body);
  std::uint32_t pairingCodeReceived(Bytes body);
  std::uint32_t operatingPointReceived(Bytes body);
  std::uint32_t datagramAnswerReceived(Bytes body);
  // Sends a request that `write(message, id)` serialises. Returns its id, or 0.
  template <typename Write>
  std::uint64_t request(cs_request kind, Write write);
  std::string_view orJoined(std::string_view scene) const;
  std::uint32_t answerReceived(const ServerMessage& message);
  std::uint32_t playbackReceived(Bytes body, std::uint64_t nowUs);

  // `code` is the ErrorCode of the server; 0 if the client found the error.
  std::uint32_t fail(std::string text, std::uint32_t code = 0);
  std::uint32_t failMalformed(const char* what);
  void send(std::string message);

  cs_state state_ = CS_STATE_JOINING;
  bool resumed_ = false;
  ServerError error_;
  Notice notice_;
  Credentials credentials_;
  PairingCode pairingCode_;  // newest; no code before the first
  Hello hello_;              // the token is set by resume() or the first Welcome
  Welcome welcome_;
  Participants participants_;
  ConnectionTimer timer_;
  Redirection redirection_;
  DatagramNegotiation datagrams_;
  Limits limits_;
  ReceivedStream stream_;
  ServerClock clock_;
  Outbox outbox_;
  Poses poses_;         // poses of this participant
  bool posed_ = false;  // whether the program has set a pose
  std::optional<body::WornBody> worn_;
  std::uint64_t wearRequest_ = 0;  // newest one for a body
  OwnSurfaces surfaces_;
  std::uint32_t allowedSurfaces_ = CS_SURFACES_OWN;
  RoomSurfaces roomSurfaces_;  // of others
  Display display_;
  std::vector<SceneSummary> scenes_;
  Requests requests_;
  TickEvents events_;
  std::uint64_t parametersParticipant_ = 0;
  PlaybackPosition playback_;
};

}  // namespace clothstream::client

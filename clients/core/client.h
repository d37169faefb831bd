// SPDX-License-Identifier: MIT
// The state machine of a client: joining, description, frames, reconnecting. The contract is in core.h.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/stream/content_assembly.h"
#include "clients/core/stream/frame_feedback.h"
#include "clients/core/stream/frame_statistics.h"
#include "clients/core/stream/newest_frame.h"
#include "clients/core/stream/outbox.h"
#include "clients/core/stream/pending_requests.h"
#include "clients/core/stream/play_out.h"
#include "clients/core/stream/reconnection.h"
#include "clients/core/stream/redirection.h"
#include "clients/core/stream/server_clock.h"
#include "clients/core/stream/upload.h"
#include "clients/core/touch/contact.h"
#include "clients/core/touch/own_capsules.h"
#include "clients/core/wire/client_message.h"
#include "clients/core/wire/description.h"
#include "clients/core/wire/limits.h"
#include "clients/core/wire/scene_request.h"
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
  const std::string& nextServer() const { return nextServer_; }
  const std::string* nextOutgoing();

  // Used from the next connection on; also for the current one while its Hello waits. A token replaces a
  // pairing code.
  void prove(Proof proof);
  // Returns false before the client has joined, and for an empty token.
  bool renew(std::string_view token);
  // Returns false if the text is neither empty nor one of resumeToken().
  bool resume(std::string_view text);
  // Whether the program opens connections at connectServer().
  void followRedirects(bool on) { follows_ = on; }
  // Has no effect on the current connection if its Hello is sent already.
  void want(std::uint32_t finest);

  void setLimits(const Limits& limits) { limits_ = limits; }
  void setClock(std::uint64_t (*nowUs)()) { nowUs_ = nowUs; }
  void setColliders(std::span<const cs_own_collider> colliders, std::uint64_t nowUs);
  // Four numbers per joint: {x, y, z, radius}. Empty removes the hand.
  void setHand(std::uint32_t side, std::span<const float> joints, std::uint64_t nowUs);
  void setHead(const std::optional<cs_own_collider>& head, std::uint64_t nowUs);
  void setGrabs(std::span<const cs_grab> grabs, std::uint64_t nowUs);
  // Among the positions that are shown.
  std::optional<cs_cloth_point> nearestPoint(const Vec3& point, float maxDistance) const;
  std::optional<cs_cloth_point> castRay(const Vec3& origin, const Vec3& direction, float maxDistance) const;
  void wantContacts(bool wants, std::uint64_t nowUs);
  void wantConstraints(bool wants, std::uint64_t nowUs);
  void move(AttachmentPose attachment, std::uint64_t nowUs);
  void move(ColliderJoints joints, std::uint64_t nowUs);
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
  void holdAcknowledgements(bool on) { holdsAcknowledgements_ = on; }
  void acknowledgeSeen();
  // nullptr turns play-out off. Returns false if the options are not allowed.
  bool setPlayOut(const cs_play_out_options* options);
  void setLocalContact(bool on);
  // Length of the largest correction of the last play(), m.
  float largestCorrection() const { return shown_.empty() ? 0 : contact_->largest(); }
  // nullopt if play-out is off.
  std::optional<cs_played> play(std::uint64_t nowUs, std::uint64_t displayUs);

  cs_state state() const { return state_; }
  const std::string& errorText() const { return errorText_; }
  std::uint32_t errorCode() const { return errorCode_; }
  const std::string& errorServer() const { return errorServer_; }
  const Notice& notice() const { return notice_; }
  // Token given, or received after pairing.
  const std::string& token() const { return proof_.token; }
  const PairingCode& pairingCode() const { return pairingCode_; }
  bool resumed() const { return resumed_; }
  // Empty before the first Welcome.
  std::string resumeToken() const;
  const std::vector<Participant>& participants() const { return participants_; }
  // The newest change of participants; kind 0 before the first.
  const Presence& presence() const { return presence_; }
  const Welcome& welcome() const { return welcome_; }
  // Empty before the first description.
  const Description& description() const { return description_; }
  bool described() const { return newest_.begun(); }
  const FrameStatistics& statistics() const { return statistics_; }
  const ServerClock& clock() const { return clock_; }
  // Quality that the server sends now; 0 before the description.
  std::uint32_t quality() const { return described() ? quality_ : 0; }
  // Divisor of the newest frame; 1 before the first.
  std::uint32_t frameDivisor() const { return frameDivisor_; }
  // State of the recording at this time.
  std::optional<cs_playback> playback(std::uint64_t nowUs) const;
  double decodeMs() const { return decodeMs_; }
  const std::vector<SceneSummary>& scenes() const { return scenes_; }
  // No request id before the first answer.
  const Answer& answer() const { return answer_; }
  const Upload& upload() const { return upload_; }
  const std::string& definition() const { return definition_; }
  const std::vector<Ban>& bans() const { return bans_; }

  // Newest frame, or the rest state before the first frame.
  std::span<const float> positions() const;
  std::span<const float> normals() const;
  // Result of the last play(). Same as above while play-out shows no frame.
  std::span<const float> playedPositions() const;
  std::span<const float> playedNormals() const;
  const std::vector<Collider>& playedColliders() const;
  cs_stage_statistics stages() const;
  std::uint64_t reconstructionHash() const;
  std::uint64_t parametersParticipant() const { return parametersParticipant_; }
  // The newest report and its tick; no cloths before the first.
  const SimulationReport& report() const { return report_; }
  std::uint64_t reportTick() const { return reportTick_; }
  const std::vector<cs_grab_event>& grabEvents() const { return events_.grabs; }
  const std::vector<ContactEvent>& contactEvents() const { return events_.contacts; }
  const std::vector<Collider>& colliders() const { return description_.colliders; }

 private:
  void sendPoses(std::uint64_t nowUs);
  // Tick of the frame that is shown; 0 before the first.
  std::uint64_t shownTick() const;
  void correct(const cs_played& played, std::uint64_t displayUs);
  std::optional<cs_cloth_point> seen(std::optional<cs_cloth_point> point) const;
  void sendHello();
  bool isConnected() const { return state_ != CS_STATE_RECONNECTING || welcomed_; }
  bool mayCollide() const;
  std::uint32_t welcomed(Bytes body, std::uint64_t nowUs);
  std::uint32_t presenceReceived(Bytes body, std::uint64_t nowUs);
  std::uint32_t chunkReceived(Bytes body);
  std::uint32_t described(Bytes content);
  std::uint32_t frameReceived(Bytes body, std::uint64_t nowUs, const cs_decoded* decoded);
  std::uint32_t packetReceived(std::uint64_t nowUs, const cs_decoded* decoded);
  void acknowledge(std::uint64_t tick, std::uint64_t nowUs);
  void timeFrame(bool key, std::uint64_t nowUs);
  cs_decoding decode(std::span<const std::byte> packet);
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
  // Sends a request that `write(message, id)` serialises. Returns its id, or 0.
  template <typename Write>
  std::uint64_t request(cs_request kind, Write write);
  std::string_view orJoined(std::string_view scene) const;
  std::uint32_t answerReceived(const ServerMessage& message);
  bool readAnswer(const ServerMessage& message);
  void forgetRequests();
  std::uint32_t playbackReceived(Bytes body, std::uint64_t nowUs);

  // `code` is the ErrorCode of the server; 0 if the client found the error.
  std::uint32_t fail(std::string text, std::uint32_t code = 0);
  std::uint32_t failMalformed(const char* what);
  void send(std::string message);

  Kind kind_;
  cs_state state_ = CS_STATE_JOINING;
  bool welcomed_ = false;  // whether Welcome has arrived on the current connection
  bool resumed_ = false;
  bool follows_ = false;  // the program can connect to another server
  std::uint32_t errorCode_ = 0;
  std::string errorText_, errorServer_;
  std::string nextServer_;  // to which the scene moves soon; empty: none
  Notice notice_;
  Proof proof_;
  Proof renewing_;           // sent by renew(), not yet accepted; empty without one
  PairingCode pairingCode_;  // newest; no code before the first
  Hello hello_;              // the token is set by resume() or the first Welcome
  Welcome welcome_;
  std::vector<Participant> participants_;
  Presence presence_;
  Reconnection reconnection_;
  Redirection redirection_;
  std::uint64_t connectAtUs_ = Reconnection::kNever;  // used while not welcomed
  std::uint64_t lastHeardUs_ = 0, updatedUs_ = 0;
  Limits limits_;
  ContentAssembly assembly_;
  Description description_;
  NewestFrame newest_;
  Frame frame_;
  std::uint32_t quality_ = 0;       // from the newest OperatingPoint
  std::uint32_t frameDivisor_ = 1;  // of the newest frame
  Acknowledgement acknowledgement_;
  bool holdsAcknowledgements_ = false;
  std::optional<std::uint64_t> unseenTick_;  // of a frame whose acknowledgement is held
  KeyFrameRequest keyFrameRequest_;
  FrameStatistics statistics_;
  ServerClock clock_;
  Outbox outbox_;
  Poses poses_;         // poses of this participant
  bool posed_ = false;  // whether the program has set a pose
  std::uint64_t lastRequestId_ = 0;
  std::uint64_t (*nowUs_)() = nullptr;
  double decodeMs_ = 0;
  cs_stage_statistics stages_{};  // members about the newest frame
  std::unique_ptr<PlayOut> playOut_;
  std::unique_ptr<Contact> contact_;  // present if local contact is on
  CapsuleHistory ownCapsules_;        // used if local contact is on
  std::span<const float> shown_;      // positions that contact has corrected; empty if there are none
  std::uint64_t playedTick_ = 0;      // of the last play()
  std::vector<SceneSummary> scenes_;
  PendingRequests requests_;
  Answer answer_;
  Upload upload_;
  std::uint64_t endedUploadId_ = 0;  // request of the last upload that the server refused
  std::string definition_;
  std::vector<Ban> bans_;
  TickEvents events_;
  SimulationReport report_;
  std::uint64_t reportTick_ = 0;
  std::uint64_t parametersParticipant_ = 0;
  std::optional<cs_playback> playback_;
  std::uint64_t playbackUs_ = 0;  // time of arrival of playback_
};

}  // namespace clothstream::client

// SPDX-License-Identifier: MIT
// Table of the messages of a peer, and their handlers.
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/mailbox.h"
#include "server/hosting/scene_server.h"
#include "server/messages/client_message.h"
#include "server/messages/surface_message.h"
#include "server/scene/shared_surfaces.h"
#include "server/session/session.h"

namespace clothstream::session {
namespace {

using scene::Action;

// Largest answer in a stream; it bounds the memory that a peer costs. Scenes with large meshes need the unary
// call.
constexpr std::size_t kMaxAnswerBytes = 1024 * 1024;
// One thread makes the surfaces of all participants, and needs 1 to 2 us for a triangle. Each number of
// triangles costs a token in addition to that of the message, so that one participant takes at most a quarter
// of the thread. A mesh of 50,000 triangles may be sent twice a second.
constexpr double kSurfaceTrianglesOfToken = 750;

}  // namespace

template <typename Response>
std::function<void(tl::expected<Response, v1::Error>)> Session::answering(
    Response* (v1::ServerMessage::*body)()) {
  ++asked_;
  return [weak = weak_from_this(), requestId = requestId_, body](tl::expected<Response, v1::Error> response) {
    const std::shared_ptr<Session> session = weak.lock();
    if (!session) return;
    const std::lock_guard lock(session->mutex_);
    --session->asked_;
    if (session->mailbox_->closed()) return;
    session->now_ = Clock::now();
    session->requestId_ = requestId;
    if (!response) return session->refuse({response.error().code(), response.error().text()});
    v1::ServerMessage message;
    *(message.*body)() = std::move(*response);
    session->answer(message);
  };
}

struct Session::Messages {
  using Message = v1::ClientMessage;

  enum class State : std::uint8_t {
    any,  // also before the peer has an identity
    identified,
    outside,  // identified, and no Hello before
    inScene,  // identified, and after Hello
  };

  struct RateLimit {
    Rate rate;
    const char* what;  // name of the messages for people
  };

  // A message is checked in this order: state, rate, permission. Handlers check what depends on its content.
  struct Row {
    Message::BodyCase body;
    State state;
    std::optional<RateLimit> limit = {};
    std::optional<Action> action = {};  // that the peer must be permitted
    // Scene of the action. Null only for Action::createScene.
    const std::string& (*sceneOf)(const Message&) = nullptr;
    void (*handle)(Session&, const Message&);
  };

  static std::span<const Row> rows() {
    constexpr RateLimit kScenes{Rate::control, "requests about scenes"};
    constexpr RateLimit kBans{Rate::control, "requests about bans"};
    constexpr RateLimit kParticipants{Rate::control, "requests about participants"};
    constexpr RateLimit kQueries{Rate::queries, "queries"};
    using Name = const std::string&;
    static constexpr auto kRows = std::to_array<Row>({
        {.body = Message::kAuthenticate,
         .state = State::any,
         .limit = RateLimit{Rate::control, "tokens"},
         .handle = authenticate},
        {.body = Message::kPing,
         .state = State::any,
         .limit = RateLimit{Rate::pings, "pings"},
         .handle = ping},
        {.body = Message::kHello, .state = State::outside, .handle = hello},
        {.body = Message::kCreatePairingCode,
         .state = State::identified,
         .limit = RateLimit{Rate::control, "requests about pairing"},
         .handle = createPairingCode},
        {.body = Message::kListBans,
         .state = State::identified,
         .limit = kBans,
         .action = Action::manageBans,
         .sceneOf = [](const Message& message) -> Name { return message.list_bans().scene(); },
         .handle = listBans},
        {.body = Message::kLiftBan,
         .state = State::identified,
         .limit = kBans,
         .action = Action::manageBans,
         .sceneOf = [](const Message& message) -> Name { return message.lift_ban().scene(); },
         .handle = liftBan},
        {.body = Message::kListScenes, .state = State::identified, .limit = kQueries, .handle = listScenes},
        {.body = Message::kGetScene, .state = State::identified, .limit = kQueries, .handle = getScene},
        {.body = Message::kUpload,
         .state = State::identified,
         .action = Action::createScene,
         .handle = upload},
        {.body = Message::kCreateScene,
         .state = State::identified,
         .limit = kScenes,
         .action = Action::createScene,
         .handle = createScene},
        {.body = Message::kDeleteScene,
         .state = State::identified,
         .limit = kScenes,
         .action = Action::deleteScene,
         .sceneOf = [](const Message& message) -> Name { return message.delete_scene().name(); },
         .handle = deleteScene},
        {.body = Message::kControlScene,
         .state = State::identified,
         .limit = kScenes,
         .action = Action::controlScene,
         .sceneOf = [](const Message& message) -> Name { return message.control_scene().name(); },
         .handle = controlScene},
        {.body = Message::kStartRecording,
         .state = State::identified,
         .limit = kScenes,
         .action = Action::recordScene,
         .sceneOf = [](const Message& message) -> Name { return message.start_recording().scene(); },
         .handle = startRecording},
        {.body = Message::kStopRecording,
         .state = State::identified,
         .limit = kScenes,
         .action = Action::recordScene,
         .sceneOf = [](const Message& message) -> Name { return message.stop_recording().scene(); },
         .handle = stopRecording},
        {.body = Message::kColliderPoses,
         .state = State::inScene,
         .limit = RateLimit{Rate::poses, "collider poses"},
         .handle = colliderPoses},
        {.body = Message::kParameterChange,
         .state = State::inScene,
         .limit = RateLimit{Rate::changes, "parameter changes"},
         .handle = parameterChange},
        {.body = Message::kSurface,
         .state = State::inScene,
         .limit = RateLimit{Rate::surfaces, "messages about surfaces"},
         .handle = surface},
        {.body = Message::kGetSurfacePart,
         .state = State::inScene,
         .limit = RateLimit{Rate::surfaceParts, "requests for surfaces"},
         .handle = getSurfacePart},
        {.body = Message::kSetRole, .state = State::inScene, .limit = kParticipants, .handle = setRole},
        {.body = Message::kRemoveParticipant,
         .state = State::inScene,
         .limit = kParticipants,
         .handle = removeParticipant},
        {.body = Message::kWearBody, .state = State::inScene, .limit = kParticipants, .handle = wearBody},
        {.body = Message::kFrameAck, .state = State::inScene, .handle = frameAck},
        {.body = Message::kDatagramOffer,
         .state = State::inScene,
         .limit = RateLimit{Rate::control, "offers of datagrams"},
         .handle = datagramOffer},
        // Only some of these take a token: see the handler.
        {.body = Message::kKeyFrameRequest, .state = State::inScene, .handle = keyFrameRequest},
    });
    return kRows;
  }

  static const Row* find(int body) {
    const std::span<const Row> all = rows();
    const auto found =
        std::ranges::find(all, body, [](const Row& row) { return static_cast<int>(row.body); });
    return found == all.end() ? nullptr : &*found;
  }

  static messages::FieldError reason(messages::FieldError error) { return error; }
  static messages::FieldError reason(const v1::Error& error) { return {error.code(), error.text()}; }

  template <typename Response, typename Error>
  static void reply(Session& session, tl::expected<Response, Error> result,
                    Response* (v1::ServerMessage::*body)()) {
    if (!result) return session.refuse(reason(std::move(result.error())));
    v1::ServerMessage message;
    *(message.*body)() = std::move(*result);
    session.answer(message);
  }

  static void authenticate(Session& session, const Message& message) {
    session.authenticate(message.authenticate());
  }

  static void ping(Session& session, const Message& message) {
    v1::ServerMessage pong;
    pong.mutable_pong()->set_client_time_us(message.ping().client_time_us());
    pong.mutable_pong()->set_server_time_us(schedule::microseconds(session.now_));
    session.answer(pong);
  }

  static void hello(Session& session, const Message& message) { session.hello(message.hello()); }

  static void createPairingCode(Session& session, const Message& message) {
    reply(session,
          session.server_.authentication.createPairingCode(*session.identity_, message.create_pairing_code(),
                                                           session.now_),
          &v1::ServerMessage::mutable_create_pairing_code);
  }

  static void listBans(Session& session, const Message& message) {
    reply(session, session.server_.requests.listBans(message.list_bans()),
          &v1::ServerMessage::mutable_list_bans);
  }

  static void liftBan(Session& session, const Message& message) {
    reply(session, session.server_.requests.liftBan(message.lift_ban()),
          &v1::ServerMessage::mutable_lift_ban);
  }

  static void listScenes(Session& session, const Message& /*message*/) {
    v1::ServerMessage list;
    *list.mutable_list_scenes() = session.server_.requests.list(*session.identity_);
    session.answer(list);
  }

  static void getScene(Session& session, const Message& message) {
    hosting::SceneServer& server = session.server_;
    if (const auto permitted = server.access.mayUse(*session.identity_, message.get_scene().name());
        !permitted)
      return session.refuse(permitted.error());
    auto found = server.requests.get(message.get_scene(), kMaxAnswerBytes);
    if (!found && found.error().code() == v1::ERROR_CODE_RESOURCE_EXHAUSTED)
      server.metrics.refuse(telemetry::Refusal::answerSize);
    reply(session, std::move(found), &v1::ServerMessage::mutable_get_scene);
  }

  static void upload(Session& session, const Message& message) {
    session.refuseUnless(session.upload_.add(message.upload(), session.now_));
  }

  static void createScene(Session& session, const Message& message) {
    const v1::CreateSceneRequest& request = message.create_scene();
    std::optional<hosting::UploadedContent> uploaded;
    if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId) {
      messages::Result<hosting::UploadedContent> taken = session.upload_.take(request.uploaded_content_id());
      if (!taken) return session.refuse(taken.error());
      uploaded = std::move(*taken);
    }
    const auto wanted = [weak = session.weak_from_this()] {
      const std::shared_ptr<Session> creator = weak.lock();
      return creator && !creator->mailbox_->closed();
    };
    session.refuseUnlessQueued(session.server_.maker.create(
        request, std::move(uploaded), session.identity_->subject.tenant, wanted,
        session.answering<v1::CreateSceneResponse>(&v1::ServerMessage::mutable_create_scene)));
  }

  static void deleteScene(Session& session, const Message& message) {
    session.refuseUnlessQueued(session.server_.maker.remove(
        message.delete_scene(),
        session.answering<v1::DeleteSceneResponse>(&v1::ServerMessage::mutable_delete_scene)));
  }

  static void controlScene(Session& session, const Message& message) {
    const v1::ControlSceneRequest& request = message.control_scene();
    const std::uint64_t by = session.isIn(request.name()) ? session.participant_ : 0;
    reply(session, session.server_.requests.control(request, by), &v1::ServerMessage::mutable_control_scene);
  }

  static void startRecording(Session& session, const Message& message) {
    session.refuseUnlessQueued(session.server_.maker.startRecording(
        message.start_recording(),
        session.answering<v1::StartRecordingResponse>(&v1::ServerMessage::mutable_start_recording)));
  }

  static void stopRecording(Session& session, const Message& message) {
    session.refuseUnlessQueued(session.server_.maker.stopRecording(
        message.stop_recording(),
        session.answering<v1::StopRecordingResponse>(&v1::ServerMessage::mutable_stop_recording)));
  }

  static void colliderPoses(Session& session, const Message& message) {
    scene::LiveScene& scene = *session.scene_;
    if (scene.source) return;  // a played recording has no inputs
    auto poses = messages::toPoses(message.collider_poses(), scene.start());
    if (!poses) return session.refuse(poses.error());
    session.refuseUnless(scene.poses.post(*session.mailbox_, message.collider_poses(), std::move(*poses),
                                          session.server_.options.participantsMay, session.now_));
  }

  static void surface(Session& session, const Message& message) {
    scene::LiveScene& scene = *session.scene_;
    if (session.surfaceLimits().policy() == v1::SURFACE_POLICY_OFF)
      return session.refuse({v1::ERROR_CODE_INVALID_ARGUMENT,
                             scene.source
                                 ? fmt::format("surface: '{}' is not simulated, so that no surface acts "
                                               "in it",
                                               scene.name())
                                 : "surface: this server takes no surfaces of the real room "
                                   "(--room-surfaces off)"});
    const auto update = messages::toSurfaceUpdate(message.surface());
    if (!update) {
      const std::uint32_t id = message.surface().id();
      session.surfaceUpload_.drop(scene.surfaces, id);
      return session.refuse({update.error().code,
                             fmt::format("{} (surface.id = {})", update.error().text, id),
                             update.error().limit});
    }
    if (update->keep) {
      session.surfaceUpload_.dropOthers(scene.surfaces, *update->keep);
      return scene.surfaces.removeOthers(session.participant_, *update->keep);
    }
    if (update->remove) {
      session.surfaceUpload_.drop(scene.surfaces, update->id);
      return scene.surfaces.remove(session.participant_, update->id);
    }
    if (!update->part)
      return session.refuseUnless(scene.surfaces.move(session.participant_, update->id, *update->pose));
    session.refuseUnless(session.surfacePart(*update, message.surface().part()));
  }

  static void getSurfacePart(Session& session, const Message& message) {
    if (session.surfaceLimits().policy() != v1::SURFACE_POLICY_EVERYONE)
      return session.refuse({v1::ERROR_CODE_NOT_FOUND,
                             "getSurfacePart: this server sends no surfaces of the real rooms of others "
                             "(--room-surfaces everyone)"});
    reply(session, scene::surfacePart(session.scene_->surfaces, message.get_surface_part()),
          &v1::ServerMessage::mutable_get_surface_part);
  }

  static void parameterChange(Session& session, const Message& message) {
    scene::LiveScene& scene = *session.scene_;
    const v1::ParameterChange& change = message.parameter_change();
    session.refuseUnless(
        scene.roster.permits(*session.mailbox_, change, session.server_.options.participantsMay)
            .and_then([&] {
              return scene.change(session.participant_, change, scene.roster.roleOf(*session.mailbox_));
            }));
  }

  static void setRole(Session& session, const Message& message) {
    session.refuseUnless(session.scene_->roster.setRole(*session.mailbox_, message.set_role(), session.now_));
  }

  static void removeParticipant(Session& session, const Message& message) {
    session.refuseUnless(
        session.scene_->roster.remove(*session.mailbox_, message.remove_participant(), session.now_));
  }

  static void wearBody(Session& session, const Message& message) {
    scene::LiveScene& scene = *session.scene_;
    scene::Roster& roster = scene.roster;
    if (scene.source)
      return session.refuse(
          {v1::ERROR_CODE_INVALID_ARGUMENT, fmt::format("wearBody: '{}' {}; its bodies cannot be worn",
                                                        scene.name(), scene.source->whyFixed())});
    auto worn = messages::toWornBody(message.wear_body(), scene.start());
    if (!worn) return session.refuse(worn.error());
    const std::string before = roster.bodyOf(*session.mailbox_);
    if (auto taken = roster.wear(*session.mailbox_, message.wear_body().collider()); !taken)
      return session.refuse(taken.error());
    if (worn->colliders().empty()) return;
    const auto stopped = scene.change(session.participant_, *worn, roster.roleOf(*session.mailbox_));
    if (stopped) return;
    // A body that another participant has taken meanwhile does not come back.
    if (!roster.wear(*session.mailbox_, before)) static_cast<void>(roster.wear(*session.mailbox_, {}));
    session.refuse(stopped.error());
  }

  static void frameAck(Session& session, const Message& message) {
    delivery::Mailbox& mailbox = *session.mailbox_;
    const std::uint64_t tick = message.frame_ack().tick();
    const bool awaited = mailbox.awaitsAcknowledgement();
    // A peer that continues here may acknowledge frames of the server that had the scene before.
    if (!mailbox.acknowledge(tick, session.now_))
      return session.continues_
                 ? void()
                 : session.refuse(
                       {v1::ERROR_CODE_INVALID_ARGUMENT,
                        fmt::format("frame_ack.tick = {}: must be of a frame that was sent", tick)});
    if (!session.inLockstep() || !awaited || mailbox.awaitsAcknowledgement()) return;
    // Each frame permits one such acknowledgement, so they need no other limit.
    session.bucket(Rate::messages).giveBack();
    session.server_.device.wake(*session.scene_);
  }

  static void datagramOffer(Session& session, const Message& message) {
    session.openDatagrams(message.datagram_offer());
  }

  static void keyFrameRequest(Session& session, const Message& message) {
    // A key frame costs all subscribers of its quality. The mailbox limits early requests.
    if (message.key_frame_request().early()) return session.mailbox_->requestKeyFrame();
    if (session.mailbox_->isRestarting()) return;
    // In lockstep the key frame is a recorded one, which costs nothing.
    if (!session.inLockstep() && !session.allowed(Rate::keyFrames, "key frame requests")) return;
    session.mailbox_->restart();
    if (session.inLockstep()) session.server_.device.wake(*session.scene_);
  }
};

bool Session::handles(int body) {
  return Messages::find(body) != nullptr;
}

void Session::dispatch(const v1::ClientMessage& message) {
  using State = Messages::State;
  const Messages::Row* const row = Messages::find(message.body_case());
  if (row == nullptr)
    return refuse(
        {v1::ERROR_CODE_MALFORMED_MESSAGE, "the message has no body, or one that this server does not know"});
  if (row->state != State::any && !identity_.isKnown()) {
    server_.metrics.refuse(telemetry::Refusal::token);
    return fail(v1::ERROR_CODE_UNAUTHENTICATED, whyUnknown_);
  }
  if (row->state == State::outside && scene_ != nullptr)
    return fail(v1::ERROR_CODE_OUT_OF_ORDER,
                fmt::format("this stream has joined '{}' already: open another one", scene_->name()));
  if (row->state == State::inScene && scene_ == nullptr && !remote())
    return fail(v1::ERROR_CODE_OUT_OF_ORDER, "this stream has not joined a scene: send hello first");
  if (row->limit && !allowed(row->limit->rate, row->limit->what)) return;
  if (row->action) {
    const messages::Result<void> permitted = *row->action == Action::createScene
                                                 ? server_.access.mayCreate(*identity_)
                                                 : may(*row->action, row->sceneOf(message));
    if (!permitted) return refuse(permitted.error());
  }
  row->handle(*this, message);
}

messages::Result<void> Session::surfacePart(const messages::SurfaceUpdate& update,
                                            const v1::SurfacePart& message) {
  if (!bucket(Rate::surfaces).take(sent_, message.triangles_size() / 3 / kSurfaceTrianglesOfToken)) {
    surfaceUpload_.drop(scene_->surfaces, update.id);
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_RATE_LIMITED,
        fmt::format(
            "surface.id = {}: too many triangles in a short time, so that this mesh was dropped; send "
            "meshes that change at most twice a second, and only what has changed",
            update.id),
        telemetry::Refusal::messageRate});
  }
  if (update.part->index == 0) {
    const auto ticket = scene_->surfaces.begin(participant_, update.id, update.pose.value_or(model::Pose{}),
                                               server_.options.participantsMay);
    if (!ticket) return tl::unexpected(ticket.error());
    surfaceUpload_.begin(scene_->surfaces, *ticket, *update.part);
  }
  auto complete = surfaceUpload_.add(scene_->surfaces, update.id, *update.part, message);
  if (!complete) return tl::unexpected(std::move(complete.error()));
  if (!*complete) return {};
  const scene::RoomSurfaces::Ticket ticket = (*complete)->ticket;
  auto queued = server_.surfaceMaker.make(scene_, std::move(**complete),
                                          [weak = weak_from_this()](const messages::Result<void>& put) {
                                            const std::shared_ptr<Session> session = weak.lock();
                                            if (put || !session) return;
                                            const std::lock_guard lock(session->mutex_);
                                            if (session->mailbox_->closed()) return;
                                            session->now_ = Clock::now();
                                            session->requestId_ = 0;
                                            session->refuse(put.error());
                                          });
  if (!queued) scene_->surfaces.cancel(ticket);
  return queued;
}

v1::SurfaceLimits Session::surfaceLimits() const {
  v1::SurfaceLimits limits;
  if (scene_->source || server_.options.roomSurfaces == hosting::SurfacePolicy::off) {
    limits.set_policy(v1::SURFACE_POLICY_OFF);
    return limits;
  }
  limits.set_policy(server_.options.roomSurfaces == hosting::SurfacePolicy::everyone
                        ? v1::SURFACE_POLICY_EVERYONE
                        : v1::SURFACE_POLICY_OWN);
  limits.set_max_triangles(model::kMaxSurfaceTriangles);
  limits.set_max_surfaces(model::kMaxSurfacesOfParticipant);
  return limits;
}

bool Session::inLockstep() const {
  return scene_->source && scene_->source->inLockstep();
}

void Session::refuseUnlessQueued(const tl::expected<void, v1::Error>& queued) {
  if (queued) return;
  --asked_;
  refuse({queued.error().code(), queued.error().text()});
}

bool Session::isIn(const std::string& name) const {
  return scene_ != nullptr && server_.scenes.find(name) == scene_;
}

messages::Result<void> Session::may(Action action, const std::string& name) const {
  return isIn(name) ? scene_->roster.permits(*mailbox_, action, server_.options.participantsMay)
                    : server_.access.mayFromOutside(*identity_, name, action);
}

}  // namespace clothstream::session

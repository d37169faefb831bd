// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/session_target.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "inputs.pb.h"
#include "proto/codec/stream_layout.h"
#include "server/delivery/envelope.h"
#include "server/hosting/scene_server.h"
#include "server/messages/limits.h"
#include "server/model/input.h"
#include "server/model/surface.h"
#include "server/scene/interaction.h"
#include "server/scene/live_scene.h"
#include "server/scene/room_surfaces.h"
#include "server/session/session.h"
#include "server/simulation/cloth_simulation.h"
#include "tests/fuzz/targets/still_server.h"
#include "tests/serving/small_scene.h"

namespace clothstream::fuzz {
namespace {

constexpr std::size_t kPeers = 3;
constexpr std::size_t kMaxSteps = 400;  // below the rates of a session, so that they do not end every input

model::Scene scene() {
  model::Scene scene = tests::smallScene("small");
  model::Attachment rail;
  rail.name = "rail";
  rail.vertices = {0, 1, 2};
  scene.cloths[0].attachments.push_back(rail);
  scene.cloths[0].pins.clear();
  return scene;
}

// Ticks of a scene without a device: handles its inputs as SceneHost does.
class Ticks {
 public:
  explicit Ticks(scene::LiveScene& live) : live_(live), scene_(live.start()), interaction_(scene_) {}

  void run() {
    if (live_.resetRequested.exchange(false)) {
      scene_ = live_.start();
      live_.subscribers.announce(delivery::parametersChanged(live_.revertTo(scene_), tick_ + 1));
    }
    live_.inbox.drain(inputs_);
    for (const scene::AcceptedChange& accepted : inputs_.changes) {
      model::applyChange(scene_, accepted.change);
      live_.subscribers.announce(
          delivery::parametersChanged(accepted.message, tick_ + 1, accepted.participant));
    }
    for (scene::Poses& poses : inputs_.poses) interaction_.add(std::move(poses));
    interaction_.place(schedule::Clock::now());
    if (live_.surfaces.take(surfaceVersion_, surfaces_)) interaction_.placeSurfaces(surfaces_);
    std::size_t triangles = 0;
    for (const scene::RoomSurface& surface : surfaces_)
      triangles += surface.placed.table->surface.triangles.size();
    require(surfaces_.size() <= model::kMaxSceneSurfaces && triangles <= model::kMaxSceneSurfaceTriangles,
            "the simulation has room for all surfaces");
    interaction_.advance(scene_, tick_, scene::Recovery::none, model::kMaxHeldSpeed, nullptr);
    const simulation::TickInputs& inputs = interaction_.inputs();
    require(inputs.colliders.size() <= simulation::kMaxColliders,
            "the simulation has room for all colliders");
    require(inputs.grabs.size() <= simulation::kMaxGrabs, "the simulation has room for all grabs");
    live_.tick = ++tick_;
  }

 private:
  scene::LiveScene& live_;
  model::Scene scene_;
  std::uint64_t tick_ = 0;
  scene::Inputs inputs_;
  std::vector<scene::RoomSurface> surfaces_;
  std::uint64_t surfaceVersion_ = 0;
  scene::Interaction interaction_;
};

class Peer {
 public:
  Peer() { connect(); }

  void connect() {
    session_ = session::Session::open(stillServer(), {.peer = "peer", .address = {}, .token = {}}, [] {});
  }
  void send(const v1::ClientMessage& message) { send(message.SerializeAsString()); }
  void send(const std::string& bytes) {
    // Exactly sized, so that the sanitizer detects a read past the end.
    const std::vector<char> exact(bytes.begin(), bytes.end());
    session_->receive(std::as_bytes(std::span(exact)));
  }
  void read() {
    if (!reads) return;
    while (const std::optional<delivery::SharedBytes> bytes = session_->next()) {
      require(last.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())),
              "a peer is sent messages that can be parsed");
      if (last.has_welcome()) token = last.welcome().resume_token();
    }
  }
  void hello(const std::string& scene, const std::string& resume = {}) {
    v1::ClientMessage message;
    v1::Hello& hello = *message.mutable_hello();
    hello.set_protocol_version(1);
    for (const std::uint32_t codec : codec::kCodecs) hello.add_codecs(codec);
    hello.set_scene(scene);
    hello.set_resume_token(resume);
    send(message);
  }
  void upload(const v1::Scene& scene) {
    const std::string bytes = scene.SerializeAsString();
    constexpr std::size_t kPiece = 32'768;
    const std::size_t count = (bytes.size() + kPiece - 1) / kPiece;
    for (std::size_t i = 0; i < count; ++i) {
      v1::ClientMessage message;
      v1::Chunk& chunk = *message.mutable_upload();
      chunk.set_content_id(1);
      chunk.set_kind(v1::CONTENT_KIND_SCENE);
      chunk.set_index(static_cast<std::uint32_t>(i));
      chunk.set_count(static_cast<std::uint32_t>(count));
      chunk.set_total_bytes(bytes.size());
      chunk.set_data(bytes.substr(i * kPiece, kPiece));
      send(message);
    }
    v1::ClientMessage create;
    create.mutable_create_scene()->set_uploaded_content_id(1);
    send(create);
  }
  void leave() { session_->leave(); }
  void vanish() { session_.reset(); }
  bool finished() const { return session_->finished(); }

  bool reads = true;
  std::string token;
  v1::ServerMessage last;

 private:
  std::shared_ptr<session::Session> session_;
};

// Waits until the scene maker has nothing to do.
void waitForMaker() {
  std::promise<void> done;
  v1::DeleteSceneRequest request;
  request.set_name("nothing");
  stillServer().unaryCalls.deleteScene(request, [&](const auto&) { done.set_value(); });
  done.get_future().wait();
}

void act(Peer& peer, const SessionInput::Step& step, Ticks& ticks) {
  using Step = SessionInput::Step;
  switch (step.action_case()) {
    case Step::kMessage:
      return peer.send(step.message());
    case Step::kRaw:
      return peer.send(step.raw());
    case Step::kUpload:
      return peer.upload(step.upload());
    case Step::kLeave:
      peer.leave();
      peer.read();
      return peer.connect();
    case Step::kVanish:
      peer.vanish();
      peer.connect();
      return peer.hello("small", peer.token);
    case Step::kStopReading:
      peer.reads = false;
      return;
    case Step::kTick:
      return ticks.run();
    case Step::ACTION_NOT_SET:
      return;
  }
}

void run(const SessionInput& input) {
  hosting::SceneRegistry& scenes = stillServer().scenes;
  const auto live =
      std::make_shared<scene::LiveScene>(scene(), scene::SceneTerms{.maxParticipants = kPeers + 1});
  scenes.insert(live);
  {
    Ticks ticks(*live);
    Peer honest;
    std::array<Peer, kPeers> peers;
    honest.hello("small");
    honest.read();
    std::size_t steps = 0;
    for (const SessionInput::Step& step : input.steps()) {
      if (++steps > kMaxSteps) break;
      Peer& peer = peers[step.peer() % kPeers];
      act(peer, step, ticks);
      for (Peer& each : peers) each.read();
      honest.read();
      require(!honest.finished() || honest.last.error().code() == v1::ERROR_CODE_REMOVED,
              "an honest peer is closed only by an owner");
    }
    waitForMaker();
    for (Peer& each : peers) each.read();
  }
  waitForMaker();  // the answer to one request may have started the next one
  scenes.erase(*live);
}

constexpr std::array<std::string_view, 16> kWords{
    "small",   "played", "sheet", "ball",  "rail",  "cotton", "silk",      "flag",
    "curtain", "",       "new",   "denim", "swing", "folds",  "obstacles", "a\xc2\x9b"};

}  // namespace

const Target kSessionTarget{.name = "session",
                            .run = &runStructured<SessionInput, &run>,
                            .structure = &SessionInput::default_instance(),
                            .words = kWords};

}  // namespace clothstream::fuzz

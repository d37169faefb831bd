// SPDX-License-Identifier: MIT
// State of a server that its sessions use: scenes, peers, and requests about scenes.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "server/delivery/frame_publisher.h"
#include "server/hosting/device_thread.h"
#include "server/hosting/peer.h"
#include "server/hosting/scene_maker.h"
#include "server/hosting/scene_server.h"
#include "server/hosting/upload_budget.h"
#include "server/scene/budget.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

v1::Error toMessage(const messages::FieldError& error);
v1::SceneSummary summaryOf(const scene::LiveScene& scene);

// Thread-safe. Members are declared in the order in which they need each other.
struct SceneServer::State {
  State(std::vector<model::Scene> definitions, ServerOptions options);
  State(std::shared_ptr<scene::LiveScene> played, ServerOptions options);

  // Scene of this name, or null; the default scene for an empty name.
  std::shared_ptr<scene::LiveScene> find(const std::string& name) const;
  std::vector<std::shared_ptr<scene::LiveScene>> scenesNow() const;
  // Ends the place of this name, if there is one.
  void insert(std::shared_ptr<scene::LiveScene> scene);
  void erase(const scene::LiveScene& scene);
  // Error text such as: there is no scene 'x'; there are curtain, flag. Lists only scenes that the peer may
  // use.
  v1::Error noSuchScene(const std::string& name, const Identity& by) const;
  // The same without the list, for a scene that was deleted after the peer's rights were checked.
  static v1::Error noSuchScene(const std::string& name);

  // DNS name of the other server that has a scene of this name, which may be empty; nothing if none has it.
  std::optional<std::string> otherServerOf(const std::string& scene) const;
  // `find` answers otherServerOf() from now on; null: there are no other servers. It must not call this.
  using FindServer = std::function<std::optional<std::string>(const std::string& scene)>;
  void setOtherServers(FindServer find);

  // Admits a peer. Returns null, or the last message to the peer if it is refused, because there are too many
  // peers or the server stops.
  delivery::SharedBytes admit(const std::shared_ptr<Peer>& peer);
  std::vector<std::shared_ptr<Peer>> peersNow() const;
  // Name of the device that simulates the scene's frames, or simulated them.
  std::string deviceNameOf(const scene::LiveScene& scene) const;
  // Wakes the thread that makes the scene's frames, after a change of its subscribers or its clock.
  void wake(const scene::LiveScene& scene);
  // Only scenes that this peer may use.
  v1::ListScenesResponse listScenes(const Identity& by) const;
  // Refuses a definition of more than `maxBytes`. If its meshes are larger, that takes no time.
  tl::expected<v1::GetSceneResponse, v1::Error> getScene(
      const v1::GetSceneRequest& request,
      std::size_t maxBytes = std::numeric_limits<std::size_t>::max()) const;
  // Pauses, resumes, resets or seeks a scene. `participant` asks; 0 means a peer outside the scene. The
  // caller has checked that the peer may do so.
  tl::expected<v1::ControlSceneResponse, v1::Error> controlScene(const v1::ControlSceneRequest& request,
                                                                 std::uint64_t participant);
  // Identity of a peer that has sent this token; empty for none. UNAUTHENTICATED if that is not enough.
  messages::Result<Identity> identify(const std::string& token, bool isLoopback);
  // Pairs a peer, or checks its token. `address` groups the attempts of one peer; empty for loopback.
  // `response` gets what the peer learns about its identity.
  messages::Result<Identity> authenticate(const v1::AuthenticateRequest& request, const std::string& address,
                                          Clock::time_point now, v1::AuthenticateResponse& response);
  // Counts a connection of a subject while the result lives. Null if it has too many; identities that are not
  // verified are not counted. The result must not outlive this.
  std::shared_ptr<const void> countConnection(const Identity& identity);
  // Created scenes that one tenant may have.
  std::uint32_t scenesPerTenant() const;
  // Returns whether a peer with a token of another tenant has created the scene.
  static bool isOfOtherTenant(const Identity& by, const scene::LiveScene& scene);
  // Each of the following returns PERMISSION_DENIED, with the reason, if the peer may not do this, and
  // NOT_FOUND if there is no such scene.
  messages::Result<void> mayUse(const Identity& by, const std::string& scene) const;
  messages::Result<void> mayCreate(const Identity& by) const;
  // For peers outside the scene of this name.
  messages::Result<void> mayFromOutside(const Identity& by, const std::string& scene,
                                        scene::Action action) const;
  messages::Result<v1::CreatePairingCodeResponse> createPairingCode(
      const Identity& by, const v1::CreatePairingCodeRequest& request, Clock::time_point now);
  // The caller has checked that the peer may do so.
  messages::Result<v1::ListBansResponse> listBans(const v1::ListBansRequest& request) const;
  messages::Result<v1::LiftBanResponse> liftBan(const v1::LiftBanRequest& request);
  // Keeps a scene that is created, before it runs; forgets one that was deleted; waits for a moment until
  // either is on the disk. All do nothing without a store.
  void keep(const std::shared_ptr<scene::LiveScene>& scene) const;
  void forget(const scene::LiveScene& scene) const;
  void flushStore(const scene::LiveScene& scene) const;
  // No later participant gets a number of a saved one.
  void raiseNewestParticipant(const scene::SavedScene& saved);
  // The name and one of the places for created scenes. No other scene gets them until insert(), or until this
  // is destroyed. It must not outlive the state.
  class HeldPlace {
   public:
    HeldPlace(State& state, std::uint64_t number) : state_(&state), number_(number) {}
    HeldPlace(HeldPlace&& other) noexcept
        : state_(std::exchange(other.state_, nullptr)), number_(other.number_) {}
    HeldPlace& operator=(HeldPlace&&) = delete;
    ~HeldPlace() {
      if (state_ != nullptr) state_->leavePlace(number_);
    }
    // The place stays taken until insert() or abandonArrival().
    void keep() { state_ = nullptr; }

   private:
    State* state_;
    std::uint64_t number_;
  };
  // Takes them for a client of this tenant. `isNew`: the scene does not come from another server. Returns why
  // that is not possible.
  tl::expected<HeldPlace, v1::Error> takePlace(const std::string& name, const std::string& tenant,
                                               bool isNew);
  void leavePlace(std::uint64_t number);
  // Loads a scene that a client created on another server, and that still runs there. Until
  // startArrived() nobody can join it. Returns why it cannot run here. Otherwise the scene has a place.
  tl::expected<std::shared_ptr<scene::LiveScene>, std::string> prepareArrival(scene::SavedScene saved);
  // Continues it here with this session and state; its definition is not used. Throws std::runtime_error if
  // that fails; then call abandonArrival().
  void startArrived(const std::shared_ptr<scene::LiveScene>& scene, scene::SavedScene saved);
  void abandonArrival(const std::shared_ptr<scene::LiveScene>& scene);
  // Removes a created scene, because a peer deleted it or another server has it now. `last` is the last
  // message to its participants.
  void removeCreated(const std::shared_ptr<scene::LiveScene>& scene, const delivery::SharedBytes& last);
  void stop();

  // Viewers of a scene that is not simulated have numbers above this one, so that they differ from the
  // participants in its frames.
  static constexpr std::uint64_t kFirstViewer = std::uint64_t{1} << 32;

  const ServerOptions options;
  telemetry::ServerMetrics metrics;
  UploadBudget uploads;
  const std::shared_ptr<scene::Budget> budget;
  std::atomic<std::uint64_t> participants{0};  // newest participant number
  // Set when peers can join; before, no reconnect grace ends.
  std::atomic<bool> started{false};

  // Name and tenant of a scene that is being made or arrives.
  struct Place {
    std::uint64_t number = 0;
    std::string name, tenant;
  };

  mutable std::mutex mutex;  // protects the next seven
  FindServer otherServers;
  std::vector<std::shared_ptr<scene::LiveScene>> scenes;
  std::vector<Place> places;
  std::uint64_t newestPlace = 0;
  std::vector<std::weak_ptr<Peer>> peers;
  bool stopping = false;
  std::map<scene::Subject, std::uint32_t> connectionsOfSubjects;  // without zeros

  delivery::FramePublisher publisher;
  DeviceThread device;
  SceneMaker maker;

 private:
  // Continues the scenes that the server starts with, and returns them.
  const std::vector<std::shared_ptr<scene::LiveScene>>& restored();
  // Continues the scenes of an earlier run that peers created. One that exceeds the budget or the number of
  // scenes is listed, but does not run; it stays kept.
  void restoreCreated();
};

}  // namespace clothstream::hosting

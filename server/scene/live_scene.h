// SPDX-License-Identifier: MIT
// A scene that participants share.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/delivery/subscribers.h"
#include "server/messages/field_error.h"
#include "server/model/price.h"
#include "server/model/scene.h"
#include "server/scene/budget.h"
#include "server/scene/checkpoint.h"
#include "server/scene/frame_source.h"
#include "server/scene/inbox.h"
#include "server/scene/journal.h"
#include "server/scene/newest_poses.h"
#include "server/scene/priced_definition.h"
#include "server/scene/quarantine.h"
#include "server/scene/room_surfaces.h"
#include "server/scene/roster.h"
#include "server/scene/scene_observer.h"
#include "server/scene/scene_store.h"
#include "server/scene/scene_terms.h"
#include "server/schedule/overload_policy.h"
#include "server/telemetry/metrics.h"

namespace clothstream::scene {

// Thread-safe. The endpoints' threads and the device's thread meet here.
class LiveScene {
 public:
  // A simulated scene. `definition` must be valid. `journal` gets everything that happens in the scene; it
  // may be null. A created scene is charged to `budget` by charge(), other scenes only for changes; null
  // means a separate budget.
  explicit LiveScene(model::Scene definition, SceneTerms terms = {},
                     std::shared_ptr<Journal> journal = nullptr, std::shared_ptr<Budget> budget = nullptr);
  // A scene that is not simulated. The caller starts the source. start() and definition() hold only name and
  // rates.
  LiveScene(std::string name, std::shared_ptr<FrameSource> source,
            std::uint32_t maxParticipants = kDefaultMaxParticipants);
  ~LiveScene();
  LiveScene(const LiveScene&) = delete;
  LiveScene& operator=(const LiveScene&) = delete;

  const std::string& name() const { return definition_.start().name; }
  // Definition at the start.
  const model::Scene& start() const { return definition_.start(); }
  // Codec and shape of the stream.
  std::uint32_t codec() const;
  delivery::StreamShape shape() const;
  // Definition with all accepted changes, those of the next tick included.
  model::Scene definition() const { return definition_.accepted(); }

  // Continues a scene of an earlier run of the server; `saved` has this scene's start. Its participants are
  // disconnected since `now`. Colliders and grabs of other participants, which left after the checkpoint, are
  // dropped. Must be called before the scene runs.
  void restore(SavedScene saved, const ReconnectGrace& grace, Clock::time_point now);
  // State from which the first host of a restored scene continues. A host that cannot be created leaves it to
  // the next one.
  struct Restored {
    std::optional<Checkpoint> checkpoint;
    std::optional<model::Scene> accepted;  // as in SavedScene
  };
  // Null if there is nothing to continue from.
  std::shared_ptr<const Restored> restored() const;
  // A host continues from it, so that a later host does not.
  void forgetRestored();

  // The observer is told what happens in the scene from now on. It must be called at most once, before peers
  // can join.
  void observe(std::unique_ptr<SceneObserver> observer);

  // Number of changes of definition(). Differs from that of an earlier definition.
  std::uint64_t version() const { return definition_.version(); }

  // Charges a created scene before it first runs (PricedDefinition::charge).
  messages::Result<void> charge(const std::string& path = "createScene.scene") {
    return definition_.charge(path);
  }
  // Place of the cloth after a tick.
  void setClothBounds(const ClothBounds& bounds) { definition_.setClothBounds(bounds); }
  // Gives the charge back, because the scene has been deleted. Others may hold the object for longer.
  void discharge() { definition_.release(); }
  // Returns whether the scene shares the device as a guest (schedule::TickSchedule): a peer created it, its
  // terms say so, or participants have made it more expensive than it was at its start.
  bool isGuest() const { return terms.created || terms.sharesAsGuest || definition_.isDearer(); }
  // See PricedDefinition.
  model::Work tickWork(std::size_t colliders) const { return definition_.tickWork(colliders); }
  double price() const { return definition_.price(); }

  // See SceneDefinition.
  std::uint32_t leastSubsteps(const model::Scene& scene) const { return definition_.leastSubsteps(scene); }
  // Speed in m/s that the winds of participants may add with this number of substeps
  // (StabilityBound::roomForWind).
  float roomForWind(const model::Scene& scene, std::uint32_t substeps) const {
    return definition_.stability().roomForWind(scene, substeps);
  }
  // Work of the scene if no overload reduces it.
  schedule::WorkLevel allWork() const { return {1, start().substeps}; }

  // Ends the scene for good because it harms others: `why` is the last message to its participants, and every
  // later join is refused with it.
  void quarantine(const std::string& why);
  // Refuses joins until then, with this reason.
  void refuseUntil(Clock::time_point until, const std::string& why);
  // Why the scene cannot be joined at this time: it is in quarantine, or refuseUntil() holds. Otherwise
  // empty.
  std::string quarantined(Clock::time_point now = Clock::now()) const;

  // Puts the change into the inbox, or returns what is wrong with it. Only an owner may make the scene dearer
  // than what lets it keep its rate (Charge).
  messages::Result<void> change(std::uint64_t participant, const v1::ParameterChange& message, Role role);
  // Resets everything to the start, because a new simulation begins; drops all waiting changes. Returns the
  // change that announces it.
  v1::ParameterChange restart();

  // Sets the definition to `applied` plus the waiting changes. Returns the change that announces `applied`.
  v1::ParameterChange revertTo(const model::Scene& applied);

  // Description for a peer that joins now. The peer must be a subscriber already, so that it misses no
  // change.
  std::shared_ptr<const delivery::DescriptionChunks> description();

  // Tells the subscribers that are connected to this server which surfaces of real rooms there are, if that
  // has changed since the last call. Belongs to one thread. Recordings and other servers get nothing of it.
  void announceSurfaces();

  // Counts a change of parameters, a pause or a reset by this participant, 0 for peers outside the scene, or
  // returns why there are too many (ChangeLimits). `call` begins the text.
  messages::Result<void> countChange(std::uint64_t participant, const char* call) {
    return definition_.countChange(participant, call);
  }

  SceneTerms terms;                           // set before other threads know the scene
  const std::shared_ptr<Journal> journal;     // null: the scene has none
  const std::shared_ptr<FrameSource> source;  // null: the scene is simulated
  // Takes checkpoints; null: the scene does not survive the end of the server. Set before the scene runs.
  std::shared_ptr<SceneKeeper> keeper;
  std::atomic<bool> paused{false};          // no ticks, except for the first frame after a reset
  std::atomic<bool> resetRequested{false};  // taken at the next tick

  Inbox inbox;
  delivery::Subscribers subscribers;
  RoomSurfaces surfaces;  // of the real rooms of participants
  NewestPoses poses;
  Roster roster;
  telemetry::SceneMetrics metrics;

  // Returns whether the scene has had no participant for this long, not even a disconnected one. Belongs to
  // one thread.
  bool hasBeenEmptyFor(std::chrono::milliseconds time, Clock::time_point now);

  // Written by the device's thread, or by the source.
  std::atomic<bool> running{false};
  std::atomic<std::uint64_t> tick{0};      // newest complete one
  std::atomic<std::uint32_t> restarts{0};  // calls of restart(), after which ticks begin with 1 again
  std::atomic<schedule::WorkLevel>
      work;  // of the newest tick; less than allWork() while the device is overloaded

 private:
  PricedDefinition definition_;

  mutable std::mutex mutex_;
  std::shared_ptr<const Restored> restored_;
  Quarantine quarantine_;

  std::uint64_t announcedSurfaces_ = 0;  // version of `surfaces` in the newest announceSurfaces()

  std::optional<Clock::time_point> emptySince_;  // of the newest call of hasBeenEmptyFor()
  std::unique_ptr<SceneObserver> observer_;
};

// Notice that a scene is paused, or resumed, as it is now; `participant` as for delivery::notice().
delivery::SharedBytes pausedNotice(const LiveScene& scene, std::uint64_t participant = 0);

// Notice of the work that a scene does, of a change at `tick` or to a peer that joins.
delivery::SharedBytes workNotice(const LiveScene& scene, std::uint64_t tick);

}  // namespace clothstream::scene

// SPDX-License-Identifier: MIT
// One scene on the device's thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "server/hosting/harm_policy.h"
#include "server/hosting/loss_blame.h"
#include "server/hosting/owned_device.h"
#include "server/hosting/rebuild_policy.h"
#include "server/hosting/scene_movement.h"
#include "server/hosting/scene_state.h"
#include "server/model/price.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_host.h"
#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"
#include "server/schedule/overload_policy.h"
#include "server/schedule/price_watch.h"
#include "server/schedule/slow_watch.h"
#include "server/schedule/tick_scheduler.h"

namespace clothstream::hosting {

// Belongs to the device's thread. release(), giveUp() and quarantine() wait until the frames of the scene are
// published, and so does its end.
class SceneRun : public schedule::TickSchedule {
 public:
  explicit SceneRun(std::shared_ptr<scene::LiveScene> live);
  // Stops loading.
  ~SceneRun() { loading_.stop.request_stop(); }
  SceneRun(const SceneRun&) = delete;
  SceneRun& operator=(const SceneRun&) = delete;

  SceneState state() const { return state_; }
  // Changes the state. mayBecome() must allow it, or it is the present one.
  void become(SceneState next);

  // Returns whether the scene is to be loaded.
  bool needsLoading(Clock::time_point now) const;
  // Begins to load the scene onto the device.
  void load(OwnedDevice& device);
  // Returns whether takeLoaded() has something that can begin to run, or to wait for start().
  bool isLoaded() const;
  // Throws what the loader throws.
  std::unique_ptr<scene::SceneOnDevice> takeLoaded();
  // The scene waits for start().
  void keepPrepared(std::unique_ptr<scene::SceneOnDevice> loaded);
  // Stops the loader's work for the scene, and drops what it has made. The loader may use the device until
  // SceneLoader::wait() has returned.
  void abandonLoading();
  // Returns whether the loader works for the scene.
  bool usesLoader() const;

  // Lets a scene on the device run, pause or rest, as its subscribers need it. With `runAlways` it needs
  // none. `mustWait`: it must not use the device now.
  void startOrStop(Clock::time_point now, bool runAlways, bool mustWait);
  // Time at which the scene next needs the thread.
  Clock::time_point due() const;
  // Begins a tick, whose price is that on a device of this speed. Throws what SceneHost::begin() throws.
  void beginTick(Clock::time_point now, const model::DeviceSpeed& speed);
  // The tick that has begun is not continued, because the device was lost.
  void dropTick();
  // Ends the ticks of the scene, because it moves to another server.
  void stand();
  // State after the newest tick; nothing if there was none. Throws what SceneHost::stateNow() throws, and
  // std::runtime_error if the scene does not run now.
  std::optional<scene::Checkpoint> stateNow();

  // Releases everything on the device. The scene will be loaded again.
  void release();
  // Gives the scene up and dismisses its participants. The next join starts it from the beginning.
  void giveUp(const std::string& why);
  // Stops the scene for good. `text` is the last message to its participants.
  void quarantine(const std::string& text);

  const std::shared_ptr<scene::LiveScene> scene;
  std::unique_ptr<scene::SceneHost> host;  // once the scene was loaded

  Arrival arrival;
  Departure departure;
  LossBlame blame;
  HarmPolicy harm;
  RebuildPolicy rebuilds;
  schedule::PriceWatch price;
  schedule::OverloadPolicy overload;
  Clock::time_point nextPausedFrame{};  // next check for subscribers that need a key frame, while paused

  // The current tick, or the newest one.
  struct Tick {
    double price = 0;            // s
    double slippedTicks = 0;     // ticks by which simulated time fell behind before it
    Clock::duration used{};      // its time on the device
    Clock::time_point served{};  // end of the newest slice
  } tick;

 private:
  // Adds slipped ticks, and returns the whole ticks that are not counted yet.
  std::uint64_t wholeSlippedTicks(double ticks);

  SceneState state_ = SceneState::asleep;
  struct Loading {
    scene::SceneLoader::Future future;  // valid while it is loaded
    std::stop_source stop;
    std::unique_ptr<scene::SceneOnDevice> prepared;
  } loading_;
  schedule::SlowWatch slow_;
  double slippedTicks_ = 0;  // that are not counted yet, below 1
};

}  // namespace clothstream::hosting

// SPDX-License-Identifier: MIT
// Thread that owns the device and runs the ticks of every scene when they are due.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/delivery/frame_publisher.h"
#include "server/hosting/owned_device.h"
#include "server/hosting/scene_run.h"
#include "server/hosting/simulated_faults.h"
#include "server/hosting/task_inbox.h"
#include "server/hosting/tick_batches.h"
#include "server/scene/budget.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_host.h"
#include "server/schedule/tick_scheduler.h"
#include "server/telemetry/metrics.h"
#include "server/vulkan/device.h"

namespace clothstream::hosting {

using schedule::Clock;

// Thread-safe.
//
// Ticks that are due together are all submitted before the first is waited for, and the short ones together
// (TickBatches). Between the slices of a long tick, those that became due run, scenes are added and removed,
// and the thread can end. A scene is loaded onto the device when it is first joined, on another thread while
// other scenes run. A scene without subscribers sleeps.
//
// Device loss: a new device is created. This is tried once a second until it succeeds. The scenes are then
// loaded again one by one, the default scene first, then those with the most subscribers. Each continues from
// its newest snapshot on the CPU as soon as it is loaded, while others are still being loaded. If a tick
// fails in another way, only its scene is rebuilt like this, or given up (RebuildPolicy): all participants
// are dismissed, and the next join starts it from the beginning. Any other error belongs to no scene, and
// costs a short pause.
//
// With `adaptsToLoad`, a scene whose ticks do not fit its share of the device does less work
// (schedule::OverloadPolicy).
//
// A scene harms others if it takes far more than its price (schedule::PriceWatch), also in the middle of a
// tick, or if it is to blame for losses of the device (LossBlame). It is then stopped: given up, and perhaps
// refused to later participants for some time or for good (HarmPolicy). A scene that add() loads is refused
// if the device is lost meanwhile.
class DeviceThread {
 public:
  // Returns when the device and the first scene are ready, and the budget knows the device's speed. Without
  // scenes there is no device, and none can be added. All arguments but the scenes must outlive the thread.
  // Throws what the device or the first scene throws.
  DeviceThread(const vulkan::DeviceOptions& device,
               const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
               delivery::FramePublisher& publisher, telemetry::ServerMetrics& metrics, scene::Budget& budget,
               bool runAlways, double reportRate, bool adaptsToLoad = true);
  // Ends after the ticks in flight.
  ~DeviceThread();
  DeviceThread(const DeviceThread&) = delete;
  DeviceThread& operator=(const DeviceThread&) = delete;

  // Call after a subscriber joined or left, or a scene was paused, resumed or reset.
  void wake() { inbox_.wake(); }
  // The same for one scene. A scene that is not simulated has a source, which is woken instead.
  void wake(const scene::LiveScene& scene);

  // Loads a scene that a peer created, and adds it. The future is ready when the scene is. It throws what the
  // device or the scene throws, or std::future_error if the thread ends first; then nothing has changed.
  std::future<void> add(std::shared_ptr<scene::LiveScene> scene);
  // Loads a scene that another server has, and waits for start(). The future is as for add().
  std::future<void> prepare(std::shared_ptr<scene::LiveScene> scene);
  // Begins to run a prepared scene, from the state that was given to LiveScene::restore() meanwhile. The
  // future is as for add().
  std::future<void> start(std::shared_ptr<scene::LiveScene> scene);
  // Ends the ticks of a scene that moves to another server. If it runs, one more tick takes the inputs that
  // were posted before. The future has the state after the newest tick, or nothing if there was none. It
  // throws if the scene cannot be held now, and then the scene goes on.
  std::future<std::optional<scene::Checkpoint>> hold(std::shared_ptr<scene::LiveScene> scene);
  // The same state, of a scene that goes on.
  std::future<std::optional<scene::Checkpoint>> read(std::shared_ptr<scene::LiveScene> scene);
  // Lets a held scene go on.
  void unhold(std::shared_ptr<scene::LiveScene> scene);
  // Adds a scene that is loaded when it is first joined.
  void adopt(std::shared_ptr<scene::LiveScene> scene);
  // The future is ready when the scene is no longer used.
  std::future<void> remove(std::shared_ptr<scene::LiveScene> scene);

  vulkan::DeviceInfo info() const { return device_.info(); }

  // Time at which the thread last looked for work. It does so after each wake().
  Clock::time_point lastAnswer() const { return lastAnswer_; }
  // Memory of all buffers on the device at that time, and of the allocations that they share, in bytes.
  std::uint64_t deviceMemory() const { return deviceMemory_; }
  std::uint64_t reservedDeviceMemory() const { return reservedDeviceMemory_; }

  // Treats the device as lost before the next tick. For tests.
  void simulateDeviceLoss() {
    faults_.loseDevice();
    wake();
  }
  // Treats the device as lost whenever it has loaded this scene, or has worked on a tick or a paused frame of
  // it. An empty name ends this. For tests.
  void simulateDeviceLossIn(std::string scene) { faults_.loseDeviceIn(std::move(scene)); }
  // Throws another error the next times that it has done so. For tests.
  void simulateFailuresIn(std::string scene, int times) { faults_.failIn(std::move(scene), times); }
  // Throws an error that belongs to no scene, once before the next tick. For tests.
  void simulateFailure() {
    faults_.fail();
    wake();
  }
  // Throws an error when the next batch of ticks is to be submitted, once. Before that it acts as
  // simulateFailure(), whose pause lets ticks become due together. For tests.
  void simulateFailedBatch() {
    faults_.failBatch();
    simulateFailure();
  }

 private:
  void run(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes, std::promise<void>& ready);
  std::future<void> load(std::shared_ptr<scene::LiveScene> scene, bool waits);
  std::future<Departure::State> read(std::shared_ptr<scene::LiveScene> scene, bool holds);
  // The run of this scene; null if there is none.
  SceneRun* runOf(const scene::LiveScene& scene) const;
  // Schedules of all scenes, valid until the next call.
  std::span<schedule::TickSchedule* const> schedules();

  // Returns false when the thread must end.
  bool waitForWork();
  // Begins to run loaded scenes.
  void takeLoadedScenes();
  // Throws vulkan::DeviceLost, and counts that as the scene's.
  void take(SceneRun& run);
  // Makes the host of a scene that is loaded, or gives it the new device.
  void begin(SceneRun& run, std::unique_ptr<scene::SceneOnDevice> loaded);
  void startAndStopScenes();
  // The scene that is being loaded, else the one to load next: the default scene first, then the one with the
  // most subscribers. Null if no scene waits. One is loaded at a time, so that it is known which one the
  // device works on.
  SceneRun* sceneToLoad(Clock::time_point now) const;
  // Encodes frames of paused scenes for subscribers that need a key frame.
  void encodePausedFrames();
  void runDueTicks();
  // Begins the ticks of these runs, on several threads if they are many.
  void beginTicks(std::span<schedule::TickSchedule* const> due, Clock::time_point& deviceFree);
  // Submits the ticks of `chosen_` that have begun.
  void submitTicks(bool oneByOne);
  // Waits for all ticks that are in flight. The device was busy until `deviceFree`.
  void waitForTicks(Clock::time_point deviceFree);
  // Runs one slice of a tick that has begun and takes longer than a slice.
  void runSlice();
  // Answers hold() and read().
  void readStates();

  // Runs a part of a tick. Returns false if it failed; the scene is then rebuilt. Throws vulkan::DeviceLost,
  // and counts that as the scene's.
  bool survives(SceneRun& run, const std::function<void()>& partOfTick);
  // Calls `part`, which is best a std::ref, so that it allocates nothing, with each number below `count`, on
  // several threads if they are many. Keeps what it throws in `failures_`.
  void runParts(std::size_t count, const std::function<void(std::size_t)>& part);
  // Throws what the part with this number threw.
  void checkPart(std::size_t part) const;
  // Waits for a batch that was submitted when the device was busy until `deviceFree`.
  void waitForBatch(TickBatches::Members& batch, Clock::time_point& deviceFree);
  // Waits for the first slice of a tick that began when the device was busy until `deviceFree`.
  void waitForFirstSlice(SceneRun& run, Clock::time_point& deviceFree);
  // The device worked for this time on the tick. Returns whether the tick takes too long already.
  bool noteSlice(SceneRun& run, Clock::duration time);
  // The same. Finishes the tick if it has no more slices.
  void endSlice(SceneRun& run, Clock::duration time);
  // The tick is finished.
  void endTick(SceneRun& run);
  // Gives the time of this thread at the start of a tick to the scene, other than its commands.
  void chargeMaking(SceneRun& run, Clock::time_point& deviceFree);
  // Lets the scene do less work if it overloads the device, and more if there is room again.
  void adaptToLoad(SceneRun& run, Clock::time_point now);
  // Notes what else than ticks the device and this thread work for.
  void noteDisturbances();
  // Stops the scene if it takes far more than its price; it may be in the middle of a tick, with no slice in
  // flight. `isLate`: PriceWatch says so, on a device of the speed that it assumes; that speed is then
  // measured. Throws vulkan::DeviceLost.
  void checkPrice(SceneRun& run, bool isLate);

  // Stops a scene that harms others, for this time or for good (HarmPolicy).
  void stop(SceneRun& run, std::optional<Clock::duration> pause, const std::string& why);
  // Counts a loss of the device, which was noticed at the work for this scene.
  void countLoss(const SceneRun& noticed);
  void rebuildScene(SceneRun& run, const std::string& reason);
  void rebuildDevice(const std::string& reason);
  bool tryRebuildDevice();
  // Stops loading, and waits for the loader.
  void abandonLoading();
  // Gives the states of all scenes to their keepers, because the thread ends. Ends short ticks first.
  void saveLast();

  delivery::FramePublisher& publisher_;
  telemetry::ServerMetrics& metrics_;
  scene::Budget& budget_;
  const bool runAlways_;
  const double reportRate_;
  const bool adaptsToLoad_;

  TaskInbox inbox_;
  SimulatedFaults faults_;
  // Written by the thread alone.
  std::atomic<Clock::time_point> lastAnswer_{Clock::now()};
  std::atomic<std::uint64_t> deviceMemory_{0}, reservedDeviceMemory_{0};

  // Owned by the thread.
  OwnedDevice device_;
  std::vector<std::unique_ptr<SceneRun>> runs_;
  schedule::TickScheduler scheduler_{scene::SceneHost::kSliceTime};
  std::vector<schedule::TickSchedule*> schedules_, chosen_;  // of runs_
  TickBatches batches_;
  std::vector<SceneRun*> together_;           // ticks of a batch
  std::vector<std::exception_ptr> failures_;  // of the newest runParts()
  bool isDisturbed_ = false;                  // the loader works
  bool isMaking_ = false;   // a change has held this thread up in the present tick of its scene
  Clock::duration idle_{};  // time without work for the device

  std::thread thread_;
};

}  // namespace clothstream::hosting

// SPDX-License-Identifier: MIT
// Thread that owns the device and runs the ticks of every scene when they are due.
#pragma once

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "server/delivery/frame_publisher.h"
#include "server/scene/budget.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_host.h"
#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"
#include "server/schedule/back_off.h"
#include "server/schedule/overload_policy.h"
#include "server/schedule/price_watch.h"
#include "server/schedule/slow_watch.h"
#include "server/schedule/tick_scheduler.h"
#include "server/simulation/speed_meter.h"
#include "server/telemetry/metrics.h"
#include "server/vulkan/device.h"

namespace clothstream::hosting {

using schedule::Clock;

// Thread-safe.
//
// Ticks that are due together are all submitted before the first is waited for. Between the slices of a long
// tick, those that became due run, scenes are added and removed, and the thread can end. A scene is loaded
// onto the device when it is first joined, on another thread while other scenes run. A scene without
// subscribers sleeps.
//
// Device loss: a new device is created. This is tried once a second until it succeeds. The scenes are then
// loaded again one by one, the default scene first, then those with the most subscribers. Each continues from
// its newest snapshot on the CPU as soon as it is loaded, while others are still being loaded. If a tick
// fails in another way, only its scene is rebuilt like this. Any other exception, such as for a lack of
// memory, costs a short pause. A scene is given up if a tick fails again within a simulated second, or if
// rebuilding it fails twice: all participants are dismissed, and the next join starts it from the beginning.
//
// With `adaptsToLoad`, a scene whose ticks do not fit its share of the device does less work
// (schedule::OverloadPolicy).
//
// A scene is put into quarantine if it takes far more than its price (schedule::PriceWatch), also in the
// middle of a tick, or if the device is lost twice within kLossWindow while it works on this scene: runs a
// tick, or loads it. A scene that the server started with gets a second chance, because a participant may be
// the reason: the first time it is given up, so that the next join starts it with its own parameters. If it
// takes more than its price again, it can be joined again after kComebackPause, and after twice that each
// time, up to kLongestPause. A scene that add() loads is refused if the device is lost meanwhile.
//
// If the device worked on several scenes when it was lost, none of them is to blame yet. If that happens
// again within kLossWindow, each of them runs alone for kLossWindow: the device works on nothing else
// meanwhile.
class DeviceThread {
 public:
  static constexpr std::chrono::seconds kLossWindow{60};
  static constexpr std::chrono::seconds kComebackPause{10}, kLongestPause{600};

  // Returns when the device and the first scene are ready, and the budget knows the device's speed. Without
  // scenes there is no device, and none can be added. All arguments must outlive the thread. Throws what the
  // device or the first scene throws.
  DeviceThread(const vulkan::DeviceOptions& device,
               const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
               delivery::FramePublisher& publisher, telemetry::ServerMetrics& metrics, scene::Budget& budget,
               bool runAlways, double reportRate, bool adaptsToLoad = true);
  // Ends after the ticks in flight.
  ~DeviceThread();
  DeviceThread(const DeviceThread&) = delete;
  DeviceThread& operator=(const DeviceThread&) = delete;

  // Call after a subscriber joined or left, or a scene was paused, resumed or reset.
  void wake();

  // Loads a scene and adds it. The future is ready when the scene is. It throws what the device or the scene
  // throws, or std::future_error if the thread ends first; then nothing has changed.
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

  vulkan::DeviceInfo info() const;

  // Time at which the thread last looked for work. It does so after each wake().
  Clock::time_point lastAnswer() const { return lastAnswer_; }
  // Memory of all buffers on the device at that time, in bytes.
  std::uint64_t deviceMemory() const { return deviceMemory_; }

  // Treats the device as lost before the next tick. For tests.
  void simulateDeviceLoss();
  // Treats the device as lost whenever it has loaded this scene or has worked on a tick of it. An empty name
  // ends this. For tests.
  void simulateDeviceLossIn(std::string scene);
  // Throws an exception that belongs to no scene, once before the next tick. For tests.
  void simulateFailure();

 private:
  struct Run : schedule::TickSchedule {
    explicit Run(std::shared_ptr<scene::LiveScene> live)
        : TickSchedule(live->start().simulationRate, live->isGuest()),
          scene(std::move(live)),
          overload(scene->start().streamRate, scene->start().substeps) {}
    ~Run() { stopLoading.request_stop(); }
    Run(const Run&) = delete;
    Run& operator=(const Run&) = delete;
    // Adds slipped ticks, and returns the whole ticks that are not counted yet.
    std::uint64_t wholeSlippedTicks(double ticks) {
      slipped += ticks;
      const double whole = std::floor(slipped);
      slipped -= whole;
      return static_cast<std::uint64_t>(whole);
    }

    // Returns whether the loader works for the scene.
    bool loads() const { return loading.valid() || (host && host->isRehearsing()); }
    // Returns whether the scene is to be loaded.
    bool needsDevice() const {
      const bool wanted = scene->subscribers.receivers(Clock::now()) > 0 || host || whenAdded || waits;
      return wanted && !prepared && !begun && !quarantined && !(host && host->isReady());
    }

    // Time at which the scene next needs the thread.
    Clock::time_point due() const {
      if (begun) return {};  // now
      if (running) return pacer.due();
      return paused ? nextPausedFrame : Clock::time_point::max();
    }

    std::shared_ptr<scene::LiveScene> scene;
    scene::SceneLoader::Future loading;              // valid while it is loaded
    std::stop_source stopLoading;                    // of `loading`
    std::unique_ptr<scene::SceneHost> host;          // once it is loaded
    std::optional<std::promise<void>> whenAdded;     // set by add(), until the scene is ready
    bool waits = false;                              // for start()
    std::unique_ptr<scene::SceneOnDevice> prepared;  // loaded, while it waits
    std::optional<std::promise<std::optional<scene::Checkpoint>>> whenRead;  // set by hold() and read()
    std::uint64_t readAt = 0;                                                // tick of this state
    bool holds = false;                                                      // for hold()
    bool held = false;                                                       // it runs no ticks
    bool quarantined = false;
    bool refused = false;                         // added, but cannot run
    Clock::duration used{};                       // time of the current tick on the device
    Clock::time_point served{};                   // end of the newest slice
    bool paused = false;                          // while it has subscribers
    Clock::time_point nextPausedFrame{};          // next check for subscribers that need a key frame
    const char* rebuiltAfter = "";                // event after which the host is rebuilt
    std::optional<std::uint64_t> failed;          // tick count at the newest failure
    bool rebuildFailed = false;                   // since the newest failure
    bool inFlight = false;                        // the device works on a slice of its tick
    std::optional<Clock::time_point> lostDevice;  // newest loss while the device worked on this scene
    bool lostDeviceTwice = false;                 // within kLossWindow, the second time on it alone
    Clock::time_point aloneUntil{};  // the device works on nothing else while it works on this scene
    bool hasLostDevice = false;      // it was given up once instead of a quarantine
    schedule::BackOff comeback{kComebackPause, kLongestPause};
    schedule::SlowWatch slow;
    schedule::PriceWatch price;
    double tickPrice = 0;  // s, of the newest tick
    schedule::OverloadPolicy overload;
    double slippedBefore = 0;  // ticks by which simulated time fell behind before the current tick
    double slipped = 0;        // ticks that are not counted yet, below 1
  };

  void run(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes, std::promise<void>& ready);
  std::future<void> post(std::packaged_task<void()> task);
  void runTasks();
  // Returns false when the thread must end.
  bool waitForWork();
  void startAndStopScenes();
  // The scene that is being loaded, else the one to load next: the default scene first, then the one with the
  // most subscribers. Null if no scene waits. One is loaded at a time, so that it is known which one the
  // device works on.
  Run* sceneToLoad() const;
  // Stops loading, and waits for the loader.
  void abandonLoading();
  // Creates the hosts of loaded scenes.
  void takeLoadedScenes();
  // Throws vulkan::DeviceLost, and counts that as the scene's.
  void take(Run& run);
  std::future<std::optional<scene::Checkpoint>> read(std::shared_ptr<scene::LiveScene> scene, bool holds);
  // Fulfils the promises of hold() and read().
  void readStates();
  // Gives the states of all scenes to their keepers, because the thread ends. Ends short ticks first.
  void saveLast();
  // Gives the speed of a new device to the budget.
  void measureSpeed();
  // Lets the scene do less work if it overloads the device, and more if there is room again.
  void adaptToLoad(Run& run, Clock::time_point now);
  // Puts the scene into quarantine if it takes far more than its price; it may be in the middle of a tick,
  // with no slice in flight. `isLate`: PriceWatch says so, on a device of the speed that it assumes. Throws
  // vulkan::DeviceLost.
  void checkPrice(Run& run, bool isLate);
  // Returns whether the device works for anything but ticks.
  bool isDisturbed() const;
  // Whether a change of any scene has held this thread up in that scene's present tick.
  bool isMaking() const;
  // Gives the time of this thread at the start of a tick to the scene, other than its commands.
  void chargeMaking(Run& run, Clock::time_point& deviceFree);
  // Stops a scene that takes far more than its price. A scene of the server comes back.
  void stop(Run& run, const std::string& why);
  // Stops a scene for good; a scene of the server is only given up the first time.
  void quarantine(Run& run, const std::string& why);
  // Makes the host of a scene that is loaded, or gives it the new device.
  void begin(Run& run, std::unique_ptr<scene::SceneOnDevice> loaded);
  // Lets a new host that continues from a checkpoint keep the checkpoint's work.
  void continueOverload(Run& run);
  // Gives the scene up and dismisses its participants.
  void dismiss(Run& run, const std::string& why);
  // Encodes frames of paused scenes for subscribers that need a key frame.
  void encodePausedFrames();
  // Schedules of all scenes, valid until the next call.
  std::span<schedule::TickSchedule* const> schedules();
  void runDueTicks();
  // Reports a failure that belongs to no scene, such as a lack of memory. Nothing is lost by it.
  static void endure(const std::exception& failure);
  // Waits for the first slice of a tick that began when the device was busy until `deviceFree`.
  void waitForFirstSlice(Run& run, Clock::time_point& deviceFree);
  // Runs one slice of a tick that has begun and takes longer than a slice.
  void runSlice();
  // Accounts for the time since `before`, and finishes the tick if it has no more slices.
  void endSlice(Run& run, Clock::time_point before);
  // Runs a part of a tick. Returns false if it failed; the scene is then rebuilt. Throws vulkan::DeviceLost,
  // and counts that as the scene's.
  bool survives(Run& run, const std::function<void()>& partOfTick);
  // Throws vulkan::DeviceLost if simulateDeviceLossIn() asks for that.
  void checkSimulatedLoss(const Run& run) const;
  // Counts a loss of the device, which was noticed at the work for this scene.
  void countLoss(const Run& noticed);
  void rebuildScene(Run& run, const std::string& reason);
  void begin(Run& run, Clock::time_point now);
  // The run of this scene; null if there is none.
  Run* runOf(const scene::LiveScene& scene) const;
  void rebuildDevice(const std::string& reason);
  bool tryRebuildDevice();
  // Prepares all scenes that were on the former device for being loaded again.
  void reloadScenes();

  const vulkan::DeviceOptions options_;
  delivery::FramePublisher& publisher_;
  telemetry::ServerMetrics& metrics_;
  scene::Budget& budget_;
  const bool runAlways_;
  const double reportRate_;
  const bool adaptsToLoad_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Initially woken, because a scene may run without subscribers.
  bool stopping_ = false, woken_ = true, loseDevice_ = false, fail_ = false;
  std::string losesDeviceIn_;
  vulkan::DeviceInfo info_;
  std::vector<std::packaged_task<void()>> tasks_;

  // Written by the thread alone.
  std::atomic<Clock::time_point> lastAnswer_{Clock::now()};
  std::atomic<std::uint64_t> deviceMemory_{0};

  // Owned by the thread.
  std::unique_ptr<vulkan::Device> device_;
  std::unique_ptr<simulation::SpeedMeter> meter_;  // of device_
  model::DeviceSpeed speed_;                       // of device_ when it was new
  std::vector<std::unique_ptr<Run>> runs_;
  schedule::TickScheduler scheduler_{scene::SceneHost::kSliceTime};
  std::vector<schedule::TickSchedule*> schedules_, chosen_;  // of runs_
  scene::SceneLoader loader_;                                // for device_
  Clock::duration idle_{};                                   // time without work for the device
  Clock::time_point nextRebuild_{};                          // earliest time of the next rebuild

  std::thread thread_;
};

}  // namespace clothstream::hosting

// SPDX-License-Identifier: MIT
// The one thread that owns the device: it runs the ticks of every scene when they are due.
#pragma once

#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/stream/frame_packer.h"
#include "server/stream/live_scene.h"
#include "server/stream/scene_host.h"
#include "server/stream/scene_preparer.h"
#include "server/stream/slow_watch.h"
#include "server/stream/turns.h"
#include "server/telemetry/metrics.h"
#include "server/vulkan/device.h"

namespace clothstream::stream {

// Thread-safe. Scenes that are due together are all submitted before the first is waited for. A scene takes
// room on the device from when somebody first joins it, and sleeps while nobody is in it; it is made ready on
// another thread, while the others run. When the device is lost, another is made and every scene goes on from
// the newest state that the CPU has; this is tried once a second until it succeeds. Where a tick fails
// otherwise, its scene alone is made anew so. It is given up where a tick fails again within a simulated
// second, or where making it anew fails twice: everybody in it leaves, and who joins it later has it from its
// start.
class DeviceThread {
 public:
  // Device and first scene are ready when it returns; without scenes there is no device, and none can be
  // added. All arguments outlive it. Throws what the device or the
  // first scene throws.
  DeviceThread(const vulkan::DeviceOptions& device, const std::vector<std::shared_ptr<LiveScene>>& scenes,
               FramePacker& packer, telemetry::ServerMetrics& metrics, bool runAlways, double reportRate);
  // Ends after the ticks in flight.
  ~DeviceThread();
  DeviceThread(const DeviceThread&) = delete;
  DeviceThread& operator=(const DeviceThread&) = delete;

  // Somebody joined or left, or a scene is to be paused, go on or begin anew.
  void wake();

  // A scene, once it is ready. The future throws what the device or the scene throws, and std::future_error
  // where the thread ends before; nothing has changed then.
  std::future<void> add(std::shared_ptr<LiveScene> scene);
  // The scene is held no more when the future is ready.
  std::future<void> remove(std::shared_ptr<LiveScene> scene);

  vulkan::DeviceInfo info() const;

  // Before the next tick the device is treated as lost, with all that follows.
  void simulateDeviceLoss();

 private:
  struct Run : Turn {
    explicit Run(std::shared_ptr<LiveScene> live)
        : Turn(live->start().simulationRate), scene(std::move(live)) {}
    // Of what was given up so far, the whole ticks that are not counted yet.
    std::uint64_t wholeSlippedTicks(double given) {
      slipped += given;
      const double whole = std::floor(slipped);
      slipped -= whole;
      return static_cast<std::uint64_t>(whole);
    }

    // When something may be to be done for it.
    Clock::time_point due() const {
      if (running) return pacer.due();
      return stands ? nextLook : Clock::time_point::max();
    }

    std::shared_ptr<LiveScene> scene;
    ScenePreparer::Coming coming;                 // while it is made ready
    std::unique_ptr<SceneHost> host;              // once it is
    std::optional<std::promise<void>> whenAdded;  // until then, where it was added
    bool refused = false;                         // it was added, and cannot run
    bool begun = false;                           // the tick in hand
    bool stands = false;                          // its clock, while somebody is in it
    Clock::time_point nextLook{};                 // whether one of them sees nothing
    std::optional<std::uint64_t> failed;          // of its ticks, after how many one last did
    bool triedAnew = false;                       // since then it could not be made anew
    SlowWatch slow;
    double slipped = 0;
  };

  void run(const std::vector<std::shared_ptr<LiveScene>>& scenes, std::promise<void>& ready);
  std::future<void> post(std::packaged_task<void()> task);
  void runTasks();
  // False when it is time to end.
  bool waitForWork();
  void startAndStopScenes();
  // What was made ready meanwhile gets its host.
  void takeReadyScenes();
  // Or who asked for it is told that the device cannot run it. Throws vulkan::DeviceLost.
  void take(Run& run);
  // Gives it up.
  void dismiss(Run& run, const std::string& why);
  // Where their clocks stand, for who sees nothing yet.
  void showScenes();
  void runDueTicks();
  // False where it failed: its scene is made anew then. Throws vulkan::DeviceLost.
  bool survives(Run& run, const std::function<void()>& partOfTick);
  void makeAnew(Run& run, const std::string& reason);
  void begin(Run& run, Clock::time_point now);
  void rebuild(const std::string& reason);
  bool tryRebuild();

  const vulkan::DeviceOptions options_;
  FramePacker& packer_;
  telemetry::ServerMetrics& metrics_;
  const bool runAlways_;
  const double reportRate_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Woken from the start: a scene may run with nobody in it.
  bool stopping_ = false, woken_ = true, loseDevice_ = false;
  vulkan::DeviceInfo info_;
  std::vector<std::packaged_task<void()>> tasks_;

  // The thread's own.
  std::unique_ptr<vulkan::Device> device_;
  std::vector<std::unique_ptr<Run>> runs_;
  std::vector<Turn*> turns_, chosen_;  // of runs_
  ScenePreparer preparer_;             // for device_
  Clock::time_point nextRebuild_{};    // not before

  std::thread thread_;
};

}  // namespace clothstream::stream

// SPDX-License-Identifier: MIT
// One scene on the device: its ticks, frames, checkpoints, and the ways back when something went wrong.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/cloth_simulation.h"
#include "server/stream/collider_set.h"
#include "server/stream/contact_log.h"
#include "server/stream/frame_packer.h"
#include "server/stream/hold_set.h"
#include "server/stream/live_scene.h"
#include "server/stream/pose_history.h"
#include "server/stream/scene_on_device.h"
#include "server/stream/token_bucket.h"
#include "server/vulkan/device.h"

namespace clothstream::stream {

// Belongs to the device's thread. A tick is begin(), then finish(); between the two the device works. Tick n
// ends at the simulated time n / simulation rate; ticks only ever count up, whatever happens to the state.
//
// What can be lost is bounded: every second of healthy ticks the state is kept on the device (a state that
// went bad goes back to it), every five seconds on the CPU (a lost device goes on from there). A state that
// goes bad twice within a second goes back to the start, parameters included.
class SceneHost {
 public:
  // Who goes on decoding a quality gets at most one key frame of it in this time, whoever asks: one serves
  // all who wait.
  static constexpr std::chrono::milliseconds kKeyFrameInterval{100};

  // With a journal, a key frame comes after at most so many that are not.
  static constexpr std::uint32_t kFramesAKeyFrame = 24;

  // Of frames with a report, a second.
  static constexpr double kReportRate = 4;

  // All outlive it. `reportRate` 0: no frame has one. Throws std::runtime_error where the device has no room
  // for the scene.
  SceneHost(vulkan::Device& device, LiveScene& scene, FramePacker& packer, double reportRate = kReportRate);
  // `ready`: the scene's start.
  SceneHost(std::unique_ptr<SceneOnDevice> ready, LiveScene& scene, FramePacker& packer, double reportRate);
  ~SceneHost();

  LiveScene& scene() { return live_; }

  // Drains the inbox, records the next tick and submits it. Throws vulkan::DeviceLost.
  void begin(Clock::time_point now);
  // Waits for it, and hands its frame on. Throws vulkan::DeviceLost.
  void finish();

  // The scene's clock stands: who cannot go on without a key frame gets one of the newest tick's state. There
  // is no tick, and nobody else notices. To be called now and then. Throws vulkan::DeviceLost.
  void show(Clock::time_point now);

  // Nobody is in the scene, or its clock stands: coarser qualities' encoders go.
  void rest();

  // Nothing of the device is held any more; nothing but rebuild() may follow, and isReady().
  void release();
  bool isReady() const { return onDevice_ != nullptr; }
  // Goes on there from the newest state that the CPU has. `ready`: the scene's start. `why`: such as "the
  // device was lost".
  void rebuild(std::unique_ptr<SceneOnDevice> ready, std::string_view why);

  // Of the newest complete tick.
  std::uint64_t tick() const { return tick_; }
  simulation::TickStatus status() const { return status_; }
  // The cloths went back to where they start, and no frame was due since.
  bool owesFrame() const { return owesFrame_; }

 private:
  // The cloths go back to where they start.
  void reset();
  // Where a journal is due, and the state can be told: it has the state before the next tick. Throws
  // vulkan::DeviceLost.
  void beginJournal();
  // Tells everybody when the scene begins and ends to be recorded.
  void watchJournal();
  void applyInputs();
  // False, and nothing changed, where the device has no room for what the change asks for: `problem` says
  // why.
  bool apply(const model::ParameterChange& change, std::string& problem);
  void takeBack(const std::string& reason);
  // Cloths that just got another solver are pulled to their springs' length over kGentleSeconds, not at once.
  void changeGently(model::Scene& changed);
  void endGentleness();
  void setCloths(const std::vector<model::Cloth>& cloths);
  void recordRecovery();
  // For the frame in hand: those of qualities that somebody wants, which have room for it.
  void chooseEncoders(Clock::time_point now);
  void recordFrame(Clock::time_point now);
  // What goes with the frame in hand, but for its report.
  void describeFrame(Clock::time_point start);
  void announceEvents();
  void recover();
  bool every(std::uint32_t seconds) const { return sinceHealthy_ % (std::uint64_t{seconds} * rate_) == 0; }

  LiveScene& live_;
  FramePacker& packer_;
  const std::uint32_t rate_;          // ticks/s
  const std::uint32_t ticksAFrame_;   // simulation rate / stream rate
  const std::uint64_t ticksAReport_;  // at least; 0: none

  model::Scene scene_;  // as of the tick in hand
  ColliderSet colliders_;
  HoldSet holds_;
  ContactLog contacts_;
  Inputs inputs_;
  PoseHistory poses_;
  simulation::TickInputs tickInputs_;
  std::vector<Clock::time_point> poseArrivals_;  // that no frame has shown yet

  std::vector<std::uint64_t> gentleUntil_;  // tick, a cloth

  std::uint64_t tick_ = 0;
  simulation::TickStatus status_;
  Recovery recovery_ = Recovery::none;         // before the next tick
  Recovery recovered_ = Recovery::none;        // before the tick in hand
  bool keepsState_ = false;                    // the tick in hand, on the device
  bool journalBegan_ = false;                  // before the tick in hand
  bool recorded_ = false;                      // and told so
  bool clothsChanged_ = false;                 // since the newest complete tick
  std::optional<std::uint64_t> lastRecovery_;  // tick
  std::uint64_t sinceHealthy_ = 0;             // healthy ticks since the start or the last recovery
  TokenBucket recoveryNotices_{1, 5};

  simulation::StateSnapshot newestState_;
  bool savesState_ = false;  // the tick in hand

  Clock::time_point tickStart_{};
  std::array<Clock::time_point, codec::kMaxQualities> lastKeyFrame_{};
  std::uint32_t sinceKeyFrame_ = 0;  // frames of the finest quality
  vulkan::TimelineValue submitted_ = 0;
  bool hasFrame_ = false;  // the tick in hand
  bool owesFrame_ = false;
  std::uint64_t nextReport_ = 0;  // tick
  CompleteFrame frame_;

  std::unique_ptr<SceneOnDevice> onDevice_;
};

}  // namespace clothstream::stream

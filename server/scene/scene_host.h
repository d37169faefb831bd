// SPDX-License-Identifier: MIT
// Runs one scene on the device: ticks, frames, checkpoints, and recovery from failures.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/frame_publisher.h"
#include "server/scene/checkpoint.h"
#include "server/scene/defaults.h"
#include "server/scene/inbox.h"
#include "server/scene/interaction.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_frames.h"
#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"
#include "server/scene/scene_parameters.h"
#include "server/scene/scene_recovery.h"
#include "server/scene/slices.h"
#include "server/scene/surface_preparation.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {

// Belongs to the device's thread, and to others while that one waits for them: begin() and finish() of
// different scenes may run at the same time. A tick is begin(), then finish(); the device works between. Tick
// n ends at the simulated time n / simulation rate. Tick numbers only grow, also after the state went back.
//
// A tick that takes longer than kSliceTime is submitted in slices of about this time (Slices), so that ticks
// of other scenes can run in between, and so that it can be dropped: after begin(), submitSlice() submits the
// next slice as long as hasSlices(), and waitForSlice() waits for it. A short tick can join a batch instead.
//
// The first host of a restored scene continues from its checkpoint, and every host gives checkpoints to the
// scene's keeper, if it has one.
//
// SceneRecovery bounds what is lost by an unhealthy state or with the device. Parameters stay, except for
// changes that may be the reason.
class SceneHost {
 public:
  static constexpr std::chrono::milliseconds kSliceTime = Slices::kTime;

  // All arguments must outlive the host. With `reportRate` 0 no frame carries a report. Changes of parameters
  // that need new kernels act as soon as `loader` has compiled them; at once if it is null. Throws
  // std::runtime_error if the device has no room for the scene.
  SceneHost(vulkan::Device& device, LiveScene& scene, delivery::FramePublisher& publisher,
            double reportRate = kDefaultReportRate, SceneLoader* loader = nullptr);
  // `loaded` holds the scene's start.
  SceneHost(std::unique_ptr<SceneOnDevice> loaded, LiveScene& scene, delivery::FramePublisher& publisher,
            double reportRate, SceneLoader* loader = nullptr);
  // Publishes the frames of the scene that wait.
  ~SceneHost();

  // Sets the work from the next tick on. Substeps are raised to leastSubsteps(). A change is announced.
  void setWork(const schedule::WorkLevel& work) { wantedWork_ = work; }
  // Work of the newest tick.
  const schedule::WorkLevel& work() const { return work_; }
  // Minimum number of substeps with which the scene is stable with its present parameters.
  std::uint32_t leastSubsteps() const { return leastSubsteps_; }

  // Drains the inbox and records the next tick. Throws vulkan::DeviceLost.
  void begin(Clock::time_point now);
  // Returns whether the tick may be submitted in a batch.
  bool fitsIntoBatch() const { return onDevice_->slices.fitsIntoBatch(); }
  // Returns whether no slice of the tick was submitted.
  bool isUnsubmitted() const { return onDevice_->slices.isUnsubmitted(); }
  // Adds the tick to a batch. finish() may be called when the batch is complete.
  void join(vulkan::Batch& batch) { onDevice_->slices.join(batch); }
  // Work of the tick, in kernel invocations (vulkan::Recorder::work).
  std::uint64_t recordedWork() const { return onDevice_->recorder.work(); }
  // Returns whether slices of the tick are not submitted yet.
  bool hasSlices() const { return onDevice_->slices.hasMore(); }
  // Waits for the submitted slice. The device was busy with other scenes until `deviceFree`. Throws
  // vulkan::DeviceLost.
  void waitForSlice(Clock::time_point deviceFree = {}) { onDevice_->slices.wait(deviceFree); }
  // Submits the next slice. Throws vulkan::DeviceLost.
  void submitSlice() { onDevice_->slices.submit(); }
  // Runs the rest of the tick, and hands its frame to the publisher. Throws vulkan::DeviceLost.
  void finish();

  // While the scene is paused: encodes the present state as a key frame for subscribers that need one to
  // continue. Runs no tick; other subscribers get nothing. Call it repeatedly. Throws vulkan::DeviceLost.
  void encodePausedFrame(Clock::time_point now);

  // Releases the encoders of the coarser qualities, when the scene is paused or has no subscribers.
  void releaseCoarseEncoders();

  // Releases everything on the device, once the scene's frames are published. After that only rebuild() and
  // isReady() may be called.
  void release();
  bool isReady() const { return onDevice_ != nullptr; }
  // Continues from the newest snapshot. `loaded` holds the scene's start. `why` begins the notice to the
  // subscribers, such as "the device was lost".
  void rebuild(std::unique_ptr<SceneOnDevice> loaded, std::string_view why);

  // Time that the newest complete tick needed, in seconds: on the device without waiting for other work, and
  // on this thread. Nothing if the device has no timer.
  std::optional<double> ownSeconds() const { return ownSeconds_; }
  // The part of it on the device.
  std::optional<double> deviceSeconds() const { return deviceSeconds_; }
  // Time of this thread that changes of cloths took at the start of the newest tick.
  Clock::duration makingTime() const { return parameters_.makingTime(); }
  // Returns whether changes wait for their kernels.
  bool isRehearsing() const { return parameters_.isRehearsing(); }
  // Stops the rehearsal of such changes. They go on waiting.
  void endRehearsal() { parameters_.endRehearsal(); }

  // Gives the state after the newest complete tick to the keeper, because the server ends. No tick may have
  // begun. Throws vulkan::DeviceLost.
  void saveLast();
  // The same state, for a scene that moves to another server; nothing before the first tick. Throws
  // std::runtime_error if the newest state will be replaced by an earlier one.
  std::optional<Checkpoint> stateNow();

  // Newest complete tick, and its status.
  std::uint64_t tick() const { return tick_; }
  simulation::TickStatus status() const { return status_; }
  // Colliders of the newest tick, those of participants included.
  std::size_t colliders() const { return interaction_.inputs().colliders.size(); }
  // Returns whether the cloths were reset and no frame has shown it yet.
  bool owesFrame() const { return frames_.owes(); }

 private:
  // Continues a restored scene.
  void continueFrom(const LiveScene::Restored& restored);
  // Gives the present parameters, work and snapshot to a device that holds the scene's start.
  void continueOn(SceneOnDevice& on);
  // Reads the state after the newest complete tick into `snapshot_`.
  void readState();
  // The state after the newest complete tick, which `snapshot_` holds.
  Checkpoint checkpoint() const;

  // The following are the parts of begin(). If a journal is due and the state can be recorded, gives it that
  // state.
  void beginJournalIfDue();
  void beginJournal(const simulation::StateSnapshot& state);
  // The next tick starts from the scene's start.
  void reset();
  void applyInputs();
  void applyChanges();
  // Takes surfaces of the real room that have changed.
  void takeSurfaces();
  // The simulation, if it is ready for the surfaces; null if it is not, or if there are none.
  const simulation::ClothSimulation* readyForSurfaces();
  // Begins the work that setWork() asks for.
  void applyWork();
  void record();
  void recordRecovery();

  // The following are the parts of finish(), after the tick is complete.
  void giveToJournal();
  void takeState();
  void traceTick(Clock::time_point done);
  void announceEvents();
  void keepSnapshot();
  // Announces that a recording started or stopped.
  void announceRecording();
  void recover();

  // Announces the present parameters, because changes were undone.
  void announceParameters();
  // Announces that the device has no room for a change.
  void announceRefusal(const std::string& reason);

  LiveScene& live_;
  std::shared_ptr<SceneOnDevice> onDevice_;  // shared with a rehearsal

  SceneParameters parameters_;
  Interaction interaction_;
  SurfacePreparation surfacePreparation_;
  std::vector<RoomSurface> roomSurfaces_;  // of the newest change
  std::uint64_t surfaceVersion_ = 0;       // of `roomSurfaces_`; 0: they are taken again
  SceneFrames frames_;
  SceneRecovery recovery_;
  Inputs inputs_;             // of the newest tick
  v1::ServerMessage events_;  // of the newest tick, in memory that is reused

  // Newest healthy state on the CPU.
  struct Snapshot {
    simulation::StateSnapshot state;
    std::vector<GrabsAndAttachments::Slot> grabs = {};  // with it
    ColliderSet::Followed followed = {};                // with it
  };
  Snapshot snapshot_;

  schedule::WorkLevel wantedWork_, work_;
  std::uint32_t leastSubsteps_;
  float windRoom_;  // LiveScene::roomForWind()

  // Tick that has begun, or else the newest complete one.
  struct Tick {
    Clock::time_point start{};
    Clock::duration recording{};         // time of this thread until its submission
    bool beginsJournal = false;          // the journal begins with the state before it
    Recovery recovery = Recovery::none;  // before it
    bool keepsState = false;             // keeps a checkpoint on the device
    bool savesState = false;             // saves a snapshot
    bool recordsState = false;           // which is also for the journal
  };
  Tick current_;
  std::uint64_t tick_ = 0;  // newest complete one
  simulation::TickStatus status_;
  std::optional<double> ownSeconds_, deviceSeconds_;
  bool recorded_ = false;  // announced to the subscribers
};

}  // namespace clothstream::scene

// SPDX-License-Identifier: MIT
// Runs one scene on the device: ticks, frames, checkpoints, and recovery from failures.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/delivery/frame_publisher.h"
#include "server/scene/collider_set.h"
#include "server/scene/contact_log.h"
#include "server/scene/defaults.h"
#include "server/scene/grabs_and_attachments.h"
#include "server/scene/live_scene.h"
#include "server/scene/pose_history.h"
#include "server/scene/recovery_policy.h"
#include "server/scene/rehearsal.h"
#include "server/scene/requests.h"
#include "server/scene/scene_loader.h"
#include "server/scene/scene_on_device.h"
#include "server/schedule/making_limit.h"
#include "server/schedule/token_bucket.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {

// Belongs to the device's thread. A tick is begin(), then finish(); the device works between the two. Tick n
// ends at the simulated time n / simulation rate. Tick numbers only grow, also after the state went back.
//
// A tick that takes longer than kSliceTime is submitted in slices of about this time, so that ticks of other
// scenes can run in between, and so that it can be dropped: begin() submits the first slice, waitForSlice()
// waits for it, and submitSlice() submits the next one as long as hasSlices().
//
// The first host of a restored scene continues from its checkpoint, and every host gives checkpoints to the
// scene's keeper, if it has one.
//
// Recovery bounds the loss. Every second of healthy ticks a checkpoint is kept on the device; an unhealthy
// state goes back to it. Every five seconds a snapshot is kept on the CPU; after a device loss the scene
// continues from it. A state that becomes unhealthy again within a second goes back to the scene's start
// (RecoveryPolicy). Parameters stay, except for changes that may be the reason.
class SceneHost {
 public:
  // Minimum interval between requested key frames of one quality. One key frame serves all subscribers.
  static constexpr std::chrono::milliseconds kKeyFrameInterval{100};

  static constexpr std::chrono::milliseconds kSliceTime{10};

  // While the scene is recorded, at least one of this many frames is a key frame.
  static constexpr std::uint32_t kMaxKeyFrameDistance = 24;

  // All arguments must outlive the host. With `reportRate` 0 no frame carries a report. Changes of parameters
  // that need new kernels act as soon as `loader` has compiled them; at once if it is null. Throws
  // std::runtime_error if the device has no room for the scene.
  SceneHost(vulkan::Device& device, LiveScene& scene, delivery::FramePublisher& publisher,
            double reportRate = kDefaultReportRate, SceneLoader* loader = nullptr);
  // `loaded` holds the scene's start.
  SceneHost(std::unique_ptr<SceneOnDevice> loaded, LiveScene& scene, delivery::FramePublisher& publisher,
            double reportRate, SceneLoader* loader = nullptr);
  ~SceneHost();

  // Sets the work from the next tick on. Substeps are raised to leastSubsteps(). A change is announced.
  void setWork(const schedule::WorkLevel& work) { wantedWork_ = work; }
  // Work of the newest tick.
  const schedule::WorkLevel& work() const { return work_; }
  // Minimum number of substeps with which the scene is stable with its present parameters.
  std::uint32_t leastSubsteps() const { return leastSubsteps_; }

  // Drains the inbox, records the next tick and submits its first slice. Throws vulkan::DeviceLost.
  void begin(Clock::time_point now);
  // Returns whether slices of the tick are not submitted yet.
  bool hasSlices() const { return nextSlice_ < onDevice_->recorder.sliceCount(); }
  // Waits for the submitted slice. The device was busy with other scenes until `deviceFree`. Throws
  // vulkan::DeviceLost.
  void waitForSlice(Clock::time_point deviceFree = {});
  // Submits the next slice. Throws vulkan::DeviceLost.
  void submitSlice();
  // Runs the rest of the tick, and hands its frame to the publisher. Throws vulkan::DeviceLost.
  void finish();

  // While the scene is paused: encodes the present state as a key frame for subscribers that need one to
  // continue. Runs no tick; other subscribers get nothing. Call it repeatedly. Throws vulkan::DeviceLost.
  void encodePausedFrame(Clock::time_point now);

  // Releases the encoders of the coarser qualities, when the scene is paused or has no subscribers.
  void releaseCoarseEncoders();

  // Releases everything on the device. After that only rebuild() and isReady() may be called.
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
  Clock::duration makingTime() const { return makingTime_; }
  // Returns whether changes wait for their kernels.
  bool isRehearsing() const { return rehearsal_.isUnderWay(); }
  // Stops the rehearsal of such changes. They go on waiting.
  void endRehearsal() { rehearsal_.end(); }

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
  std::size_t colliders() const { return tickInputs_.colliders.size(); }
  // Returns whether the cloths were reset and no frame has shown it yet.
  bool owesFrame() const { return owesFrame_; }

 private:
  // Continues a restored scene.
  void continueFrom(const LiveScene::Restored& restored);
  // Reads the state after the newest complete tick into `newestState_`.
  void readState();
  // The state after the newest complete tick, which `newestState_` holds.
  Checkpoint checkpoint() const;
  // The next tick starts from the scene's start.
  void reset();
  // If a journal is due and the state can be recorded, gives it the state before the next tick. Throws
  // vulkan::DeviceLost.
  void beginJournal();
  // Announces that a recording started or stopped.
  void announceRecording();
  void applyInputs();
  // Applies the changes of the inbox. Those that would make stages wait for a later tick until earlier ones
  // are paid for (schedule::MakingLimit) and their kernels are compiled (Rehearsal), and so do all after
  // them. All of them also wait after an exception.
  void applyChanges();
  // Returns how many of them, from the first on, it has applied. If `problem` is still empty, the others
  // wait.
  std::size_t applySome(std::span<const AcceptedChange> changes, std::string& problem);
  // Applies these changes together, or changes nothing and returns false, because the device has no room for
  // them; `problem` says why. After an exception the scene is as before, but not the device.
  bool apply(std::span<const AcceptedChange> changes, std::string& problem);
  // The scene has other parameters.
  void noteChange();
  // Begins the work that setWork() asks for.
  void applyWork();
  // Announces that changes were undone.
  void revertChanges(const std::string& reason);
  // Limits the correction of cloths whose solver changed: springs that are too long shrink over kEaseSeconds.
  // `easeUntil` is as the member.
  void easeSolverChanges(const model::Scene& before, model::Scene& changed,
                         std::vector<std::uint64_t>& easeUntil) const;
  void endEasing();
  void setCloths(const std::vector<model::Cloth>& cloths);
  void recordRecovery();
  // Chooses the encoders of the current frame: those of requested qualities that have a free slot.
  void chooseEncoders(Clock::time_point now);
  void recordFrame(Clock::time_point now);
  // Sets the fields of the current frame, except its report and state hash.
  void describeFrame(Clock::time_point start);
  // Chooses the size of the slices of the next tick from those of this one.
  void adaptSlices();
  void traceTick(Clock::time_point done);
  void writeReport(double deviceSeconds);
  void announceEvents();
  void recover();
  // Whether participants act on the cloth: by colliders, grabs, or what they moved.
  bool isTouched() const { return colliders_.isTouched() || grabs_.isTouched(); }
  // Participants act on nothing until they send poses again.
  void letGo();
  // Parameters go back to those that were proven.
  void undoChanges();
  bool every(std::uint32_t seconds) const { return sinceHealthy_ % (std::uint64_t{seconds} * rate_) == 0; }

  LiveScene& live_;
  delivery::FramePublisher& publisher_;
  const std::uint32_t rate_;            // ticks/s
  const std::uint32_t ticksPerFrame_;   // simulation rate / stream rate; of all frames
  const std::uint64_t ticksPerReport_;  // minimum; 0: no reports

  model::Scene scene_;  // with the current tick's parameters
  ColliderSet colliders_;
  GrabsAndAttachments grabs_;
  ContactLog contacts_;
  Requests contactRequests_, constraintRequests_;
  Inputs inputs_;
  PoseHistory poses_;
  simulation::TickInputs tickInputs_;
  std::vector<Clock::time_point> poseArrivals_;  // of poses that no frame has shown yet

  std::vector<std::uint64_t> easeUntil_;  // tick, for each cloth

  schedule::WorkLevel wantedWork_, work_;
  std::uint32_t leastSubsteps_;
  bool parametersChanged_ = false;  // since leastSubsteps_ was computed

  std::uint64_t tick_ = 0;
  simulation::TickStatus status_;
  std::optional<double> ownSeconds_, deviceSeconds_;
  Clock::duration beginTime_{};   // of recording the current tick
  Clock::duration makingTime_{};  // the part of it in setCloths()
  schedule::MakingLimit making_;
  Recovery recovery_ = Recovery::none;   // before the next tick
  Recovery recovered_ = Recovery::none;  // before the current tick
  bool keepsState_ = false;              // the current tick keeps a checkpoint
  bool journalBegan_ = false;            // before the current tick
  bool recorded_ = false;                // announced to the subscribers
  bool clothsChanged_ = false;           // since the newest complete tick
  RecoveryPolicy recoveries_;
  struct Parameters {
    model::Environment environment;
    std::vector<model::Cloth> cloths;
  };
  // Returns the parameters of a scene without eased corrections.
  static Parameters parametersOf(const model::Scene& scene);
  Parameters proven_, candidate_;   // as RecoveryPolicy has them; the start is proven
  std::uint64_t sinceHealthy_ = 0;  // healthy ticks since the start or the newest recovery
  schedule::TokenBucket recoveryNotices_{1, 5};

  simulation::StateSnapshot newestState_;
  std::vector<GrabsAndAttachments::Slot> grabsThen_;  // at newestState_
  bool savesState_ = false;                           // the current tick saves a snapshot
  bool recordsState_ = false;                         // which is also for the journal

  Clock::time_point tickStart_{};
  std::array<Clock::time_point, codec::kMaxQualities> lastKeyFrame_{};
  std::uint32_t sinceKeyFrame_ = 0;  // frames of the finest quality
  std::uint32_t nextSlice_ = 0;
  bool sliceInFlight_ = false;
  vulkan::TimelineValue submitted_ = 0;
  Clock::time_point submittedAt_{};
  Clock::duration longestSlice_{};  // of the current tick
  bool hasFrame_ = false;           // the current tick
  bool hasReport_ = false;          // the current frame
  bool owesFrame_ = false;
  std::uint64_t nextReport_ = 0;  // tick
  delivery::CompleteFrame frame_;

  std::shared_ptr<SceneOnDevice> onDevice_;  // shared with a rehearsal
  Rehearsal rehearsal_;
};

}  // namespace clothstream::scene

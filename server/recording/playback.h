// SPDX-License-Identifier: MIT
// `clothstream-server play`: a recording as the frame source of a scene.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "server/recording/announcement_times.h"
#include "server/recording/fault_gate.h"
#include "server/recording/pace.h"
#include "server/recording/recorded_stream.h"
#include "server/recording/tick_numbering.h"
#include "server/scene/frame_source.h"
#include "server/schedule/clock.h"

namespace clothstream::recording {

inline constexpr double kMinSpeed = 0.1, kMaxSpeed = 8;
// Speed without pacing by the clock: as fast as the participants acknowledge frames. Only in lockstep.
inline constexpr double kUnpaced = 0;

struct PlaybackOptions {
  double from = 0;   // start position, s, at most the length of the recording
  double speed = 1;  // kMinSpeed to kMaxSpeed, or kUnpaced
  bool loop = false;
  // Publishes nothing until every subscriber has acknowledged the last frame.
  bool lockstep = false;
  // Subscribers that must be there before the first frame.
  std::uint32_t waitFor = 1;
  // Seed of a FaultPlan. Unset: no faults.
  std::optional<std::uint32_t> faults{};
};

// Sends packets as recorded, except for their ticks, which always increase. After a seek or loop the first
// frame is a key frame with the next tick. References between frames are relative, so they stay valid.
// Playback stops while the scene has no participants, and until the first one can receive a frame. A client
// that needs a key frame gets the next recorded one, or, while the scene is paused, the previous one.
//
// In lockstep, what subscribers receive, and in which order, depends only on the recording, the faults and
// the requests of participants, not on time.
class Playback final : public scene::FrameSource {
 public:
  Playback(RecordedStream recording, const PlaybackOptions& options);
  ~Playback() override;
  Playback(const Playback&) = delete;
  Playback& operator=(const Playback&) = delete;

  const v1::StreamDescription& description() const override { return recording_.description(); }
  std::string deviceName() const override { return recording_.device(); }
  void begin(scene::LiveScene& scene) override;
  void end() override;
  bool inLockstep() const override { return options_.lockstep; }
  void wake() override;
  messages::Result<void> control(const v1::ControlSceneRequest& request) override;
  std::string whyFixed() const override { return "is a recording that is played"; }
  std::optional<v1::Playback> playback() const override;
  v1::ParameterChange parameters() const override;

  // Describes what could not be shown so far; empty: nothing. Thread-safe.
  std::string damage() const;

  // Publishes everything due by `now`. Returns when to call it again; nullopt means after a wake(). Only the
  // thread that begin() starts may call it. A test that does not call begin() may call it too.
  std::optional<schedule::Clock::time_point> step(scene::LiveScene& scene, schedule::Clock::time_point now);

 private:
  using Clock = schedule::Clock;
  struct Wanted {
    std::optional<double> seek, speed;
    std::optional<bool> loop;
  };

  void run(scene::LiveScene& scene);
  void takeWanted(scene::LiveScene& scene, Clock::time_point now);
  // Continues from the newest key frame at or before this time, and publishes it immediately.
  void jump(scene::LiveScene& scene, double seconds, Clock::time_point now);
  void flow(scene::LiveScene& scene, Clock::time_point now);
  // Whether a subscriber waits for a key frame that only a jump can give it.
  bool needsJump(const scene::LiveScene& scene, Clock::time_point now) const;
  // Effect of the faults on the message now.
  FaultGate::Passage passageOf(const RecordedStream::Next& next, const scene::LiveScene& scene,
                               Clock::time_point now);
  double timeOf(const RecordedStream::Next& next) const;
  void publish(scene::LiveScene& scene, RecordedStream::Next& next, Clock::time_point made);
  // `made`: time of the frame in its message.
  void publishFrame(scene::LiveScene& scene, RecordedStream::TimedMessage& timed, Clock::time_point made);
  void reachEnd(scene::LiveScene& scene, Clock::time_point now);
  // Announces the parameters in effect at this frame.
  void announceParameters(scene::LiveScene& scene, const RecordedStream::TimedMessage& frame);
  void moveTo(double seconds);

  mutable std::mutex mutex_;  // protects the members down to damage_
  std::condition_variable changed_;
  bool woken_ = false, stopping_ = false;
  Wanted wanted_;
  double position_ = 0, speed_ = 1;  // s; written by step() only
  bool loop_ = false, paused_ = false;
  ParametersInForce parameters_;
  std::string damage_;

  const PlaybackOptions options_;

  // Used by step() only.
  RecordedStream recording_;
  TickNumbering ticks_;
  FaultGate faults_;
  Pace pace_;
  AnnouncementTimes announcements_;
  std::optional<RecordedStream::Next> next_;
  bool begun_ = false;  // the first frame was published
  bool asleep_ = true, atEnd_ = false;
  std::set<double> lossesLogged_;  // start of each loss that was logged, s; each is logged once

  std::thread thread_;
};

}  // namespace clothstream::recording

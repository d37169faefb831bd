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

#include "server/recording/recorded_stream.h"
#include "server/scene/frame_source.h"
#include "server/schedule/clock.h"

namespace clothstream::recording {

inline constexpr double kMinSpeed = 0.1, kMaxSpeed = 8;

struct PlaybackOptions {
  double from = 0;   // start position, s, at most the length of the recording
  double speed = 1;  // kMinSpeed to kMaxSpeed
  bool loop = false;
};

// Sends packets as recorded, except for their ticks, which always increase. After a seek or loop the first
// frame is a key frame with the next tick. References between frames are relative, so they stay valid.
// Playback stops while the scene has no participants, and until the first one can receive a frame. A client
// that needs a key frame gets the next recorded one, or, while the scene is paused, the previous one.
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
  void wake() override;
  messages::Result<void> control(const v1::ControlSceneRequest& request) override;
  v1::Playback playback() const override;
  v1::ParameterChange parameters() const override;

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
  Clock::time_point due(double seconds) const;
  double timeOf(const RecordedStream::Next& next) const;
  void publish(scene::LiveScene& scene, RecordedStream::Next& next);
  void publishFrame(scene::LiveScene& scene, RecordedStream::TimedMessage& timed);
  void reachEnd(scene::LiveScene& scene, Clock::time_point now);
  // Announces position and settings.
  void announcePlayback(scene::LiveScene& scene);
  // Announces the parameters in effect at this frame.
  void announceParameters(scene::LiveScene& scene, const RecordedStream::TimedMessage& frame);
  void moveTo(double seconds);

  mutable std::mutex mutex_;  // protects the members down to parameters_
  std::condition_variable changed_;
  bool woken_ = false, stopping_ = false;
  Wanted wanted_;
  double position_ = 0, speed_ = 1;  // s; written by step() only
  bool loop_ = false, paused_ = false;
  ParametersInForce parameters_;

  // Used by step() only.
  RecordedStream recording_;
  const std::uint64_t ticksPerFrame_;
  std::optional<RecordedStream::Next> next_;
  bool asleep_ = true, atEnd_ = false;
  bool announcementDue_ = false;  // the state changed and must be announced
  Clock::time_point origin_{}, nextAnnouncement_{};
  double originPosition_ = 0;      // position in the recording at the origin, s
  std::uint64_t shift_ = 0;        // sent tick minus recorded tick, modulo 2^64
  std::uint64_t newest_ = 0;       // newest tick sent
  std::set<double> lossesLogged_;  // start of each loss that was logged, s; each is logged once

  std::thread thread_;
};

}  // namespace clothstream::recording

// SPDX-License-Identifier: MIT
// `clothstream-server play`: a recording as the source of a scene's frames.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "server/recording/recorded_stream.h"
#include "server/schedule/clock.h"
#include "server/scene/frame_source.h"

namespace clothstream::recording {

inline constexpr double kMinSpeed = 0.1, kMaxSpeed = 8;

struct PlaybackOptions {
  double from = 0;   // s, at most the recording's length
  double speed = 1;  // kMinSpeed to kMaxSpeed
  bool loop = false;
};

// Packets are sent as they were recorded but for their ticks, which only ever grow: wherever the recording
// goes on from, it is with a key frame whose tick is that of the next frame, and references are told by their
// distance. The recording stands still while nobody is in the scene, and until the first who joins can take a
// frame. Who can go on only from a key frame gets the next one that was recorded; while the scene is paused,
// the one before.
class Playback : public scene::FrameSource {
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

  // Publishes what is due by `now`; gives when to call it again, or nothing: after a wake(). Of one thread,
  // which begin() starts; a test may call it in its place.
  std::optional<schedule::Clock::time_point> step(scene::LiveScene& scene, schedule::Clock::time_point now);

 private:
  using Clock = schedule::Clock;
  struct Wanted {
    std::optional<double> seek, speed;
    std::optional<bool> loop;
  };

  void run(scene::LiveScene& scene);
  void takeWanted(scene::LiveScene& scene, Clock::time_point now);
  // Goes on from the newest key frame at this time or before, which is published at once.
  void jump(scene::LiveScene& scene, double seconds, Clock::time_point now);
  void flow(scene::LiveScene& scene, Clock::time_point now);
  Clock::time_point due(double seconds) const;
  double timeOf(const RecordedStream::Next& next) const;
  void publish(scene::LiveScene& scene, RecordedStream::Next& next);
  void publishFrame(scene::LiveScene& scene, RecordedStream::Told& frame);
  void reachEnd(scene::LiveScene& scene, Clock::time_point now);
  void tell(scene::LiveScene& scene);
  // Those that hold with this frame.
  void tellParameters(scene::LiveScene& scene, const RecordedStream::Told& frame);
  void moveTo(double seconds);

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  bool woken_ = false, stopping_ = false;
  Wanted wanted_;
  double position_ = 0, speed_ = 1;  // s; written by step() alone
  bool loop_ = false, paused_ = false;
  ParametersInForce parameters_;

  // step()'s own.
  RecordedStream recording_;
  const std::uint64_t ticksAFrame_;
  std::optional<RecordedStream::Next> next_;
  bool asleep_ = true, atEnd_ = false;
  bool tells_ = false;  // something changed that everybody is to know
  Clock::time_point origin_{}, nextTold_{};
  double originPosition_ = 0;      // s of the recording at the origin
  std::uint64_t shift_ = 0;        // from recorded ticks to those sent, modulo 2^64
  std::uint64_t newest_ = 0;       // tick sent
  std::set<double> lossesLogged_;  // s; each is logged once, however often it is passed

  std::thread thread_;
};

}  // namespace clothstream::recording

// SPDX-License-Identifier: MIT
// Publishes the frames of a recording when they are due.
#include "server/recording/playback.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "server/scene/live_scene.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::recording {
namespace {

using namespace std::chrono_literals;

// Interval between checks for key-frame requests while playback is stopped.
constexpr auto kLookAgain = 20ms;
// Maximum number of messages per step, so that control requests are handled in between.
constexpr int kMaxMessages = 256;

messages::FieldError wrong(std::string text) {
  return {v1::ERROR_CODE_INVALID_ARGUMENT, "controlScene." + std::move(text)};
}

}  // namespace

Playback::Playback(RecordedStream recording, const PlaybackOptions& options)
    : position_(options.from),
      speed_(options.speed),
      loop_(options.loop),
      parameters_(recording.description()),
      options_(options),
      recording_(std::move(recording)),
      ticks_(std::max(1u, description().simulation_rate() / description().stream_rate())),
      faults_(options.faults),
      announcements_(options.lockstep) {}

Playback::~Playback() {
  end();
}

void Playback::begin(scene::LiveScene& scene) {
  thread_ = std::thread([this, &scene] { run(scene); });
}

void Playback::end() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Playback::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

v1::ParameterChange Playback::parameters() const {
  const std::lock_guard lock(mutex_);
  return parameters_.now();
}

std::string Playback::damage() const {
  const std::lock_guard lock(mutex_);
  return damage_;
}

void Playback::run(scene::LiveScene& scene) {
  telemetry::nameThread("player");
  for (;;) {
    const std::optional<Clock::time_point> next = step(scene, Clock::now());
    std::unique_lock lock(mutex_);
    const auto something = [&] { return woken_ || stopping_; };
    if (next)
      changed_.wait_until(lock, *next, something);
    else
      changed_.wait(lock, something);
    if (stopping_) return;
    woken_ = false;
  }
}

messages::Result<void> Playback::control(const v1::ControlSceneRequest& request) {
  Wanted wanted;
  if (request.has_seek()) {
    if (!(request.seek() >= 0 && request.seek() <= recording_.length()))
      return tl::unexpected(
          wrong(fmt::format("seek = {}: must be 0 to {:.3f}, the recording's length in seconds",
                            request.seek(), recording_.length())));
    wanted.seek = request.seek();
  } else if (request.reset()) {
    wanted.seek = 0;
  }
  if (request.has_speed()) {
    const bool unpaced = options_.lockstep && request.speed() == kUnpaced;
    if (!unpaced && !(request.speed() >= kMinSpeed && request.speed() <= kMaxSpeed))
      return tl::unexpected(
          wrong(fmt::format("speed = {}: must be {} to {}{}", request.speed(), kMinSpeed, kMaxSpeed,
                            options_.lockstep ? ", or 0 for as fast as frames are acknowledged" : "")));
    wanted.speed = request.speed();
  }
  if (request.has_loop()) wanted.loop = request.loop();
  const std::lock_guard lock(mutex_);
  if (wanted.seek) wanted_.seek = wanted.seek;
  if (wanted.speed) wanted_.speed = wanted.speed;
  if (wanted.loop) wanted_.loop = wanted.loop;
  return {};
}

std::optional<v1::Playback> Playback::playback() const {
  const std::lock_guard lock(mutex_);
  v1::Playback playback;
  playback.set_length(recording_.length());
  playback.set_position(wanted_.seek.value_or(position_));
  playback.set_speed(wanted_.speed.value_or(speed_));
  playback.set_loop(wanted_.loop.value_or(loop_));
  playback.set_paused(paused_);
  return playback;
}

std::optional<Playback::Clock::time_point> Playback::step(scene::LiveScene& scene, Clock::time_point now) {
  if (options_.lockstep && scene.subscribers.awaitAcknowledgement()) return now + kLookAgain;
  takeWanted(scene, now);
  const bool here = scene.subscribers.receivers(now) > 0;
  // In lockstep the key frame before serves a subscriber that returns alone, whether or not the loss of its
  // former connection was noticed.
  if (!here || (options_.lockstep && scene.subscribers.allRestart())) asleep_ = true;
  if (needsJump(scene, now)) {
    jump(scene, position_, now);
    asleep_ = false;
    begun_ = true;
  }
  const bool flows = here && !asleep_ && !paused_;
  scene.running = flows;
  if (flows) flow(scene, now);
  if (here && announcements_.isDue(position_, flows, now)) {
    announcements_.announced(position_, now);
    scene.subscribers.announce(scene::playbackMessage(*this));
  }
  if (!here) return std::nullopt;
  if (asleep_ || paused_ || !next_) return now + kLookAgain;
  if (faults_.heldUntil()) return *faults_.heldUntil();
  return speed_ == kUnpaced ? now : pace_.due(timeOf(*next_), speed_);
}

bool Playback::needsJump(const scene::LiveScene& scene, Clock::time_point now) const {
  if (!asleep_ && !paused_) return false;
  const std::size_t subscribers = scene.subscribers.receivers(now);
  if (subscribers == 0 || (!begun_ && subscribers < options_.waitFor)) return false;
  if (scene.subscribers.requested(now).keyFrames == 0) return false;
  // In lockstep, a subscriber that lost the last frames to a fault does not get an earlier frame again.
  return !options_.lockstep || !atEnd_ || asleep_ || scene.subscribers.anyRestarts();
}

void Playback::takeWanted(scene::LiveScene& scene, Clock::time_point now) {
  Wanted wanted;
  {
    const std::lock_guard lock(mutex_);
    wanted = std::exchange(wanted_, {});
    if (paused_ != scene.paused || wanted.speed) {
      paused_ = scene.paused;
      pace_.start(position_, now);
      announcements_.request();
    }
    speed_ = wanted.speed.value_or(speed_);
    loop_ = wanted.loop.value_or(loop_);
  }
  if (atEnd_ && !paused_ && !wanted.seek) wanted.seek = 0;
  if (wanted.loop) announcements_.request();
  if (wanted.seek) jump(scene, *wanted.seek, now);
}

void Playback::jump(scene::LiveScene& scene, double seconds, Clock::time_point now) {
  recording_.seek(seconds);
  next_.reset();
  faults_.reset();
  atEnd_ = false;
  announcements_.request();
  moveTo(seconds);
  for (;;) {
    RecordedStream::Next next = recording_.next();
    if (auto* timed = std::get_if<RecordedStream::TimedMessage>(&next);
        timed != nullptr && timed->isFrame()) {
      ticks_.restart(timed->header.tick);
      announceParameters(scene, *timed);
      publishFrame(scene, *timed, Clock::now());
      break;
    }
    if (std::holds_alternative<RecordedStream::End>(next)) {
      next_ = std::move(next);
      break;
    }
    publish(scene, next, Clock::now());
  }
  pace_.start(position_, now);
}

double Playback::timeOf(const RecordedStream::Next& next) const {
  if (const auto* timed = std::get_if<RecordedStream::TimedMessage>(&next)) return timed->time;
  if (const auto* lost = std::get_if<RecordedStream::Lost>(&next)) return lost->start;
  return recording_.length() + 1.0 / recording_.description().stream_rate();
}

void Playback::flow(scene::LiveScene& scene, Clock::time_point now) {
  for (int i = 0; i < kMaxMessages; ++i) {
    if (options_.lockstep && scene.subscribers.awaitAcknowledgement()) return;
    if (!next_) next_ = recording_.next();
    if (speed_ != kUnpaced && !pace_.reaches(timeOf(*next_), speed_, now)) return;
    if (std::holds_alternative<RecordedStream::End>(*next_)) return reachEnd(scene, now);
    const FaultGate::Passage passage = passageOf(*next_, scene, now);
    if (passage == FaultGate::Passage::held) return;
    const Clock::time_point made = faults_.takeStart(Clock::now());
    // Publishing changes the message, so one that fails is left out. Clients miss it as they miss a lost
    // frame.
    RecordedStream::Next next = *std::exchange(next_, std::nullopt);
    if (passage == FaultGate::Passage::free) publish(scene, next, made);
  }
  next_ = recording_.next();
}

FaultGate::Passage Playback::passageOf(const RecordedStream::Next& next, const scene::LiveScene& scene,
                                       Clock::time_point now) {
  const auto* timed = std::get_if<RecordedStream::TimedMessage>(&next);
  if (timed == nullptr || !timed->isFrame()) return FaultGate::Passage::free;
  return faults_.passageOf(timed->header.tick, now, scene.name(), timed->time);
}

void Playback::reachEnd(scene::LiveScene& scene, Clock::time_point now) {
  if (loop_) return jump(scene, 0, now);
  scene.paused = true;
  atEnd_ = true;
  announcements_.request();
  moveTo(recording_.length());
  {
    const std::lock_guard lock(mutex_);
    paused_ = true;
  }
  scene.subscribers.announce(
      delivery::notice(v1::NOTICE_KIND_SCENE_PAUSED, "the recording is at its end", ticks_.newest()));
}

void Playback::publish(scene::LiveScene& scene, RecordedStream::Next& next, Clock::time_point made) {
  if (const auto* lost = std::get_if<RecordedStream::Lost>(&next)) {
    const std::string text = fmt::format(
        "the recording is damaged: {:.2f} s to {:.2f} s of it cannot be shown", lost->start, lost->end);
    {
      const std::string frames = recording_.faults().text();
      const std::lock_guard lock(mutex_);
      damage_ = frames.empty() ? lost->reason : frames;
    }
    if (lossesLogged_.insert(lost->start).second)
      telemetry::log({scene.name()}, spdlog::level::warn, "{}: {}", text, lost->reason);
    scene.subscribers.announce(delivery::notice(v1::NOTICE_KIND_RECORDING_DAMAGED, text, ticks_.newest()));
    return;
  }
  auto& timed = std::get<RecordedStream::TimedMessage>(next);
  if (timed.isFrame()) {
    ticks_.follow(timed.header.tick);
    return publishFrame(scene, timed, made);
  }
  if (timed.message.has_parameter_changed()) {
    v1::ParameterChanged& changed = *timed.message.mutable_parameter_changed();
    changed.set_tick(ticks_.shifted(changed.tick()));
    const std::lock_guard lock(mutex_);
    parameters_.apply(changed.change());
  }
  if (timed.message.has_tick_events())
    timed.message.mutable_tick_events()->set_tick(ticks_.shifted(timed.message.tick_events().tick()));
  if (timed.message.has_notice())
    timed.message.mutable_notice()->set_tick(ticks_.shifted(timed.message.notice().tick()));
  scene.subscribers.announce(delivery::serialise(timed.message));
}

void Playback::publishFrame(scene::LiveScene& scene, RecordedStream::TimedMessage& timed,
                            Clock::time_point made) {
  v1::Frame& frame = *timed.message.mutable_frame();
  codec::PacketHeader& header = timed.header;
  header.tick = ticks_.shifted(header.tick);
  for (std::size_t i = 0; i < header.referenceCount; ++i)
    header.references[i] = ticks_.shifted(header.references[i]);
  const std::string recorded = std::move(*frame.mutable_packet());
  frame.clear_packet();
  const auto parsed = codec::parsePacket(std::as_bytes(std::span(recorded)));
  std::vector<std::byte> packet(codec::headerBound(header) + parsed->body.size());
  const std::size_t headerBytes = codec::writeHeader(header, packet);
  std::ranges::copy(parsed->body, packet.begin() + static_cast<std::ptrdiff_t>(headerBytes));
  packet.resize(headerBytes + parsed->body.size());
  frame.set_tick_time_us(schedule::microseconds(made));
  frame.set_packet_time_us(schedule::microseconds(made));

  const delivery::PublishedFrame published =
      delivery::publishedFrame(header, delivery::serialiseFrame(frame, packet), made);
  ticks_.send(header.tick);
  scene.tick = header.tick;
  scene.metrics.frames.add();
  if (published.key) scene.metrics.keyFrames.add();
  scene.metrics.packetBytes.add(packet.size());
  moveTo(timed.time);
  scene.subscribers.publish(published);
}

void Playback::announceParameters(scene::LiveScene& scene, const RecordedStream::TimedMessage& frame) {
  ParametersInForce there = recording_.parametersAt(frame.time);  // may read the file
  {
    const std::lock_guard lock(mutex_);
    parameters_ = std::move(there);
  }
  if (const auto message = scene::parametersMessage(*this, ticks_.shifted(frame.header.tick)))
    scene.subscribers.announce(message);
}

void Playback::moveTo(double seconds) {
  const std::lock_guard lock(mutex_);
  position_ = seconds;
}

}  // namespace clothstream::recording

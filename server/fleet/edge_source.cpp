// SPDX-License-Identifier: MIT
#include "server/fleet/edge_source.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "server/fleet/message_bytes.h"
#include "server/scene/live_scene.h"

namespace clothstream::fleet {
namespace {

// A scene without frames for this long is shown as one that does not run.
constexpr std::chrono::seconds kStillTime{1};

delivery::SharedBytes copyOf(std::span<const std::byte> bytes) {
  return std::make_shared<std::vector<std::byte>>(bytes.begin(), bytes.end());
}

}  // namespace

EdgeSource::EdgeSource(const v1::OfferedScene& offered, v1::StreamDescription description,
                       std::function<void()> wake, Connect connect)
    : description_(std::move(description)),
      deviceName_(offered.device_name()),
      qualities_(static_cast<std::uint8_t>(std::max(description_.qualities(), 1u))),
      wake_(std::move(wake)),
      connect_(std::move(connect)),
      parameters_(description_) {
  if (offered.summary().has_playback()) playback_ = offered.summary().playback();
}

std::shared_ptr<scene::RemoteSession> EdgeSource::connect(const scene::RemotePeer& peer,
                                                          std::function<void()> wake) {
  return connect_ ? connect_(peer, std::move(wake)) : nullptr;
}

void EdgeSource::begin(scene::LiveScene& scene) {
  const std::lock_guard lock(mutex_);
  scene_ = &scene;
}

void EdgeSource::end() {
  const std::lock_guard lock(mutex_);
  scene_ = nullptr;
}

void EdgeSource::wake() {
  const std::lock_guard lock(mutex_);
  if (scene_ != nullptr) wake_();
}

messages::Result<void> EdgeSource::control(const v1::ControlSceneRequest& request) {
  return tl::unexpected(
      messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                           fmt::format("controlScene: '{}' {}; send this to the server that simulates it",
                                       request.name(), whyFixed())});
}

std::optional<v1::Playback> EdgeSource::playback() const {
  const std::lock_guard lock(mutex_);
  return playback_;
}

v1::ParameterChange EdgeSource::parameters() const {
  const std::lock_guard lock(mutex_);
  return parameters_.now();
}

bool EdgeSource::belongsHere(const codec::PacketHeader& header) const {
  return header.epoch == description_.epoch() && header.codec == description_.codec() &&
         header.quality < (qualities_ > 1 ? qualities_ : codec::kMaxQualities);
}

bool EdgeSource::receiveFrame(std::span<const std::byte> bytes) {
  v1::ServerMessage message;
  if (!parse(bytes, message) || !message.has_frame()) return false;
  const auto packet = codec::parsePacket(std::as_bytes(std::span(message.frame().packet())));
  if (!packet || !belongsHere(packet->header)) return false;
  const Clock::time_point now = Clock::now();
  delivery::PublishedFrame frame = delivery::publishedFrame(packet->header, copyOf(bytes), now);

  const std::lock_guard lock(mutex_);
  if (scene_ == nullptr) return true;
  std::optional<std::uint64_t>& newest = newest_[indexOf(frame.quality)];
  if (newest && frame.tick < *newest) return false;
  // A paused scene sends its state again as a key frame.
  frame.repeated = newest == frame.tick;
  newest = frame.tick;
  newestTime_ = now;
  keep(frame);
  scene_->tick = frame.tick;
  scene_->running = !frame.repeated;
  scene_->metrics.frames.add();
  if (frame.key) scene_->metrics.keyFrames.add();
  scene_->metrics.packetBytes.add(message.frame().packet().size());
  scene_->subscribers.publish(frame);
  return true;
}

void EdgeSource::keep(const delivery::PublishedFrame& frame) {
  std::vector<delivery::PublishedFrame>& kept = sinceKey_[indexOf(frame.quality)];
  if (frame.key) {
    kept = {frame};
    return;
  }
  const bool follows = !kept.empty() && kept.back().tick == frame.referenceTick;
  if (follows && kept.size() < delivery::HeldFrames::kMax)
    kept.push_back(frame);
  else
    kept.clear();
}

bool EdgeSource::receiveEvent(std::span<const std::byte> bytes) {
  v1::ServerMessage message;
  if (!parse(bytes, message)) return false;
  using Body = v1::ServerMessage;
  const std::lock_guard lock(mutex_);
  if (scene_ == nullptr) return true;
  switch (message.body_case()) {
    case Body::kParameterChanged:
      parameters_.apply(message.parameter_changed().change());
      break;
    case Body::kPlayback:
      playback_ = message.playback();
      break;
    case Body::kNotice:
      if (message.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED) scene_->paused = true;
      if (message.notice().kind() == v1::NOTICE_KIND_SCENE_RESUMED) scene_->paused = false;
      break;
    case Body::kTickEvents:
      break;
    case Body::kPresence:  // of the origin's participants, who are not in the roster of this server
      return true;
    default:
      return false;
  }
  scene_->subscribers.announce(copyOf(bytes));
  return true;
}

void EdgeSource::setParameters(const v1::StreamDescription& description) {
  {
    const std::lock_guard lock(mutex_);
    parameters_ = recording::ParametersInForce(description);
  }
  const delivery::SharedBytes message = scene::parametersMessage(*this, newest().value_or(0));
  const std::lock_guard lock(mutex_);
  if (scene_ != nullptr && message) scene_->subscribers.announce(message);
}

void EdgeSource::setPaused(bool paused) {
  const std::lock_guard lock(mutex_);
  if (scene_ == nullptr || scene_->paused.exchange(paused) == paused) return;
  scene_->subscribers.announce(scene::pausedNotice(*scene_));
}

std::optional<std::uint64_t> EdgeSource::newest() const {
  const std::lock_guard lock(mutex_);
  std::optional<std::uint64_t> newest;
  for (const auto& tick : newest_) newest = std::max(newest, tick);
  return newest;
}

void EdgeSource::forgetFrames() {
  const std::lock_guard lock(mutex_);
  for (auto& kept : sinceKey_) kept.clear();
}

delivery::RequestedFrames EdgeSource::needs(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (scene_ == nullptr || scene_->subscribers.size() == 0) return {};
  const bool still = now - newestTime_ > kStillTime;
  if (still) scene_->running = false;
  if (scene_->subscribers.needsKeyFrame() != 0)
    for (const auto& kept : sinceKey_)
      if (!kept.empty()) scene_->subscribers.publishAgain(kept);
  delivery::RequestedFrames needed = scene_->subscribers.requested(now);
  // A recording that its origin stopped for a lack of viewers continues when a viewer needs a key frame.
  if (still && !scene_->paused) needed.keyFrames |= needed.qualities;
  if (qualities_ == 1) {
    needed.qualities = needed.qualities != 0 ? 1 : 0;
    needed.keyFrames = needed.keyFrames != 0 ? 1 : 0;
  }
  return needed;
}

}  // namespace clothstream::fleet

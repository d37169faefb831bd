// SPDX-License-Identifier: MIT
#include "server/fleet/edge_stream.h"

#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/fleet/message_bytes.h"
#include "server/fleet/subjects.h"
#include "server/hosting/scene_server.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/log.h"

namespace clothstream::fleet {
namespace {

using delivery::SharedBytes;
using schedule::Clock;
using namespace std::chrono_literals;

// Frames of a quality that no viewer needs any more are received for this long.
constexpr auto kQualityTime = 5s;
// Events that wait for a description. Further ones are dropped.
constexpr std::size_t kMaxEarlyEvents = 1024;

// Empty if the stream can be shown.
std::string problemOf(const v1::StreamDescription& description) {
  if (!codec::isCodec(description.codec()))
    return fmt::format("its codec {} is not known here: use servers of the same release",
                       description.codec());
  const auto isRate = [](std::uint32_t rate) { return rate >= 1 && rate <= 100'000; };
  if (!isRate(description.simulation_rate()) || !isRate(description.stream_rate()) ||
      description.qualities() > codec::kMaxQualities)
    return "its description is not valid";
  return {};
}

// Why a picture stands still, for its viewers.
SharedBytes standsStill(const scene::LiveScene& scene, const char* why) {
  return delivery::notice(v1::NOTICE_KIND_RUNNING_SLOW, fmt::format("the picture stands still: {}", why),
                          scene.tick.load());
}

}  // namespace

EdgeStream::EdgeStream(EdgeContext context, std::uint64_t origin, const v1::OfferedScene& offered)
    : origin_(origin),
      edge_(std::move(context)),
      offered_(offered),
      name_(offered.summary().name()),
      subject_(streamSubject(name_, offered.stream())),
      inbox_(edge_.nats.inbox()),
      tunnels_(std::make_shared<EdgeTunnels>(edge_.nats, edge_.edge, subject_)) {
  listen();
  tellInterest({}, false, Clock::now());
  askForDescription(Clock::now());
}

EdgeStream::EdgeStream(EdgeContext context, std::uint64_t origin, const v1::OfferedScene& offered,
                       const EdgeStream& former)
    : origin_(origin),
      edge_(std::move(context)),
      offered_(offered),
      name_(offered.summary().name()),
      subject_(streamSubject(name_, offered.stream())),
      inbox_(edge_.nats.inbox()),
      continues_(true),
      scene_(former.scene_),
      source_(former.source_),
      tunnels_(former.tunnels_) {
  listen();
  look(Clock::now());
}

void EdgeStream::listen() {
  events_ = edge_.nats.subscribe(eventsSubject(subject_),
                                 [this](const auto&, const auto&, auto data) { event(data); });
  down_ = edge_.nats.subscribe(downPattern(subject_, edge_.edge),
                               [this](const std::string& subject, const auto&, auto data) {
                                 tunnels_->receive(subject_, subject, data);
                               });
}

void EdgeStream::askForDescription(Clock::time_point now) {
  description_.clear();
  chunks_ =
      edge_.nats.subscribe(inbox_, [this](const auto&, const auto&, auto data) { edge_.arrive(id(), data); });
  ask(now);
}

bool EdgeStream::receiveChunk(std::span<const std::byte> bytes, Clock::time_point now) {
  v1::ServerMessage message;
  if (!chunks_ || !parse(bytes, message) || !message.has_chunk()) return false;
  const DescriptionDownload::Added added = description_.add(message.chunk());
  if (added == DescriptionDownload::Added::incomplete) ask(now);
  return added == DescriptionDownload::Added::complete;
}

bool EdgeStream::serve() {
  v1::StreamDescription description;
  std::string problem = "its description is not valid";
  if (description.ParseFromString(description_.bytes())) problem = problemOf(description);
  description_.clear();
  chunks_.reset();
  if (scene_) {
    const std::lock_guard lock(mutex_);
    refreshes_ = false;
    if (problem.empty()) source_->setParameters(description);
    for (const SharedBytes& event : std::exchange(early_, {})) receive(*event);
    return true;
  }
  if (!problem.empty()) {
    telemetry::log({name_}, spdlog::level::warn, "the scene that another server offers is not shown: {}",
                   problem);
    return false;
  }
  auto source = std::make_shared<EdgeSource>(
      offered_, std::move(description), edge_.wake,
      [tunnels = tunnels_](const scene::RemotePeer& peer, std::function<void()> wake) {
        return tunnels->connect(peer, std::move(wake));
      });
  scene_ = edge_.server.add(name_, source);
  scene_->paused = offered_.summary().paused();
  learn(offered_);
  const std::lock_guard lock(mutex_);
  source_ = std::move(source);
  for (const SharedBytes& event : early_) receive(*event);
  early_.clear();
  return true;
}

void EdgeStream::end(const SharedBytes& last) {
  retire();
  tunnels_->close(last);
  if (scene_) edge_.server.remove(scene_, last);
}

void EdgeStream::look(Clock::time_point now) {
  if (!isSuccessor()) tunnels_->poll();
  if (chunks_ && description_.isOverdue(now)) ask(now);
  if (!scene_) return tellInterest({}, false, now);
  delivery::RequestedFrames needed = source_->needs(now);
  // Its first frames must not refer to those of the other stream.
  if (isSuccessor()) needed.keyFrames = needed.qualities;
  receiveFrames(needed.qualities, now);
  tellInterest(needed, !isSuccessor(), now);
}

void EdgeStream::learn(const v1::OfferedScene& offered) {
  const v1::SceneSummary& summary = offered.summary();
  tunnels_->setRoom(!summary.has_playback() && summary.participants() < summary.max_participants());
  if (!scene_) return;
  if (std::exchange(pauseIsOld_, false)) source_->setPaused(summary.paused());
  std::vector<scene::Ban> bans;
  for (const v1::SavedBan& ban : offered.bans())
    bans.push_back({{.tenant = ban.tenant(), .name = ban.subject()}, ban.display_name()});
  scene_->roster.setBans(std::move(bans));
}

void EdgeStream::refresh(Clock::time_point now) {
  if (source_) source_->forgetFrames();
  pauseIsOld_ = source_ != nullptr;
  // The description of a recording has the parameters of its start.
  const bool asks = !source_ || !source_->playback();
  {
    const std::lock_guard lock(mutex_);
    refreshes_ = source_ && asks;
    early_.clear();
  }
  if (asks) askForDescription(now);
}

void EdgeStream::tell(const char* why) {
  const SharedBytes notice = standsStill(*scene_, why);
  scene_->subscribers.announce(notice);
  tunnels_->tell(notice);
}

void EdgeStream::replace() {
  replaced_ = true;
  source_->forgetFrames();
  tunnels_->moveTo(subject_);
}

void EdgeStream::retire() {
  frames_ = {};
  events_.reset();
  down_.reset();
  chunks_.reset();
}

void EdgeStream::ask(Clock::time_point now) {
  edge_.nats.publish(descriptionSubject(subject_), toBytes(description_.request(now)), inbox_);
}

void EdgeStream::tellInterest(const delivery::RequestedFrames& needed, bool asksOften,
                              Clock::time_point now) {
  if (!interest_.update(needed, asksOften, now)) return;
  v1::Interest interest;
  interest.set_edge(edge_.edge);
  interest.set_qualities(needed.qualities);
  interest.set_key_frames(needed.keyFrames);
  interest.set_viewers(scene_ ? static_cast<std::uint32_t>(scene_->subscribers.size()) : 0);
  edge_.nats.publish(interestSubject(subject_), toBytes(interest));
}

void EdgeStream::receiveFrames(std::uint8_t qualities, Clock::time_point now) {
  const bool single = source_->qualities() == 1;
  for (std::uint8_t quality = 0; quality < source_->qualities(); ++quality) {
    Frames& frames = frames_[quality];
    const bool needed = (qualities >> quality & 1) != 0;
    if (needed) frames.neededAt = now;
    if (needed && !frames.subscription)
      frames.subscription =
          edge_.nats.subscribe(framesPattern(subject_, single ? std::nullopt : std::optional(quality)),
                               [this](const auto&, const auto&, auto data) { receiveFrame(data); });
    if (frames.subscription && now - frames.neededAt > kQualityTime) {
      frames.subscription.reset();
      source_->forgetFrames();
    }
  }
}

void EdgeStream::receiveFrame(std::span<const std::byte> data) {
  if (!source_->receiveFrame(data)) return edge_.server.metrics.nats.refused.add();
  if (!arrived_.exchange(true) && isSuccessor()) edge_.wake();
}

void EdgeStream::event(std::span<const std::byte> data) {
  const std::lock_guard lock(mutex_);
  if (source_) receive(data);
  if ((!source_ || refreshes_) && early_.size() < kMaxEarlyEvents)
    early_.push_back(std::make_shared<std::vector<std::byte>>(data.begin(), data.end()));
}

void EdgeStream::receive(std::span<const std::byte> data) {
  if (!source_->receiveEvent(data)) edge_.server.metrics.nats.refused.add();
}

}  // namespace clothstream::fleet

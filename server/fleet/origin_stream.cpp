// SPDX-License-Identifier: MIT
#include "server/fleet/origin_stream.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <utility>

#include "server/delivery/description_chunks.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/random_id.h"
#include "server/fleet/subjects.h"
#include "server/hosting/answers.h"
#include "server/hosting/scene_server.h"
#include "server/scene/live_scene.h"

namespace clothstream::fleet {
namespace {

using delivery::SharedBytes;
using schedule::Clock;
using namespace std::chrono_literals;

// An edge that has been silent for this long needs nothing.
constexpr auto kInterestTime = 3s;
// Edges that one scene remembers. Further ones are not heard.
constexpr std::size_t kMaxEdges = 1024;
// Descriptions are kept for this long after a request, so that an edge gets all parts of the same one.
constexpr auto kGivenTime = 5s;
constexpr std::size_t kMaxGiven = 256;

// Collects what the edges need of one scene, and sends its frames to them.
class SceneRelay final : public delivery::Relay {
 public:
  SceneRelay(Nats& nats, std::string stream, std::uint8_t qualities)
      : nats_(nats), stream_(std::move(stream)), qualities_(qualities) {}

  void deliver(const delivery::PublishedFrame& frame) override {
    {
      const std::lock_guard lock(mutex_);
      const auto bit = static_cast<std::uint8_t>(qualities_ > 1 ? 1u << frame.quality : ~0u);
      if ((neededLocked(Clock::now()).qualities & bit) == 0) return;
      if (frame.key)
        for (auto& [edge, interest] : interests_)
          interest.frames.keyFrames &= static_cast<std::uint8_t>(~bit);
    }
    nats_.publish(framesSubject(stream_, frame.quality), frame.message);
  }

  void announce(const SharedBytes& message) override {
    {
      const std::lock_guard lock(mutex_);
      forgetSilentEdges(Clock::now());
      if (interests_.empty()) return;
    }
    nats_.publish(eventsSubject(stream_), message);
  }

  delivery::RequestedFrames requested(Clock::time_point now) override {
    const std::lock_guard lock(mutex_);
    return neededLocked(now);
  }

  // Returns whether the scene must be woken.
  bool hear(const v1::Interest& interest, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    forgetSilentEdges(now);
    if (interests_.size() >= kMaxEdges && !interests_.contains(interest.edge())) return false;
    const auto all = static_cast<std::uint8_t>((1u << qualities_) - 1);
    const auto qualities = static_cast<std::uint8_t>(interest.qualities() & all);
    const auto keyFrames = static_cast<std::uint8_t>(interest.key_frames() & qualities);
    Interest& known = interests_[interest.edge()];
    const bool wakes = keyFrames != 0 || (qualities & ~known.frames.qualities) != 0 ||
                       (qualities == 0 && known.frames.qualities != 0);
    known = {.frames = {.qualities = qualities, .keyFrames = keyFrames}, .until = now + kInterestTime};
    return wakes;
  }

 private:
  struct Interest {
    delivery::RequestedFrames frames;
    Clock::time_point until{};
  };

  delivery::RequestedFrames neededLocked(Clock::time_point now) {
    forgetSilentEdges(now);
    delivery::RequestedFrames needed;
    for (const auto& [edge, interest] : interests_) needed |= interest.frames;
    return needed;
  }

  void forgetSilentEdges(Clock::time_point now) {
    std::erase_if(interests_, [&](const auto& known) { return known.second.until < now; });
  }

  Nats& nats_;
  const std::string stream_;
  const std::uint8_t qualities_;
  std::mutex mutex_;
  std::map<std::uint64_t, Interest> interests_;  // by edge
};

}  // namespace

OriginStream::OriginStream(hosting::SceneServer& server, Nats& nats, OriginTunnels& tunnels,
                           const std::shared_ptr<scene::LiveScene>& live, std::uint64_t continues)
    : server_(server),
      tunnels_(tunnels),
      scene_(live),
      id_(randomId()),
      continues_(continues),
      restarts_(live->restarts),
      prepared_(continues != 0),
      subject_(streamSubject(live->name(), id_)),
      relay_(std::make_shared<SceneRelay>(nats, subject_, live->shape().qualities)) {
  interest_ = nats.subscribe(interestSubject(subject_), [this](const auto&, const auto&, auto data) {
    v1::Interest message;
    if (!parse(data, message)) return;
    if (static_cast<SceneRelay&>(*relay_).hear(message, Clock::now())) server_.device.wake(*scene_);
  });
  description_ = nats.subscribe(
      descriptionSubject(subject_), [this, &nats](const auto&, const std::string& reply, auto data) {
        v1::ChunkRequest request;
        if (reply.empty() || !parse(data, request)) return;
        const std::shared_ptr<const delivery::DescriptionChunks> chunks = description(request.content_id());
        const bool same = request.content_id() == chunks->contentId() && request.index() < chunks->count();
        nats.publish(reply, chunks->chunk(same ? request.index() : 0));
      });
  up_ = nats.subscribe(upPattern(subject_), [this](const std::string& subject, const auto&, auto data) {
    tunnels_.receive(subject_, subject, data);
  });
  scene_->subscribers.setRelay(relay_);
}

std::shared_ptr<const delivery::DescriptionChunks> OriginStream::description(std::uint64_t content) {
  const Clock::time_point now = Clock::now();
  std::erase_if(given_, [&](const Given& given) { return now - given.at > kGivenTime; });
  const auto find = [&](std::uint64_t id) {
    return std::ranges::find(given_, id, [](const Given& given) { return given.chunks->contentId(); });
  };
  auto found = find(content);
  if (found == given_.end()) {
    auto newest = scene_->description();
    found = find(newest->contentId());
    if (found == given_.end()) {
      if (given_.size() == kMaxGiven) given_.erase(given_.begin());
      found = given_.insert(given_.end(), {.chunks = std::move(newest), .at = now});
    }
  }
  found->at = now;
  return found->chunks;
}

OriginStream::~OriginStream() {
  up_.reset();
  tunnels_.end(subject_);
  scene_->subscribers.dropRelay(*relay_);
}

v1::OfferedScene OriginStream::offer() const {
  v1::OfferedScene offered;
  offered.set_stream(id_);
  *offered.mutable_summary() = hosting::summaryOf(*scene_);
  offered.set_device_name(server_.deviceNameOf(*scene_));
  offered.set_continues(continues_);
  offered.set_prepared(prepared_);
  for (const scene::Ban& ban : scene_->roster.bans()) {
    v1::SavedBan& message = *offered.add_bans();
    message.set_subject(ban.subject.name);
    message.set_tenant(ban.subject.tenant);
  }
  return offered;
}

}  // namespace clothstream::fleet

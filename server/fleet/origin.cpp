// SPDX-License-Identifier: MIT
#include "server/fleet/origin.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>

#include "clothstream/v1/fleet.pb.h"
#include "server/delivery/description_chunks.h"
#include "server/delivery/relay.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/random_id.h"
#include "server/fleet/subjects.h"
#include "server/hosting/server_state.h"
#include "server/scene/live_scene.h"

namespace clothstream::fleet {
namespace {

using delivery::SharedBytes;
using schedule::Clock;
using namespace std::chrono_literals;

constexpr auto kOfferPeriod = 1s;
// An edge that has been silent for this long needs nothing.
constexpr auto kInterestTime = 3s;
// Edges that one scene remembers. Further ones are not heard.
constexpr std::size_t kMaxEdges = 1024;

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
    nats_.publish(framesSubject(stream_, frame.quality, frame.layer), frame.message);
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

struct Origin::Stream {
  Stream(hosting::SceneServer& server, Nats& nats, const std::shared_ptr<scene::LiveScene>& live)
      : scene(live),
        id(randomId()),
        subject(streamSubject(live->name(), id)),
        relay(std::make_shared<SceneRelay>(nats, subject, live->shape().qualities)) {
    interest = nats.subscribe(interestSubject(subject), [this, &server](const auto&, const auto&, auto data) {
      v1::Interest message;
      if (!parse(data, message)) return;
      if (relay->hear(message, Clock::now())) server.state().wake(*scene);
    });
    description = nats.subscribe(
        descriptionSubject(subject), [this, &nats](const auto&, const std::string& reply, auto data) {
          v1::ChunkRequest request;
          if (reply.empty() || !parse(data, request)) return;
          const std::shared_ptr<const delivery::DescriptionChunks> chunks = scene->description();
          const bool same = request.content_id() == chunks->contentId() && request.index() < chunks->count();
          nats.publish(reply, chunks->chunk(same ? request.index() : 0));
        });
    scene->subscribers.setRelay(relay);
  }
  ~Stream() { scene->subscribers.setRelay(nullptr); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  const std::shared_ptr<scene::LiveScene> scene;
  const std::uint64_t id;
  const std::string subject;
  const std::shared_ptr<SceneRelay> relay;
  std::unique_ptr<Nats::Subscription> interest, description;
};

Origin::Origin(hosting::SceneServer& server, const NatsOptions& options)
    : server_(server),
      id_(randomId()),
      nats_(options, server.state().metrics.nats),
      thread_([this] { run(); }) {}

Origin::~Origin() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  streams_.clear();
  offer();
}

void Origin::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    try {
      lookForScenes();
      offer();
    } catch (const std::exception& failure) {  // such as a lack of memory
      spdlog::error("offering scenes to edges failed: {}; trying again", failure.what());
    }
    lock.lock();
    changed_.wait_for(lock, kOfferPeriod, [this] { return stopping_; });
  }
}

void Origin::lookForScenes() {
  const auto scenes = server_.state().scenesNow();
  std::erase_if(streams_, [&](const auto& known) {
    return std::ranges::find(scenes, known.second->scene) == scenes.end();
  });
  for (const auto& scene : scenes) {
    const bool isOffered = !scene->sharesAsGuest && !scene->shape().lockstep && scene->quarantined().empty();
    if (!isOffered)
      streams_.erase(scene->name());
    else if (!streams_.contains(scene->name()))
      streams_.emplace(scene->name(), std::make_unique<Stream>(server_, nats_, scene));
  }
}

void Origin::offer() {
  v1::Offer offer;
  offer.set_origin(id_);
  offer.set_server_name(server_.state().options.serverName);
  for (const auto& [name, stream] : streams_) {
    v1::OfferedScene& offered = *offer.add_scenes();
    offered.set_stream(stream->id);
    *offered.mutable_summary() = hosting::summaryOf(*stream->scene);
    offered.set_device_name(server_.state().deviceNameOf(*stream->scene));
  }
  nats_.publish(kOffers, toBytes(offer));
}

}  // namespace clothstream::fleet

// SPDX-License-Identifier: MIT
#include "server/fleet/edge.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/fleet.pb.h"
#include "proto/codec/packet_header.h"
#include "server/fleet/edge_source.h"
#include "server/fleet/edge_tunnel.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/random_id.h"
#include "server/fleet/subjects.h"
#include "server/hosting/server_state.h"
#include "server/messages/limits.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/log.h"

namespace clothstream::fleet {
namespace {

using delivery::SharedBytes;
using schedule::Clock;
using namespace std::chrono_literals;

// Interval between looks at what viewers need.
constexpr auto kLookPeriod = 20ms;
// An interest is repeated after this time, and a request for a key frame earlier.
constexpr auto kInterestPeriod = 1s;
constexpr auto kKeyFramePeriod = 100ms;
// A piece of a description is asked for again after this time.
constexpr auto kAskAgain = 2s;
// An origin that has offered nothing for this long counts as lost.
constexpr auto kOfferTime = 3s;
// Every origin has offered its scenes after this time.
constexpr auto kFirstOffers = 1500ms;
// Frames of a quality that no viewer needs any more are received for this long.
constexpr auto kQualityTime = 5s;
// Messages that wait for the thread, and events that wait for a description. Further ones are dropped.
constexpr std::size_t kMaxArrivals = 1024, kMaxEarlyEvents = 1024;

bool isName(const std::string& name) {
  return !name.empty() && name.size() <= messages::limits::kMaxNameLength &&
         std::ranges::all_of(name, [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
         });
}

// Empty if the stream can be shown.
std::string problemOf(const v1::StreamDescription& description) {
  if (std::ranges::find(codec::kCodecs, description.codec()) == std::end(codec::kCodecs))
    return fmt::format("its codec {} is not known here: update this server", description.codec());
  const auto isRate = [](std::uint32_t rate) { return rate >= 1 && rate <= 100'000; };
  if (!isRate(description.simulation_rate()) || !isRate(description.stream_rate()) ||
      description.qualities() > codec::kMaxQualities ||
      description.temporal_layers() > codec::kMaxTemporalLayers)
    return "its description is not valid";
  return {};
}

// Why a picture stands still, for its viewers.
SharedBytes standsStill(const scene::LiveScene& scene, const char* why) {
  return delivery::notice(v1::NOTICE_KIND_RUNNING_SLOW, fmt::format("the picture stands still: {}", why),
                          scene.tick.load());
}

}  // namespace

// One stream of an origin: first its description is received, then it is served.
class Edge::Stream {
 public:
  Stream(Edge& edge, std::uint64_t origin, const v1::OfferedScene& offered)
      : origin_(origin),
        edge_(edge),
        offered_(offered),
        name_(offered.summary().name()),
        subject_(streamSubject(name_, offered.stream())),
        inbox_(Nats::inbox()),
        tunnels_(std::make_shared<EdgeTunnels>(edge.nats_, edge.id_, subject_)) {
    listen();
    chunks_ = edge.nats_.subscribe(
        inbox_, [&edge, stream = id()](const auto&, const auto&, auto data) { edge.arrive(stream, data); });
    sendInterest(Clock::now());
    ask(Clock::now());
  }

  // A stream that continues another one, because the scene moves to its origin. Viewers get whatever comes
  // first of both.
  Stream(Edge& edge, std::uint64_t origin, const v1::OfferedScene& offered, const Stream& former)
      : origin_(origin),
        edge_(edge),
        offered_(offered),
        name_(offered.summary().name()),
        subject_(streamSubject(name_, offered.stream())),
        continues_(true),
        scene_(former.scene_),
        source_(former.source_),
        tunnels_(former.tunnels_) {
    listen();
    look(Clock::now());
  }

  // Whether it continues another stream and has not replaced it yet.
  bool isSuccessor() const { return continues_ && !replaced_; }
  bool arrived() const { return arrived_; }
  // Replaces the stream that it continues.
  void replace() {
    replaced_ = true;
    source_->forgetFrames();
    tunnels_->moveTo(subject_);
  }
  // Another stream has replaced it.
  void retire() {
    frames_ = {};
    events_.reset();
    down_.reset();
  }
  // Takes what a later offer says.
  void learn(const v1::OfferedScene& offered) {
    const v1::SceneSummary& summary = offered.summary();
    tunnels_->setRoom(!summary.has_playback() && summary.participants() < summary.max_participants());
    if (!scene_) return;
    std::vector<scene::Ban> bans;
    for (const v1::SavedBan& ban : offered.bans())
      bans.push_back({{.tenant = ban.tenant(), .name = ban.subject()}, ban.display_name()});
    scene_->roster.setBans(std::move(bans));
  }
  // What everyone reads who does not see the picture move.
  void tell(const char* why) {
    const SharedBytes notice = standsStill(*scene_, why);
    scene_->subscribers.announce(notice);
    tunnels_->tell(notice);
  }

 private:
  void listen() {
    events_ = edge_.nats_.subscribe(eventsSubject(subject_),
                                    [this](const auto&, const auto&, auto data) { event(data); });
    down_ = edge_.nats_.subscribe(
        downPattern(subject_, edge_.id_),
        [this](const std::string& subject, const auto&, auto data) { tunnels_->receive(subject_, subject, data); });
  }

 public:
  std::uint64_t id() const { return offered_.stream(); }
  std::uint64_t origin() const { return origin_; }
  const std::shared_ptr<scene::LiveScene>& scene() const { return scene_; }

  // Returns true once, when the description is complete.
  bool receiveChunk(std::span<const std::byte> bytes, Clock::time_point now) {
    v1::ServerMessage message;
    if (scene_ || !parse(bytes, message) || !message.has_chunk()) return false;
    const v1::Chunk& chunk = message.chunk();
    if (chunk.index() == 0) {
      content_ = chunk.content_id();
      description_.clear();
      received_ = 0;
    }
    if (chunk.content_id() != content_ || chunk.index() != received_ ||
        chunk.total_bytes() > kMaxDescriptionBytes ||
        description_.size() + chunk.data().size() > chunk.total_bytes())
      return false;
    description_ += chunk.data();
    ++received_;
    if (received_ == chunk.count()) return true;
    ask(now);
    return false;
  }

  // Begins to serve the stream. Returns false if it cannot be shown.
  bool serve() {
    v1::StreamDescription description;
    std::string problem = "its description is not valid";
    if (description.ParseFromString(description_)) problem = problemOf(description);
    description_ = {};
    chunks_.reset();
    if (!problem.empty()) {
      telemetry::log({name_}, spdlog::level::warn, "the scene that another server offers is not shown: {}",
                     problem);
      return false;
    }
    auto source = std::make_shared<EdgeSource>(
        offered_, std::move(description), [&edge = edge_] { edge.wake(); },
        [tunnels = tunnels_](const scene::RemotePeer& peer, std::function<void()> wake) {
          return tunnels->connect(peer, std::move(wake));
        });
    scene_ = edge_.server_.add(name_, source);
    scene_->paused = offered_.summary().paused();
    learn(offered_);
    const std::lock_guard lock(mutex_);
    source_ = std::move(source);
    for (const SharedBytes& event : early_) receive(*event);
    early_.clear();
    return true;
  }

  void end(const SharedBytes& last) {
    retire();
    tunnels_->close(last);
    if (scene_) edge_.server_.remove(scene_, last);
  }

  void forgetFrames() {
    if (source_) source_->forgetFrames();
  }

  void look(Clock::time_point now) {
    if (!isSuccessor()) tunnels_->poll();
    if (!scene_) {
      if (now - asked_ > kAskAgain && chunks_) ask(now);
      if (now - interestSent_ > kInterestPeriod) sendInterest(now);
      return;
    }
    delivery::RequestedFrames needed = source_->needs(now);
    // Its first frames must not refer to those of the other stream.
    if (isSuccessor()) needed.keyFrames = needed.qualities;
    receiveFrames(needed.qualities, now);
    const bool more = needed.qualities != sent_.qualities || (needed.keyFrames & ~sent_.keyFrames) != 0;
    const auto period =
        needed.keyFrames != 0 && !isSuccessor() ? Clock::duration(kKeyFramePeriod) : Clock::duration(kInterestPeriod);
    if (!more && now - interestSent_ < period) {
      sent_.keyFrames &= needed.keyFrames;
      return;
    }
    sent_ = needed;
    sendInterest(now);
  }

 private:
  void ask(Clock::time_point now) {
    v1::ChunkRequest request;
    request.set_content_id(received_ > 0 ? content_ : 0);
    request.set_index(received_);
    asked_ = now;
    edge_.nats_.publish(descriptionSubject(subject_), toBytes(request), inbox_);
  }

  void sendInterest(Clock::time_point now) {
    v1::Interest interest;
    interest.set_edge(edge_.id_);
    interest.set_qualities(sent_.qualities);
    interest.set_key_frames(sent_.keyFrames);
    interest.set_viewers(scene_ ? static_cast<std::uint32_t>(scene_->subscribers.size()) : 0);
    interestSent_ = now;
    edge_.nats_.publish(interestSubject(subject_), toBytes(interest));
  }

  void receiveFrames(std::uint8_t qualities, Clock::time_point now) {
    const bool single = source_->qualities() == 1;
    for (std::uint8_t quality = 0; quality < source_->qualities(); ++quality) {
      Frames& frames = frames_[quality];
      const bool needed = (qualities >> quality & 1) != 0;
      if (needed) frames.neededAt = now;
      if (needed && !frames.subscription)
        frames.subscription =
            edge_.nats_.subscribe(framesPattern(subject_, single ? std::nullopt : std::optional(quality)),
                                  [this](const auto&, const auto&, auto data) { receiveFrame(data); });
      if (frames.subscription && now - frames.neededAt > kQualityTime) {
        frames.subscription.reset();
        source_->forgetFrames();
      }
    }
  }

  void receiveFrame(std::span<const std::byte> data) {
    if (!source_->receiveFrame(data)) return edge_.server_.state().metrics.nats.refused.add();
    if (!arrived_.exchange(true) && isSuccessor()) edge_.wake();
  }

  void event(std::span<const std::byte> data) {
    const std::lock_guard lock(mutex_);
    if (source_)
      receive(data);
    else if (early_.size() < kMaxEarlyEvents)
      early_.push_back(std::make_shared<std::vector<std::byte>>(data.begin(), data.end()));
  }

  void receive(std::span<const std::byte> data) {
    if (!source_->receiveEvent(data)) edge_.server_.state().metrics.nats.refused.add();
  }

  struct Frames {
    Clock::time_point neededAt{};
    std::unique_ptr<Nats::Subscription> subscription;
  };

  const std::uint64_t origin_;
  Edge& edge_;
  const v1::OfferedScene offered_;
  const std::string name_, subject_, inbox_;
  const bool continues_ = false;

  std::uint64_t content_ = 0;
  std::uint32_t received_ = 0;  // chunks
  std::string description_;
  Clock::time_point asked_{}, interestSent_{};
  delivery::RequestedFrames sent_;
  std::shared_ptr<scene::LiveScene> scene_;  // once it is served

  std::mutex mutex_;  // protects the next two for events, which may come before serve()
  std::shared_ptr<EdgeSource> source_;
  std::deque<SharedBytes> early_;

  const std::shared_ptr<EdgeTunnels> tunnels_;
  std::atomic<bool> arrived_{false}, replaced_{false};

  std::unique_ptr<Nats::Subscription> events_, down_, chunks_;
  std::array<Frames, codec::kMaxQualities> frames_;
};

// A scene name with the stream that is served, and the one that will replace it.
struct Edge::Known {
  std::unique_ptr<Stream> served, next;
  Clock::time_point offered{};  // newest offer of the origin of `next`, or else of `served`
  bool lost = false;            // the viewers know that the picture stands still
  bool clashes = false;         // another origin's scene of this name is in the log

  const Stream& newest() const { return next ? *next : *served; }
};

Edge::Edge(hosting::SceneServer& server, const NatsOptions& options, Clock::duration keep)
    : server_(server), id_(randomId()), keep_(keep), nats_(options, server.state().metrics.nats) {
  offers_ = nats_.subscribe(kOffers, [this](const auto&, const auto&, auto data) { arrive(0, data); });
  thread_ = std::thread([this] { run(); });
}

Edge::~Edge() {
  offers_.reset();
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  for (auto& [name, known] : scenes_)
    for (auto* stream : {&known->served, &known->next})
      if (*stream) (*stream)->end(nullptr);
}

void Edge::waitForOffers() const {
  const Clock::time_point start = Clock::now();
  const auto waited = [&] { return Clock::now() - start; };
  while (waited() < kPatience && (waited() < kFirstOffers || server_.state().scenesNow().empty()))
    std::this_thread::sleep_for(kLookPeriod);
}

void Edge::arrive(std::uint64_t stream, std::span<const std::byte> bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (arrivals_.size() >= kMaxArrivals) return server_.state().metrics.nats.dropped.add();
    arrivals_.push_back({stream, std::make_shared<std::vector<std::byte>>(bytes.begin(), bytes.end())});
  }
  changed_.notify_all();
}

void Edge::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

void Edge::run() {
  Clock::time_point next = Clock::now();
  for (;;) {
    std::deque<Arrival> arrivals;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_until(lock, next, [this] { return stopping_ || woken_ || !arrivals_.empty(); });
      if (stopping_) return;
      woken_ = false;
      arrivals = std::exchange(arrivals_, {});
    }
    const Clock::time_point now = Clock::now();
    try {
      for (const Arrival& arrival : arrivals) {
        if (arrival.stream == 0) {
          v1::Offer offer;
          if (parse(*arrival.bytes, offer)) handle(offer, now);
          continue;
        }
        for (auto& [name, known] : scenes_)
          if (known->next && known->next->id() == arrival.stream &&
              known->next->receiveChunk(*arrival.bytes, now))
            serve(*known);
      }
      look(now);
    } catch (const std::exception& failure) {  // such as a lack of memory
      spdlog::error("edge: {}; trying again", failure.what());
    }
    next = now + kLookPeriod;
  }
}

void Edge::handle(const v1::Offer& offer, Clock::time_point now) {
  for (const v1::OfferedScene& offered : offer.scenes()) handle(offer.origin(), offered, now);
  // The origin has ended scenes that it offers no longer.
  for (auto& [name, known] : scenes_) {
    const auto offers = [&](const Stream& stream) {
      return stream.origin() != offer.origin() ||
             std::ranges::any_of(offer.scenes(), [&](const v1::OfferedScene& offered) {
               return offered.stream() == stream.id();
             });
    };
    if (known->next && known->next->isSuccessor()) {
      if (!offers(*known->next)) known->next.reset();  // the scene stays where it is
      continue;
    }
    if (!offers(known->newest())) known->offered = now - kOfferTime;
  }
}

void Edge::handle(std::uint64_t origin, const v1::OfferedScene& offered, Clock::time_point now) {
  const std::string& name = offered.summary().name();
  if (!isName(name) || offered.stream() == 0) return;
  if (!scenes_.contains(name)) {
    if (scenes_.size() >= kMaxScenes || offered.prepared()) return;
    auto known = std::make_unique<Known>();
    known->next = std::make_unique<Stream>(*this, origin, offered);
    known->offered = now;
    scenes_.emplace(name, std::move(known));
    return;
  }
  Known& known = *scenes_.at(name);
  const bool isServed = known.served && known.served->id() == offered.stream();
  if (isServed || known.newest().id() == offered.stream()) {
    known.offered = now;
    known.lost = false;
    if (isServed) known.served->learn(offered);
    if (!isServed && known.next->isSuccessor() && !offered.prepared()) replace(known);
    return;
  }
  if (known.served && known.served->id() == offered.continues()) {
    known.next = std::make_unique<Stream>(*this, origin, offered, *known.served);
    if (!offered.prepared()) replace(known);
    return;
  }
  if (offered.prepared()) return;
  if (known.newest().origin() != origin && now - known.offered < kOfferTime) {
    if (!std::exchange(known.clashes, true))
      telemetry::log({name}, spdlog::level::warn,
                     "two servers offer a scene of this name; the second one is not shown: rename its scene");
    return;
  }
  known.next = std::make_unique<Stream>(*this, origin, offered);
  known.offered = now;
}

void Edge::replace(Known& known) {
  known.next->replace();
  known.served->retire();
  known.served = std::move(known.next);
  known.lost = false;
  telemetry::log({known.served->scene()->name()}, spdlog::level::info, "follows this scene to another server");
}

void Edge::serve(Known& known) {
  if (!known.next->serve()) return;
  if (known.served)
    known.served->end(delivery::error(
        v1::ERROR_CODE_CUT_OFF, "the scene began again at the server that simulates it: join again", true));
  known.served = std::move(known.next);
  known.lost = false;
  telemetry::log({known.served->scene()->name()}, spdlog::level::info, "serves this scene of another server");
}

void Edge::look(Clock::time_point now) {
  const bool connected = nats_.connected();
  if (connected && !connectedSince_) {
    connectedSince_ = now;
    for (auto& [name, known] : scenes_)
      if (known->served) known->served->forgetFrames();
  }
  if (!connected && connectedSince_) {
    connectedSince_.reset();
    for (auto& [name, known] : scenes_)
      if (known->served) known->served->tell("this server has lost its connection to the others (NATS)");
  }
  std::erase_if(scenes_, [&](auto& entry) { return lookAt(entry.first, *entry.second, now); });
}

bool Edge::lookAt(const std::string& name, Known& known, Clock::time_point now) {
  if (known.next) known.next->look(now);
  if (known.served) known.served->look(now);
  if (known.next && known.next->isSuccessor() && known.next->arrived()) replace(known);
  // Offers that cannot arrive are not missing.
  if (!connectedSince_) return false;
  const Clock::duration silent = now - std::max(known.offered, *connectedSince_);
  if (silent < kOfferTime) return false;
  if (!std::exchange(known.lost, true) && known.served) {
    telemetry::log({name}, spdlog::level::warn, "the server that simulates this scene is lost");
    known.served->tell("the server that simulates the scene does not answer");
  }
  if (silent < kOfferTime + keep_) return false;
  telemetry::log({name}, spdlog::level::warn, "the server that simulates this scene has not come back");
  if (known.served)
    known.served->end(delivery::error(v1::ERROR_CODE_NOT_FOUND,
                                      fmt::format("the server that simulates '{}' is gone", name), true));
  return true;
}

}  // namespace clothstream::fleet

// SPDX-License-Identifier: MIT
#include "server/fleet/edge.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/fleet.pb.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/random_id.h"
#include "server/fleet/subjects.h"
#include "server/hosting/scene_server.h"
#include "server/messages/limits.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::fleet {
namespace {

using delivery::SharedBytes;
using schedule::Clock;
using namespace std::chrono_literals;

// Interval between looks at what viewers need.
constexpr auto kLookPeriod = 20ms;
// An origin that has offered nothing for this long counts as lost.
constexpr auto kOfferTime = 3s;
// Every origin has offered its scenes after this time.
constexpr auto kFirstOffers = 1500ms;
// Messages that wait for the thread. Further ones are dropped.
constexpr std::size_t kMaxArrivals = 1024;

bool isName(const std::string& name) {
  return !name.empty() && name.size() <= messages::limits::kMaxNameLength &&
         std::ranges::all_of(name, [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
         });
}

}  // namespace

// A scene name with the stream that is served, and the one that will replace it.
struct Edge::Known {
  std::unique_ptr<EdgeStream> served, next;
  Clock::time_point offered{};  // newest offer of the origin of `next`, or else of `served`
  bool lost = false;            // the viewers know that the picture stands still
  bool clashes = false;         // another origin's scene of this name is in the log

  const EdgeStream& newest() const { return next ? *next : *served; }
};

EdgeContext Edge::context() {
  return {
      .nats = nats_,
      .server = server_,
      .edge = id_,
      .wake = [this] { wake(); },
      .arrive = [this](std::uint64_t stream, std::span<const std::byte> bytes) { arrive(stream, bytes); }};
}

Edge::Edge(hosting::SceneServer& server, const NatsOptions& options, Clock::duration keep)
    : server_(server), id_(randomId()), keep_(keep), nats_(options, server.metrics.nats) {
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
  const auto waits = [&] {
    return waited() < kFirstOffers || loads_ || (waited() < kPatience && server_.scenes.all().empty());
  };
  while (waited() < kLongestWait && waits()) std::this_thread::sleep_for(kLookPeriod);
}

void Edge::arrive(std::uint64_t stream, std::span<const std::byte> bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (arrivals_.size() >= kMaxArrivals) return server_.metrics.nats.dropped.add();
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
  telemetry::nameThread("edge");
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
        for (auto& [name, known] : scenes_) receiveChunk(*known, arrival, now);
      }
      look(now);
    } catch (const std::exception& failure) {  // such as a subscription that fails
      spdlog::error("edge: {}; trying again", failure.what());
    }
    next = now + kLookPeriod;
  }
}

void Edge::receiveChunk(Known& known, const Arrival& arrival, Clock::time_point now) {
  for (auto* stream : {&known.served, &known.next}) {
    if (!*stream || (*stream)->id() != arrival.stream || !(*stream)->receiveChunk(*arrival.bytes, now))
      continue;
    if (stream == &known.next)
      serve(known);
    else
      known.served->serve();
    return;
  }
}

void Edge::handle(const v1::Offer& offer, Clock::time_point now) {
  for (const v1::OfferedScene& offered : offer.scenes()) handle(offer.origin(), offered, now);
  // The origin has ended scenes that it offers no longer.
  for (auto& [name, known] : scenes_) {
    const auto offers = [&](const EdgeStream& stream) {
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
    known->next = std::make_unique<EdgeStream>(context(), origin, offered);
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
    known.next = std::make_unique<EdgeStream>(context(), origin, offered, *known.served);
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
  known.next = std::make_unique<EdgeStream>(context(), origin, offered);
  known.offered = now;
}

void Edge::replace(Known& known) {
  known.next->replace();
  known.served->retire();
  known.served = std::move(known.next);
  known.lost = false;
  telemetry::log({known.served->scene()->name()}, spdlog::level::info,
                 "follows this scene to another server");
}

void Edge::serve(Known& known) {
  if (!known.next->serve()) return;
  if (known.served)
    known.served->end(
        delivery::error(v1::ERROR_CODE_CUT_OFF, "the server that simulates the scene was replaced", true));
  known.served = std::move(known.next);
  known.lost = false;
  telemetry::log({known.served->scene()->name()}, spdlog::level::info, "serves this scene of another server");
}

void Edge::look(Clock::time_point now) {
  const bool connected = nats_.connected();
  if (connected && !connectedSince_) {
    connectedSince_ = now;
    for (auto& [name, known] : scenes_) {
      if (known->served) known->served->refresh(now);
      if (known->next && known->next->isLoading()) known->next->refresh(now);
    }
  }
  if (!connected && connectedSince_) {
    connectedSince_.reset();
    for (auto& [name, known] : scenes_)
      if (known->served) known->served->tell("this server has lost its connection to the others (NATS)");
  }
  std::erase_if(scenes_, [&](auto& entry) { return lookAt(entry.first, *entry.second, now); });
  loads_ = std::ranges::any_of(scenes_, [](const auto& entry) {
    const Known& known = *entry.second;
    return !known.served && known.next && known.next->isLoading();
  });
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

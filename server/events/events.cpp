// SPDX-License-Identifier: MIT
#include "server/events/events.h"

#include <exception>
#include <utility>

#include <boost/asio/post.hpp>
#include <spdlog/spdlog.h>

#include "server/scene/live_scene.h"
#include "server/scene/roster.h"
#include "server/schedule/clock.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::events {

class Events::ObservedScene final : public scene::SceneObserver {
 public:
  ObservedScene(std::shared_ptr<Events> events, const scene::LiveScene& scene)
      : events_(std::move(events)), scene_(scene) {
    const std::lock_guard lock(events_->mutex_);
    events_->scenes_.insert(this);
  }
  ~ObservedScene() override {
    const std::lock_guard lock(events_->mutex_);
    events_->scenes_.erase(this);
    reportUsage();
  }
  ObservedScene(const ObservedScene&) = delete;
  ObservedScene& operator=(const ObservedScene&) = delete;

  void joined(const scene::Participant& participant, const scene::Subject& subject) override {
    push([&] { return Joined{participant.id, participant.role, subject}; });
  }
  void left(const scene::Participant& participant, const scene::Subject& subject,
            schedule::Clock::duration connected) override {
    const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(connected);
    push([&] { return Left{participant.id, participant.role, subject, schedule::seconds(milliseconds)}; });
  }

  // The caller holds the lock.
  void reportUsage() {
    push([&] {
      const double device = scene_.metrics.deviceTotal.buckets().sum;
      const std::uint64_t sent = scene_.metrics.sentBytes.value();
      return Usage{device - std::exchange(deviceSeconds_, device), sent - std::exchange(sentBytes_, sent)};
    });
  }

 private:
  // Reports what `make` returns, unless it is the use of nothing.
  template <class Make>
  void push(const Make& make) {
    Event event{.time = std::chrono::system_clock::now(),
                .scene = scene_.name(),
                .tenant = scene_.terms.tenant,
                .what = make()};
    const Usage* const usage = std::get_if<Usage>(&event.what);
    if (usage != nullptr && usage->deviceSeconds <= 0 && usage->sentBytes == 0) return;
    events_->sender_.push(std::move(event));
  }

  const std::shared_ptr<Events> events_;
  const scene::LiveScene& scene_;
  double deviceSeconds_ = 0;     // reported
  std::uint64_t sentBytes_ = 0;  // reported
};

Events::Events(EventsOptions options)
    : options_(std::move(options)),
      work_(boost::asio::make_work_guard(io_)),
      sender_(io_, options_.sender),
      usage_(io_) {
  reportUsageLater();
  thread_ = std::thread([this] { run(); });
}

Events::~Events() {
  boost::asio::post(io_, [this] { sender_.finish(options_.patience); });
  thread_.join();
  sender_.dropRest();
}

std::unique_ptr<scene::SceneObserver> Events::observe(const scene::LiveScene& scene) {
  return std::make_unique<ObservedScene>(shared_from_this(), scene);
}

scene::ObserverStatus Events::status() const {
  return {.delivered = sender_.delivered(), .retried = sender_.retried(), .dropped = sender_.dropped()};
}

void Events::run() {
  telemetry::nameThread("events");
  while (!io_.stopped()) {
    try {
      io_.run();
    } catch (const std::exception& failure) {  // no random numbers; the next event tries again
      spdlog::error("events: {}", failure.what());
    }
  }
}

void Events::reportUsageLater() {
  usage_.expires_after(options_.usagePeriod);
  usage_.async_wait([this](const boost::system::error_code& cancelled) {
    if (cancelled) return;
    {
      const std::lock_guard lock(mutex_);
      for (ObservedScene* scene : scenes_) scene->reportUsage();
    }
    reportUsageLater();
  });
}

}  // namespace clothstream::events

// SPDX-License-Identifier: MIT
// Tells a backend who joins and leaves scenes, and what scenes use.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/events/sender.h"
#include "server/scene/scene_observer.h"

namespace clothstream::events {

struct EventsOptions {
  SenderOptions sender;
  // Interval between the events of what a scene uses.
  std::chrono::milliseconds usagePeriod{60'000};
  // Time for events that wait at the end.
  std::chrono::milliseconds patience{3'000};
};

// Delivers on a thread of its own. Destroyed after all scenes that it observes: each of them shares it.
class Events final : public scene::Observer, public std::enable_shared_from_this<Events> {
 public:
  // Throws std::system_error if TLS cannot be used. Belongs to a std::shared_ptr.
  explicit Events(EventsOptions options);
  ~Events() override;
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  std::unique_ptr<scene::SceneObserver> observe(const scene::LiveScene& scene) override;
  scene::ObserverStatus status() const override;

 private:
  class ObservedScene;

  void run();
  void reportUsageLater();

  const EventsOptions options_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  Sender sender_;
  boost::asio::steady_timer usage_;

  std::mutex mutex_;  // protects `scenes_` and what they have reported
  std::set<ObservedScene*> scenes_;

  std::thread thread_;
};

}  // namespace clothstream::events

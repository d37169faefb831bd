// SPDX-License-Identifier: MIT
// Queue of events, and their delivery to a webhook.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/events/event.h"
#include "server/events/http_post.h"
#include "server/events/url.h"

namespace clothstream::events {

struct SenderOptions {
  Url url;
  std::string key;     // signs the messages
  std::string server;  // name of this server in the messages
  std::string agent;   // header `user-agent`
  // Events that wait, the one that is being delivered included. Beyond it the oldest are dropped.
  std::size_t maxWaiting = 10'000;
  // Time before the first retry. It doubles with each further one, up to the other time.
  std::chrono::milliseconds firstRetry{1'000}, longestRetry{60'000};
  PostTimeouts timeouts{};
};

// Delivers events one at a time, in their order. A status of 2xx means that the event was delivered. One of
// 4xx, except 408 and 429, drops the event. After everything else the same event is tried again, for any
// time.
//
// push() and the counters belong to any thread, everything else to the thread that runs the io_context, which
// must outlive the sender.
class Sender {
 public:
  Sender(boost::asio::io_context& io, SenderOptions options);

  // Does not block.
  void push(Event event);
  // Stops the io_context when all events are delivered, or after this time.
  void finish(std::chrono::milliseconds patience);
  // Drops the events that still wait. The io_context must have stopped.
  void dropRest();

  std::uint64_t delivered() const { return delivered_; }
  std::uint64_t retried() const { return retried_; }  // attempts that failed
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Waiting {
    Event event;
    std::string id, body;  // once it was tried
  };

  // Tries to deliver the oldest event, if there is one and none is being delivered.
  void deliver();
  void answered(const HttpPost::Answer& answer);
  void retryLater(const HttpPost::Answer& answer);
  void endDelivery(bool removesFirst);
  void stopIfDone();

  boost::asio::io_context& io_;
  const SenderOptions options_;

  std::atomic<std::uint64_t> delivered_{0}, retried_{0}, dropped_{0};

  std::mutex mutex_;  // protects the next four
  std::deque<Waiting> waiting_;
  bool delivering_ = false;      // the first one
  bool wakes_ = false;           // a call of deliver() is posted
  bool overflowLogged_ = false;  // since the newest delivery

  HttpPost post_;
  boost::asio::steady_timer retry_, end_;
  std::chrono::milliseconds delay_;  // before the next retry
  bool waitsForRetry_ = false;
  bool failing_ = false;  // the newest attempt failed
  bool finishing_ = false;
};

}  // namespace clothstream::events

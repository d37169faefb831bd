// SPDX-License-Identifier: MIT
#include "server/events/sender.h"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/events/webhook.h"

namespace clothstream::events {
namespace {

constexpr unsigned kRequestTimeout = 408, kTooManyRequests = 429;

bool isSuccess(unsigned status) {
  return status >= 200 && status < 300;
}

// Whether the receiver will never accept the message.
bool isRefusal(unsigned status) {
  return status >= 400 && status < 500 && status != kRequestTimeout && status != kTooManyRequests;
}

std::int64_t secondsNow() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

}  // namespace

Sender::Sender(boost::asio::io_context& io, SenderOptions options)
    : io_(io),
      options_(std::move(options)),
      post_(io, options_.url, options_.timeouts),
      retry_(io),
      end_(io),
      delay_(options_.firstRetry) {}

void Sender::push(Event event) {
  bool overflows = false;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= options_.maxWaiting) {
      waiting_.erase(waiting_.begin() + (delivering_ ? 1 : 0));
      ++dropped_;
      overflows = !std::exchange(overflowLogged_, true);
    }
    waiting_.push_back({.event = std::move(event), .id = {}, .body = {}});
    if (!wakes_) {
      boost::asio::post(io_, [this] { deliver(); });
      wakes_ = true;
    }
  }
  if (overflows)
    spdlog::error("events: {} wait, and the oldest are dropped until one is delivered", options_.maxWaiting);
}

void Sender::deliver() {
  HttpPost::Headers headers;
  std::string body;
  {
    const std::lock_guard lock(mutex_);
    wakes_ = false;
    if (delivering_ || waitsForRetry_ || waiting_.empty()) return;
    Waiting& first = waiting_.front();
    if (first.id.empty()) {
      first.body = toJson(first.event, options_.server);
      first.id = makeId();
    }
    body = first.body;
    const std::int64_t timestamp = secondsNow();
    headers = {{"content-type", "application/json"},
               {"user-agent", options_.agent},
               {"webhook-id", first.id},
               {"webhook-timestamp", fmt::format("{}", timestamp)},
               {"webhook-signature", signatureOf(options_.key, first.id, timestamp, body)}};
    delivering_ = true;
  }
  post_.send(headers, std::move(body), [this](const HttpPost::Answer& answer) { answered(answer); });
}

void Sender::answered(const HttpPost::Answer& answer) {
  const bool success = isSuccess(answer.status), refusal = isRefusal(answer.status);
  endDelivery(success || refusal);
  if (!success && !refusal) return retryLater(answer);
  delay_ = options_.firstRetry;
  if (success) {
    ++delivered_;
    if (std::exchange(failing_, false)) spdlog::info("events: delivered again");
  } else {
    ++dropped_;
    spdlog::warn("events: {} answers with status {}; the event is dropped", options_.url.authority,
                 answer.status);
  }
  stopIfDone();
  deliver();
}

void Sender::endDelivery(bool removesFirst) {
  const std::lock_guard lock(mutex_);
  delivering_ = false;
  if (!removesFirst) return;
  waiting_.pop_front();
  overflowLogged_ = false;
}

void Sender::retryLater(const HttpPost::Answer& answer) {
  ++retried_;
  if (!std::exchange(failing_, true))
    spdlog::warn("events: {}: {}; trying again", options_.url.authority,
                 answer.status == 0 ? answer.problem : fmt::format("status {}", answer.status));
  waitsForRetry_ = true;
  retry_.expires_after(delay_);
  delay_ = std::min(2 * delay_, options_.longestRetry);
  // Also called when the timer is cancelled, which ends the wait.
  retry_.async_wait([this](const boost::system::error_code&) {
    waitsForRetry_ = false;
    deliver();
  });
}

void Sender::finish(std::chrono::milliseconds patience) {
  finishing_ = true;
  end_.expires_after(patience);
  end_.async_wait([this](const boost::system::error_code&) { io_.stop(); });
  delay_ = options_.firstRetry;
  retry_.cancel();
  stopIfDone();
}

void Sender::stopIfDone() {
  if (!finishing_) return;
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) io_.stop();
}

void Sender::dropRest() {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return;
  dropped_ += waiting_.size();
  spdlog::warn("events: {} were not delivered before the end", waiting_.size());
  waiting_.clear();
}

}  // namespace clothstream::events

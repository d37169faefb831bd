// SPDX-License-Identifier: MIT
#include "clients/xr/connection/connection.h"

#include <array>
#include <string_view>

#include <spdlog/spdlog.h>

#include "proto/text/printable.h"

namespace clothstream::xr {
namespace {

// Called by the threads of libclothstream. Attempts to reconnect repeat themselves ten times a second. Why a
// stream has ended is logged by Connection.
void logLine(void*, std::uint32_t level, const char* text) {
  static std::mutex mutex;
  static std::string last;
  const std::string_view line = text;
  const std::lock_guard lock(mutex);
  if (line == last || line.starts_with("reconnecting in") || level == CLOTHSTREAM_LOG_ERROR)
    return spdlog::debug("{}", line);
  last = line;
  spdlog::log(level == CLOTHSTREAM_LOG_WARNING ? spdlog::level::warn : spdlog::level::info, "{}", line);
}

clothstream_options libraryOptions(const ConnectionOptions& options) {
  clothstream_options out;
  clothstream_default_options(&out);
  out.role = options.role;
  out.quality = options.quality;
  out.scene = options.scene.c_str();
  out.client_name = "clothstream-xr";
  out.display_name = options.name.c_str();
  out.join_timeout_ms = options.joinTimeoutMs;
  out.token = options.token.c_str();
  out.ca_file = options.caFile.c_str();
  out.fingerprint = options.fingerprint.c_str();
  out.log = logLine;
  out.transport = options.transport;
  return out;
}

}  // namespace

Connection::Connection(ConnectionOptions options) : options_(std::move(options)) {
  worker_ = std::thread([this] { work(); });
  begin();
}

Connection::~Connection() {
  {
    const std::lock_guard lock(mutex_);
    wanted_.reset();
    ends_ = true;
  }
  changed_.notify_all();
  worker_.join();
  if (finished_) clothstream_close(finished_->stream);
  clothstream_close(stream_);
}

std::uint32_t Connection::update(std::uint64_t nowUs) {
  std::uint32_t events = 0;
  std::optional<Attempt> finished;
  {
    const std::lock_guard lock(mutex_);
    finished.swap(finished_);
  }
  if (finished) take(std::move(*finished), nowUs, events);
  if (!isOpening_ && phase_ == Phase::waiting && nowUs >= retryUs_) begin();
  if (stream_ && !ended_) follow(nowUs, events);
  return events;
}

void Connection::join(const std::string& scene) {
  options_.scene = scene;
  retry();
}

void Connection::setQuality(std::uint32_t quality) {
  options_.quality = quality;
  retry();
}

void Connection::retry() {
  failures_ = 0;
  if (isOpening_) {
    isStale_ = true;
  } else {
    begin();
  }
}

void Connection::begin() {
  isOpening_ = true;
  isStale_ = false;
  // An outage stays on the panel until an attempt succeeds.
  if (trouble_.title.empty()) show(Phase::connecting, {});
  phase_ = Phase::connecting;
  {
    const std::lock_guard lock(mutex_);
    wanted_.emplace();
    wanted_->options = options_;
  }
  changed_.notify_all();
}

void Connection::take(Attempt attempt, std::uint64_t nowUs, std::uint32_t& events) {
  isOpening_ = false;
  // A code is good for one exchange; its token lasts.
  if (!attempt.token.empty()) {
    options_.token = attempt.token;
    options_.code.clear();
  }
  if (isStale_) {
    close(attempt.stream);
    return begin();
  }
  if (attempt.result != CLOTHSTREAM_OK) return fail(attempt.step, attempt.result, attempt.error, nowUs);
  close(std::exchange(stream_, attempt.stream));
  joined_ = options_;
  ++clientNumber_;
  ended_ = false;
  failures_ = 0;
  show(Phase::live, {});
  cs_play_out_options playOut;
  cs_default_play_out(&playOut);
  const Acquired acquired = acquire();
  cs_set_play_out(acquired.client(), &playOut);
  cs_set_local_contact(acquired.client(), 1);
  cs_want_contacts(acquired.client(), 1, nowUs);
  cs_list_scenes(acquired.client());
  events |= CS_EVENT_DESCRIPTION | CS_EVENT_PARAMETERS | CS_EVENT_PARTICIPANTS;
}

void Connection::follow(std::uint64_t nowUs, std::uint32_t& events) {
  std::uint32_t changes = 0;
  const clothstream_result result = clothstream_wait(stream_, 0, &changes);
  events |= changes;
  if (result != CLOTHSTREAM_OK) {
    ended_ = true;
    return fail(Step::streaming, result, clothstream_error_text(), nowUs);
  }
  if (isOpening_) return;  // the user has chosen another scene
  const Acquired acquired = acquire();
  const cs_state state = cs_get_state(acquired.client());
  if (state == CS_STATE_JOINED && phase_ != Phase::live) {
    // A server that has started again knows nothing of what this client wanted.
    cs_want_contacts(acquired.client(), 1, nowUs);
    cs_list_scenes(acquired.client());
    show(Phase::live, {});
  }
  if (state == CS_STATE_RECONNECTING && phase_ != Phase::reconnecting)
    show(Phase::reconnecting, lostTrouble(options_.address));
}

void Connection::fail(Step step, clothstream_result result, const std::string& text, std::uint64_t nowUs) {
  Trouble trouble = troubleOf(step, result, text);
  if (stream_ && !ended_) {
    // The user stays where they are; follow() finds the phase.
    options_ = joined_;
    notice_ = trouble.title + ": " + text;
    return spdlog::warn("{}", printable(notice_));
  }
  isInvalid_ = result == CLOTHSTREAM_INVALID;
  retryUs_ = nowUs + retryDelayUs(++failures_);
  show(retriesByItself(result) ? Phase::waiting : Phase::refused, std::move(trouble));
}

bool Connection::leave() {
  std::optional<Attempt> finished;
  {
    const std::lock_guard lock(mutex_);
    finished.swap(finished_);
  }
  if (finished) {
    isOpening_ = false;
    clothstream_close(finished->stream);
  }
  clothstream_close(std::exchange(stream_, nullptr));
  return isOpening_;
}

void Connection::show(Phase phase, Trouble trouble) {
  if (!(trouble == trouble_)) {
    if (!trouble.title.empty()) {
      spdlog::warn("{}: {}", printable(trouble.title), printable(trouble.advice));
    } else {
      spdlog::info("The connection to {} is back", options_.address);
    }
  }
  phase_ = phase;
  trouble_ = std::move(trouble);
}

void Connection::close(clothstream_stream* stream) {
  if (!stream) return;
  {
    const std::lock_guard lock(mutex_);
    closing_.push_back(stream);
  }
  changed_.notify_all();
}

// Waits for the network; never touches what the drawing thread owns.
void Connection::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ends_ || wanted_ || !closing_.empty(); });
    if (!closing_.empty()) {
      clothstream_stream* const closing = closing_.back();
      closing_.pop_back();
      lock.unlock();
      clothstream_close(closing);
      lock.lock();
    } else if (wanted_) {
      Attempt attempt = std::move(*wanted_);
      wanted_.reset();
      lock.unlock();
      run(attempt);
      lock.lock();
      finished_ = std::move(attempt);
    } else {
      return;
    }
  }
}

void Connection::run(Attempt& attempt) {
  clothstream_options options = libraryOptions(attempt.options);
  const char* const address = attempt.options.address.c_str();
  if (!attempt.options.code.empty()) {
    attempt.step = Step::pairing;
    std::array<char, CLOTHSTREAM_TOKEN_BYTES> token{};
    attempt.result =
        clothstream_pair(address, attempt.options.code.c_str(), &options, token.data(), token.size());
    if (attempt.result != CLOTHSTREAM_OK) {
      attempt.error = clothstream_error_text();
      return;
    }
    attempt.token = token.data();
    options.token = attempt.token.c_str();
    attempt.step = Step::joining;
  }
  attempt.result = clothstream_open(address, &options, &attempt.stream);
  if (attempt.result != CLOTHSTREAM_OK) attempt.error = clothstream_error_text();
}

}  // namespace clothstream::xr

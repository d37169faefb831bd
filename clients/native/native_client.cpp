// SPDX-License-Identifier: MIT
// One thread has the transport and the client. A mutex is held except while the thread waits.
#include "clients/native/native_client.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <charconv>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "clients/native/vertex_limit.h"

namespace clothstream {
namespace {

using SteadyClock = std::chrono::steady_clock;

// Longest time between two calls of cs_update.
constexpr std::chrono::milliseconds kUpdateInterval{50};

// Bounds of openingTimeout().
constexpr std::chrono::milliseconds kShortestOpening{150}, kLongestOpening{2000};

// Interval at which a waiting join() calls `cancelled`.
constexpr std::chrono::milliseconds kCancelInterval{100};

// Number of seconds as text: "10" or "0.5".
std::string seconds(std::chrono::milliseconds time) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), std::chrono::duration<double>(time).count());
  return {text.data(), end.ptr};
}

cs_client* createCore(const NativeClientOptions& options) {
  const cs_client_options core{.role = options.role,
                               .scene = options.scene.c_str(),
                               .client_name = options.clientName.c_str(),
                               .display_name = options.displayName.c_str()};
  return cs_create(&core);
}

}  // namespace

class NativeClient::Stream {
 public:
  Stream(ServerAddress address, std::unique_ptr<Transport> transport, const NativeClientOptions& options,
         OnEvents onEvents)
      : address_(std::move(address)),
        current_(address_),
        options_(options),
        onEvents_(std::move(onEvents)),
        log_(options.onLog, address_.address),
        core_(createCore(options), &cs_destroy),
        transport_(std::move(transport)) {
    cs_set_token(core_.get(), address_.token.c_str());
    cs_want(core_.get(), options.quality);
    cs_set_clock(core_.get(), &NativeClient::nowUs);
    cs_hold_acknowledgements(core_.get(), options.acknowledgesSeen ? 1 : 0);
    limitVertices(core_.get(), options.maxVertices);
    missing_ = transport_->missing();
    thread_ = std::thread([this] { run(); });
  }

  ~Stream() {
    {
      const std::lock_guard lock(mutex_);
      leaving_ = true;
      wake();
    }
    thread_.join();
  }

  // Returns nothing if the client joins in time.
  std::optional<Failure> waitUntilJoined() {
    const auto deadline = SteadyClock::now() + options_.joinTimeout;
    std::unique_lock lock(mutex_);
    while (SteadyClock::now() < deadline) {
      const auto until = std::min(deadline, SteadyClock::now() + kCancelInterval);
      if (changed_.wait_until(lock, until, [&] { return ended_ || isJoined(); })) return joinFailure();
      if (options_.cancelled && options_.cancelled())
        return Failure{Failure::Kind::unreachable, "Gave up before " + address_.address + " answered."};
    }
    if (wasJoined_ && missing_) return Failure{Failure::Kind::unreachable, missing_->text};
    return Failure{Failure::Kind::unreachable, "No clothstream-server answers at " + address_.address +
                                                   " within " + seconds(options_.joinTimeout) +
                                                   " s: is it running there, and is the address right?"};
  }

  void lock() {
    assert(std::this_thread::get_id() != thread_.get_id());
    std::unique_lock lock(mutex_);
    turn_.wait(lock, [&] { return !threadWaits_; });
    lock.release();
  }

  void unlock() {
    if (!waits_) cs_acknowledge_seen(core_.get());
    wake();
    mutex_.unlock();
  }

  cs_client* core() const { return core_.get(); }

  std::uint32_t wait(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    waits_ = true;
    if (std::exchange(reportedFrame_, false)) {
      cs_acknowledge_seen(core_.get());
      wake();
    }
    changed_.wait_for(lock, timeout, [&] { return hasNews_ || ended_; });
    hasNews_ = false;
    reportedFrame_ = (events_ & CS_EVENT_FRAME) != 0;
    return std::exchange(events_, 0);
  }

  std::optional<Failure> ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }

  std::optional<cs_datagram_statistics> datagrams() const {
    const std::lock_guard lock(datagramsMutex_);
    return datagrams_;
  }

 private:
  // Whether join() need not wait any more.
  bool isJoined() const { return wasJoined_ && (!missing_ || missing_->isFinal); }
  std::optional<Failure> joinFailure() const {
    if (ended_ || !missing_) return ended_;
    return Failure{Failure::Kind::refused, missing_->text};
  }

  // Makes the thread check for outgoing messages.
  void wake() {
    if (!ended_) transport_->wake();
  }

  void run() {
    const std::lock_guard lock(mutex_);
    do {
      connect();
      while (transport_->active()) step(kUpdateInterval);
    } while (waitForNextAttempt());
    end();
  }

  void step(std::chrono::microseconds atMost) {
    mutex_.unlock();
    transport_->wait(atMost);
    threadWaits_ = true;
    mutex_.lock();
    threadWaits_ = false;
    turn_.notify_all();
    if (!opened_ && transport_->hasOpened()) {
      opened_ = true;
      openingTook_ = SteadyClock::now() - begun_;
      attempts_ = 0;
    }
    if (const auto message = transport_->receive()) received(*message);
    update();
  }

  void connect() {
    const std::string server = cs_connect_server(core_.get());
    current_ = address_.at(server);
    cs_follow_redirects(core_.get(), mayFollow() ? 1 : 0);
    cs_connecting(core_.get(), NativeClient::nowUs());
    ++attempts_;
    opened_ = silent_ = swallowed_ = false;
    begun_ = lastHeard_ = SteadyClock::now();
    transport_->connect(server);
  }

  // A token goes to other machines only with TLS.
  bool mayFollow() const { return address_.isEncrypted() || *cs_token(core_.get()) == '\0'; }

  // Waits after the end of a connection until the next attempt is due. Returns false if no attempt follows.
  bool waitForNextAttempt() {
    if (!disconnectedAt_) disconnectedAt_ = SteadyClock::now();
    const ServerAddress next = address_.at(cs_connect_server(core_.get()));
    const bool redirected = next.address != current_.address;
    // A join ends after options_.joinTimeout, by leaving_.
    const auto giveUpAt =
        wasJoined_ ? *disconnectedAt_ + options_.reconnectFor : SteadyClock::time_point::max();
    const bool tries = wasJoined_ ? options_.reconnectFor.count() > 0 : redirected;
    if (!tries || leaving_ || cs_get_state(core_.get()) == CS_STATE_FAILED) return false;
    reconnects_ = wasJoined_;
    if (redirected)
      log_.redirected(next.address);
    else
      log_.lost(transport_->lost());
    cs_disconnected(core_.get(), NativeClient::nowUs());
    if (wasJoined_) announce(0);
    if (const std::uint64_t now = NativeClient::nowUs(), due = cs_connect_at(core_.get());
        due > now && due != UINT64_MAX)
      log_.nextAttempt(std::chrono::microseconds(due - now));
    for (;;) {
      const std::uint64_t now = NativeClient::nowUs(), at = cs_connect_at(core_.get());
      if (leaving_ || SteadyClock::now() >= giveUpAt) return false;
      if (now >= at || swallowed_) return true;
      step(std::chrono::microseconds(
          std::min<std::uint64_t>(at - now, std::chrono::microseconds(kUpdateInterval).count())));
    }
  }

  void received(std::span<const std::byte> message) {
    lastHeard_ = SteadyClock::now();
    if (options_.onMessage) options_.onMessage(message);
    const std::uint32_t events =
        cs_receive(core_.get(), reinterpret_cast<const std::uint8_t*>(message.data()), message.size(),
                   NativeClient::nowUs());
    if ((events & CS_EVENT_MOVING) != 0) transport_->prepare(cs_next_server(core_.get()));
    if (events != 0) announce(events);
  }

  void announce(std::uint32_t events) {
    log_.received(core_.get(), events);
    onEvents_(core_.get(), events);
    if (cs_get_state(core_.get()) == CS_STATE_JOINED) disconnectedAt_.reset();
    if ((events & CS_EVENT_DESCRIPTION) != 0) wasJoined_ = true;
    events_ |= events;
    hasNews_ = true;
    changed_.notify_all();
  }

  void update() {
    cs_update(core_.get(), NativeClient::nowUs());
    const auto now = SteadyClock::now();
    const bool failed = cs_get_state(core_.get()) == CS_STATE_FAILED;
    if (!transport_->active()) return;
    if (leaving_ || failed) return leave(now);
    const bool tooLong = now - lastHeard_ > options_.silenceTimeout && opened_;
    const bool givenUp = wasJoined_ && options_.reconnectFor.count() > 0 &&
                         NativeClient::nowUs() >= cs_connect_at(core_.get());
    swallowed_ = reconnects_ && !opened_ && now - begun_ > openingTimeout();
    if (tooLong || givenUp || swallowed_) {
      silent_ = true;
      transport_->cancel();
    }
    negotiate();
    write();
  }

  void negotiate() {
    transport_->negotiate(*core_);
    {
      const std::lock_guard lock(datagramsMutex_);
      datagrams_ = transport_->datagrams();
    }
    if (!missing_) return;
    missing_ = transport_->missing();
    changed_.notify_all();
  }

  // Longest time to open a connection while reconnecting, since a link that was just restored may have lost
  // the first packets. Grows with each attempt, since opening may take longer than before.
  SteadyClock::duration openingTimeout() const {
    const auto first = std::clamp<SteadyClock::duration>(3 * openingTook_, kShortestOpening, kLongestOpening);
    return first + first * attempts_ / 64;
  }

  void write() {
    std::size_t bytes = 0;
    while (transport_->canWrite()) {
      const std::uint8_t* message = cs_next_outgoing(core_.get(), &bytes);
      if (!message) return;
      transport_->write(std::as_bytes(std::span(message, bytes)));
    }
  }

  // Says goodbye. The server then has kClosingTime to end the connection.
  void leave(SteadyClock::time_point now) {
    if (!cancelAt_) cancelAt_ = now + kClosingTime;
    if (!opened_ || now >= *cancelAt_) return transport_->cancel();
    transport_->leave();
  }

  Failure reason() const {
    if (cs_get_state(core_.get()) == CS_STATE_FAILED) {
      const std::uint32_t code = cs_error_code(core_.get());
      const bool saidByServer = code != 0;
      const std::string text = cs_error_text(core_.get());
      return {Failure::Kind::refused,
              saidByServer ? "The server at " + current_.address + " refuses: " + text : text,
              code == CS_ERROR_UNAUTHENTICATED};
    }
    if (leaving_) return {Failure::Kind::lost, "The client left the stream."};
    if (silent_ && !transport_->endedByServer() && !reconnects_)
      return {Failure::Kind::lost, "The server at " + current_.address + " has sent nothing for " +
                                       seconds(options_.silenceTimeout) + " s: the stream is lost."};
    if (!wasJoined_) return transport_->notJoined();
    Failure failure = transport_->lost();
    if (reconnects_)
      failure.text += " The client could not reconnect within " + seconds(options_.reconnectFor) + " s.";
    return failure;
  }

  void end() {
    ended_ = reason();
    log_.ended(*ended_, leaving_);
    changed_.notify_all();
    transport_.reset();
  }

  const ServerAddress address_;
  ServerAddress current_;  // of the newest connection; used by the thread only
  const NativeClientOptions options_;
  const OnEvents onEvents_;
  StreamLog log_;  // used by the thread only
  // Set while the thread waits for the mutex. Then lock() lets the thread go first.
  std::atomic<bool> threadWaits_{false};
  std::condition_variable turn_;
  mutable std::mutex datagramsMutex_;
  std::optional<cs_datagram_statistics> datagrams_;  // guarded by datagramsMutex_
  // Guards everything below. The thread releases it only while it waits for the transport.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool hasNews_ = false;        // since the last wait()
  std::uint32_t events_ = 0;    // since the last wait()
  bool waits_ = false;          // the program calls wait()
  bool reportedFrame_ = false;  // by the last wait()
  std::optional<Failure> ended_;
  std::unique_ptr<cs_client, decltype(&cs_destroy)> core_;
  // Reset when the stream has ended. Other threads only call its wake().
  std::unique_ptr<Transport> transport_;
  std::optional<Transport::Missing> missing_;  // nothing from the time on at which the transport had all
  bool leaving_ = false, wasJoined_ = false, reconnects_ = false;
  // About the newest connection.
  bool opened_ = false, silent_ = false, swallowed_ = false;
  SteadyClock::time_point begun_, lastHeard_;
  SteadyClock::duration openingTook_ = kLongestOpening;    // of the last connection that opened
  int attempts_ = 0;                                       // since the last connection
  std::optional<SteadyClock::time_point> disconnectedAt_;  // set while it is disconnected or reconnects
  std::optional<SteadyClock::time_point> cancelAt_;
  std::thread thread_;
};

NativeClient::NativeClient(std::unique_ptr<Stream> stream) : stream_(std::move(stream)) {}

NativeClient::~NativeClient() = default;

tl::expected<std::unique_ptr<NativeClient>, Failure> NativeClient::join(const ServerAddress& address,
                                                                        std::unique_ptr<Transport> transport,
                                                                        const NativeClientOptions& options,
                                                                        OnEvents onEvents) {
  auto stream = std::make_unique<Stream>(address, std::move(transport), options, std::move(onEvents));
  if (std::optional<Failure> failure = stream->waitUntilJoined()) return tl::unexpected(std::move(*failure));
  return std::unique_ptr<NativeClient>(new NativeClient(std::move(stream)));
}

cs_client* NativeClient::lock() {
  stream_->lock();
  return stream_->core();
}

void NativeClient::unlock() {
  stream_->unlock();
}

void NativeClient::visit(const std::function<void(cs_client*)>& task) {
  const std::lock_guard lock(*stream_);
  task(stream_->core());
}

std::uint32_t NativeClient::wait(std::chrono::milliseconds timeout) {
  return stream_->wait(timeout);
}

std::optional<cs_datagram_statistics> NativeClient::datagrams() const {
  return stream_->datagrams();
}

std::optional<Failure> NativeClient::ended() const {
  return stream_->ended();
}

std::uint64_t NativeClient::nowUs() {
  const auto now = SteadyClock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(now).count());
}

}  // namespace clothstream

// SPDX-License-Identifier: MIT
// One call at a time on one completion queue and thread. A mutex is held except while the thread waits.
#include "clients/grpc/grpc_client.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <grpcpp/alarm.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include "clients/grpc/channel.h"

namespace clothstream {
namespace {

using SteadyClock = std::chrono::steady_clock;
using SystemClock = std::chrono::system_clock;

constexpr const char* kJoinMethod = "/clothstream.v1.ClothStream/Join";
// Longest time between two calls of cs_update.
constexpr std::chrono::milliseconds kUpdateInterval{50};
// Time that the server has to end a stream after the client has left.
constexpr std::chrono::milliseconds kClosingTime{500};

// Bounds of openingTimeout().
constexpr std::chrono::milliseconds kShortestOpening{150}, kLongestOpening{2000};

// Interval at which a waiting join() calls `cancelled`.
constexpr std::chrono::milliseconds kCancelInterval{100};

// Kind of a completion.
enum Operation : std::intptr_t { kStarted = 1, kRead, kWritten, kHalfClosed, kFinished, kWoken };

double seconds(std::chrono::milliseconds time) {
  return std::chrono::duration<double>(time).count();
}

void* tagOf(Operation operation) {
  // gRPC only returns the tag. NOLINTNEXTLINE(performance-no-int-to-ptr)
  return reinterpret_cast<void*>(operation);
}

}  // namespace

class GrpcClient::Stream {
 public:
  Stream(ServerAddress address, const GrpcClientOptions& options, OnEvents onEvents)
      : address_(std::move(address)),
        options_(options),
        onEvents_(std::move(onEvents)),
        core_(cs_create_as(options.scene.c_str(), options.clientName.c_str(), options.displayName.c_str(),
                           options.role),
              &cs_destroy) {
    cs_set_token(core_.get(), address_.token.c_str());
    cs_want(core_.get(), options.quality, options.temporalLayers);
    cs_set_clock(core_.get(), &GrpcClient::nowUs);
    if (options.maxVertices > 0) {
      cs_limits limits;
      cs_default_limits(&limits);
      limits.max_vertices = options.maxVertices;
      limits.max_triangles = 2 * options.maxVertices;
      cs_set_limits(core_.get(), &limits);
    }
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
      if (changed_.wait_until(lock, until, [&] { return wasJoined_ || ended_; })) return ended_;
      if (options_.cancelled && options_.cancelled())
        return Failure{Failure::Kind::unreachable,
                       fmt::format("Gave up before {} answered.", address_.address)};
    }
    return Failure{
        Failure::Kind::unreachable,
        fmt::format("No clothstream-server answers at {} within {} s: is it running there, and is the "
                    "address right?",
                    address_.address, seconds(options_.joinTimeout))};
  }

  void lock() {
    assert(std::this_thread::get_id() != thread_.get_id());
    std::unique_lock lock(mutex_);
    turn_.wait(lock, [&] { return !threadWaits_; });
    lock.release();
  }

  void unlock() {
    wake();
    mutex_.unlock();
  }

  cs_client* core() const { return core_.get(); }

  std::uint32_t wait(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return hasNews_ || ended_; });
    hasNews_ = false;
    return std::exchange(events_, 0);
  }

  std::optional<Failure> ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }

 private:
  // Makes the thread check for outgoing messages. At most one alarm is pending.
  void wake() {
    if (wakeUnderway_ || ended_) return;
    wakeUnderway_ = true;
    alarm_.Set(&queue_, SystemClock::now(), tagOf(kWoken));
  }

  // State of one connection.
  struct Call {
    explicit Call(const ServerAddress& address) : stub(makeChannel(address)) {}

    grpc::GenericStub stub;
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream;
    grpc::ByteBuffer incoming;
    grpc::Status status;
    const SteadyClock::time_point begun = SteadyClock::now();
    int underway = 0;  // operations
    bool started = false, writing = false, broken = false, halfClosed = false, finishing = false;
    bool silent = false, swallowed = false;
  };

  void run() {
    const std::lock_guard lock(mutex_);
    do {
      connect();
      while (call_->underway > 0) step(SystemClock::now() + kUpdateInterval);
    } while (waitForNextAttempt());
    end();
  }

  void step(SystemClock::time_point until) {
    void* tag = nullptr;
    bool ok = false;
    mutex_.unlock();
    const auto next = queue_.AsyncNext(&tag, &ok, until);
    threadWaits_ = true;
    mutex_.lock();
    threadWaits_ = false;
    turn_.notify_all();
    if (next == grpc::CompletionQueue::GOT_EVENT)
      completed(static_cast<Operation>(reinterpret_cast<std::intptr_t>(tag)), ok);
    update();
  }

  void connect() {
    cs_connecting(core_.get(), GrpcClient::nowUs());
    ++attempts_;
    call_.emplace(address_);
    lastHeard_ = SteadyClock::now();
    call_->stream = call_->stub.PrepareCall(&call_->context, kJoinMethod, &queue_);
    ++call_->underway;
    call_->stream->StartCall(tagOf(kStarted));
  }

  // Waits after the end of a call until the next attempt is due. Returns false if no attempt follows.
  bool waitForNextAttempt() {
    if (!disconnectedAt_) disconnectedAt_ = SteadyClock::now();
    const auto giveUpAt = *disconnectedAt_ + options_.reconnectFor;
    const bool tries = wasJoined_ && options_.reconnectFor.count() > 0;
    if (!tries || leaving_ || cs_get_state(core_.get()) == CS_STATE_FAILED) return false;
    reconnects_ = true;
    cs_disconnected(core_.get(), GrpcClient::nowUs());
    announce(0);
    for (;;) {
      const std::uint64_t now = GrpcClient::nowUs(), at = cs_connect_at(core_.get());
      if (leaving_ || SteadyClock::now() >= giveUpAt) return false;
      if (now >= at || call_->swallowed) return true;
      const auto wait = std::chrono::microseconds(
          std::min<std::uint64_t>(at - now, std::chrono::microseconds(kUpdateInterval).count()));
      step(SystemClock::now() + wait);
    }
  }

  void completed(Operation operation, bool ok) {
    if (operation == kWoken) {
      wakeUnderway_ = false;
      return;
    }
    --call_->underway;
    switch (operation) {
      case kStarted:
        if (!ok) return finish();
        call_->started = true;
        openingTook_ = SteadyClock::now() - call_->begun;
        attempts_ = 0;
        return read();
      case kRead:
        return ok ? received() : finish();
      case kWritten:
        call_->writing = false;
        // A failed write means that the stream has ended; the read fails too.
        call_->broken |= !ok;
        return;
      case kHalfClosed:
      case kFinished:
      case kWoken:
        return;
    }
  }

  void read() {
    ++call_->underway;
    call_->stream->Read(&call_->incoming, tagOf(kRead));
  }

  void received() {
    lastHeard_ = SteadyClock::now();
    grpc::Slice bytes;
    if (call_->incoming.DumpToSingleSlice(&bytes).ok()) {
      if (options_.onMessage) options_.onMessage(std::as_bytes(std::span(bytes.begin(), bytes.size())));
      const std::uint32_t events = cs_receive(core_.get(), bytes.begin(), bytes.size(), GrpcClient::nowUs());
      if (events != 0) announce(events);
    }
    read();
  }

  void announce(std::uint32_t events) {
    onEvents_(core_.get(), events);
    if (cs_get_state(core_.get()) == CS_STATE_JOINED) disconnectedAt_.reset();
    if ((events & CS_EVENT_DESCRIPTION) != 0) wasJoined_ = true;
    events_ |= events;
    hasNews_ = true;
    changed_.notify_all();
  }

  void update() {
    cs_update(core_.get(), GrpcClient::nowUs());
    const auto now = SteadyClock::now();
    const bool failed = cs_get_state(core_.get()) == CS_STATE_FAILED;
    if (call_->underway == 0) return;
    if (leaving_ || failed) return leave(now);
    const bool tooLong = now - lastHeard_ > options_.silenceTimeout && call_->started;
    const bool givenUp =
        wasJoined_ && options_.reconnectFor.count() > 0 && GrpcClient::nowUs() >= cs_connect_at(core_.get());
    call_->swallowed = reconnects_ && !call_->started && now - call_->begun > openingTimeout();
    if (tooLong || givenUp || call_->swallowed) {
      call_->silent = true;
      call_->context.TryCancel();
    }
    write();
  }

  // Longest time to open a connection while reconnecting, since a link that was just restored may have lost
  // the first packets. Grows with each attempt, since opening may take longer than before.
  SteadyClock::duration openingTimeout() const {
    const auto first = std::clamp<SteadyClock::duration>(3 * openingTook_, kShortestOpening, kLongestOpening);
    return first + first * attempts_ / 64;
  }

  void write() {
    if (!call_->started || call_->writing || call_->broken || call_->finishing) return;
    std::size_t bytes = 0;
    const std::uint8_t* message = cs_next_outgoing(core_.get(), &bytes);
    if (!message) return;
    const grpc::Slice slice(message, bytes);
    call_->writing = true;
    ++call_->underway;
    call_->stream->Write(grpc::ByteBuffer(&slice, 1), tagOf(kWritten));
  }

  // Closes the sending half. The server then has kClosingTime to end the stream.
  void leave(SteadyClock::time_point now) {
    if (!cancelAt_) cancelAt_ = now + kClosingTime;
    if (!call_->started || now >= *cancelAt_) return call_->context.TryCancel();
    if (call_->halfClosed || call_->writing || call_->broken || call_->finishing) return;
    call_->halfClosed = true;
    ++call_->underway;
    call_->stream->WritesDone(tagOf(kHalfClosed));
  }

  void finish() {
    call_->finishing = true;
    ++call_->underway;
    call_->stream->Finish(&call_->status, tagOf(kFinished));
  }

  Failure reason() const {
    if (cs_get_state(core_.get()) == CS_STATE_FAILED) {
      const std::uint32_t code = cs_error_code(core_.get());
      const bool saidByServer = code != 0;
      const char* text = cs_error_text(core_.get());
      return {Failure::Kind::refused,
              saidByServer ? fmt::format("The server at {} refuses: {}", address_.address, text) : text,
              code == CS_ERROR_UNAUTHENTICATED};
    }
    if (leaving_) return {Failure::Kind::lost, "The client left the stream."};
    if (call_->silent && !call_->status.ok() && !reconnects_)
      return {Failure::Kind::lost,
              fmt::format("The server at {} has sent nothing for {} s: the stream is lost.", address_.address,
                          seconds(options_.silenceTimeout))};
    if (!wasJoined_) return notJoined(address_, call_->status);
    Failure failure = lost(address_, call_->status);
    if (reconnects_)
      failure.text +=
          fmt::format(" The client could not reconnect within {} s.", seconds(options_.reconnectFor));
    return failure;
  }

  void end() {
    ended_ = reason();
    changed_.notify_all();
    alarm_.Cancel();
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }

  const ServerAddress address_;
  const GrpcClientOptions options_;
  const OnEvents onEvents_;
  grpc::CompletionQueue queue_;
  // Set while the thread waits for the mutex. Then lock() lets the thread go first.
  std::atomic<bool> threadWaits_{false};
  std::condition_variable turn_;
  // Guards everything below. The thread releases it only while it waits for the queue.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  grpc::Alarm alarm_;
  bool wakeUnderway_ = false;
  bool hasNews_ = false;      // since the last wait()
  std::uint32_t events_ = 0;  // since the last wait()
  std::optional<Failure> ended_;
  std::unique_ptr<cs_client, decltype(&cs_destroy)> core_;
  std::optional<Call> call_;
  bool leaving_ = false, wasJoined_ = false, reconnects_ = false;
  SteadyClock::duration openingTook_ = kLongestOpening;    // of the last connection
  int attempts_ = 0;                                       // since the last connection
  std::optional<SteadyClock::time_point> disconnectedAt_;  // set while it is disconnected or reconnects
  std::optional<SteadyClock::time_point> cancelAt_;
  SteadyClock::time_point lastHeard_;
  std::thread thread_;
};

GrpcClient::GrpcClient(std::unique_ptr<Stream> stream) : stream_(std::move(stream)) {}

GrpcClient::~GrpcClient() = default;

tl::expected<std::unique_ptr<GrpcClient>, Failure> GrpcClient::join(const ServerAddress& address,
                                                                    const GrpcClientOptions& options,
                                                                    OnEvents onEvents) {
  auto stream = std::make_unique<Stream>(address, options, std::move(onEvents));
  if (std::optional<Failure> failure = stream->waitUntilJoined()) return tl::unexpected(std::move(*failure));
  return std::unique_ptr<GrpcClient>(new GrpcClient(std::move(stream)));
}

cs_client* GrpcClient::lock() {
  stream_->lock();
  return stream_->core();
}

void GrpcClient::unlock() {
  stream_->unlock();
}

void GrpcClient::visit(const std::function<void(cs_client*)>& task) {
  const std::lock_guard lock(*stream_);
  task(stream_->core());
}

std::uint32_t GrpcClient::wait(std::chrono::milliseconds timeout) {
  return stream_->wait(timeout);
}

std::optional<Failure> GrpcClient::ended() const {
  return stream_->ended();
}

std::uint64_t GrpcClient::nowUs() {
  const auto now = SteadyClock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(now).count());
}

}  // namespace clothstream

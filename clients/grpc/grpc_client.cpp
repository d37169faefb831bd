// SPDX-License-Identifier: MIT
// A transport over gRPC: one call at a time on one completion queue.
#include "clients/grpc/grpc_client.h"

#include <atomic>
#include <optional>
#include <utility>

#include <grpcpp/alarm.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include "clients/grpc/channel.h"

namespace clothstream {
namespace {

using SystemClock = std::chrono::system_clock;

constexpr const char* kJoinMethod = "/clothstream.v1.ClothStream/Join";

// Kind of a completion.
enum Operation : std::intptr_t { kStarted = 1, kRead, kWritten, kHalfClosed, kFinished, kWoken };

void* tagOf(Operation operation) {
  // gRPC only returns the tag. NOLINTNEXTLINE(performance-no-int-to-ptr)
  return reinterpret_cast<void*>(operation);
}

class GrpcTransport final : public Transport {
 public:
  explicit GrpcTransport(ServerAddress address)
      : address_(std::move(address)), credentials_(credentialsOf(address_)), current_(address_) {}
  ~GrpcTransport() override {
    if (call_) call_->context.TryCancel();
    alarm_.Cancel();
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }

  void connect(const std::string& server) override {
    current_ = address_.at(server);
    call_.emplace(prepared_ && prepared_->server == server ? std::move(prepared_->channel)
                                                           : makeChannel(current_, credentials_));
    prepared_.reset();
    call_->stream = call_->stub.PrepareCall(&call_->context, kJoinMethod, &queue_);
    ++call_->underway;
    call_->stream->StartCall(tagOf(kStarted));
  }
  void prepare(const std::string& server) override {
    prepared_ = {server, makeChannel(address_.at(server), credentials_)};
    prepared_->channel->GetState(true);  // begins to connect
  }
  bool active() const override { return call_ && (call_->underway > 0 || call_->received); }
  bool hasOpened() const override { return call_ && call_->started; }
  bool canWrite() const override {
    return call_ && call_->started && !call_->writing && !call_->broken && !call_->halfClosed &&
           !call_->finishing;
  }

  void write(std::span<const std::byte> message) override {
    const grpc::Slice slice(message.data(), message.size());
    call_->writing = true;
    ++call_->underway;
    call_->stream->Write(grpc::ByteBuffer(&slice, 1), tagOf(kWritten));
  }
  // Closes the sending half.
  void leave() override {
    if (!canWrite()) return;
    call_->halfClosed = true;
    ++call_->underway;
    call_->stream->WritesDone(tagOf(kHalfClosed));
  }
  void cancel() override { call_->context.TryCancel(); }

  std::string serverAddress() const override {
    return call_ && call_->started ? addressIn(call_->context.peer()) : std::string();
  }

  void wait(std::chrono::steady_clock::duration atMost) override {
    void* tag = nullptr;
    bool ok = false;
    const auto until = SystemClock::now() + std::chrono::duration_cast<SystemClock::duration>(atMost);
    if (queue_.AsyncNext(&tag, &ok, until) == grpc::CompletionQueue::GOT_EVENT)
      completed(static_cast<Operation>(reinterpret_cast<std::intptr_t>(tag)), ok);
  }

  std::optional<std::span<const std::byte>> receive() override {
    if (!call_ || !std::exchange(call_->received, false)) return std::nullopt;
    const bool whole = call_->incoming.DumpToSingleSlice(&message_).ok();
    read();
    if (!whole) return std::nullopt;
    return std::as_bytes(std::span(message_.begin(), message_.size()));
  }

  // At most one alarm is pending.
  void wake() override {
    if (!wakeUnderway_.exchange(true)) alarm_.Set(&queue_, SystemClock::now(), tagOf(kWoken));
  }

  bool endedByServer() const override { return call_->status.ok(); }
  Failure notJoined() const override { return clothstream::notJoined(current_, call_->status); }
  Failure lost() const override { return clothstream::lost(current_, call_->status); }

 private:
  // State of one connection.
  struct Call {
    explicit Call(std::shared_ptr<grpc::Channel> channel) : stub(std::move(channel)) {}

    grpc::GenericStub stub;
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream;
    grpc::ByteBuffer incoming;
    grpc::Status status;
    int underway = 0;  // operations
    bool started = false, received = false, writing = false, broken = false, halfClosed = false,
         finishing = false;
  };

  struct Prepared {
    std::string server;
    std::shared_ptr<grpc::Channel> channel;
  };

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
        return read();
      case kRead:
        if (!ok) return finish();
        call_->received = true;
        return;
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
  void finish() {
    call_->finishing = true;
    ++call_->underway;
    call_->stream->Finish(&call_->status, tagOf(kFinished));
  }

  const ServerAddress address_;
  // Read once: files may be gone when the stream connects again.
  const std::shared_ptr<grpc::ChannelCredentials> credentials_;
  ServerAddress current_;  // of the newest connection
  grpc::CompletionQueue queue_;
  grpc::Alarm alarm_;
  std::atomic<bool> wakeUnderway_{false};
  std::optional<Call> call_;
  std::optional<Prepared> prepared_;
  grpc::Slice message_;
};

}  // namespace

std::unique_ptr<Transport> makeGrpcTransport(const ServerAddress& address) {
  return std::make_unique<GrpcTransport>(address);
}

tl::expected<std::unique_ptr<NativeClient>, Failure> joinByGrpc(const ServerAddress& address,
                                                                const NativeClientOptions& options,
                                                                NativeClient::OnEvents onEvents) {
  return NativeClient::join(address, makeGrpcTransport(address), options, std::move(onEvents));
}

}  // namespace clothstream

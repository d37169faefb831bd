// SPDX-License-Identifier: MIT
// Links over gRPC streams; gRPC's own threads call the listeners.
#include <condition_variable>
#include <deque>
#include <mutex>

#include <absl/synchronization/mutex.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>

#include "clients/grpc/channel.h"
#include "clients/load/link.h"

namespace clothstream::load {
namespace {

constexpr const char* kJoinMethod = "/clothstream.v1.ClothStream/Join";

// gRPC allows operations from other threads only while a hold exists. The hold lasts until the first failed
// read, which marks the end of the stream.
class GrpcLink final : public Link, private grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  GrpcLink(const ServerAddress& address, LinkListener& listener)
      : listener_(listener), stub_(makeChannel(address)) {
    stub_.PrepareBidiStreamingCall(&context_, kJoinMethod, grpc::StubOptions(), this);
    AddHold();
    StartCall();
  }

  void read() override {
    const std::lock_guard lock(mutex_);
    if (reading_ || !held_) return;
    reading_ = true;
    StartRead(&incoming_);
  }

  void send(std::string message) override {
    const std::lock_guard lock(mutex_);
    if (!held_ || leaving_) return;
    waiting_.push_back(std::move(message));
    writeLocked();
  }

  void leave() override {
    {
      const std::lock_guard lock(mutex_);
      leaving_ = true;
      waiting_.clear();
      writeLocked();
    }
    read();
  }

  void drop() override {
    context_.TryCancel();
    {
      const std::lock_guard lock(mutex_);
      dropped_ = true;
    }
    read();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return done_; });
  }

 private:
  void writeLocked() {
    if (writing_ || !held_ || halfClosed_) return;
    if (waiting_.empty()) {
      if (!leaving_) return;
      halfClosed_ = true;
      StartWritesDone();
      return;
    }
    const grpc::Slice slice(waiting_.front());
    waiting_.pop_front();
    outgoing_ = grpc::ByteBuffer(&slice, 1);
    writing_ = true;
    StartWrite(&outgoing_);
  }

  void OnReadDone(bool ok) override {
    if (!ok) return release();
    bool dropped = false;
    {
      const std::lock_guard lock(mutex_);
      reading_ = false;
      dropped = dropped_;
    }
    // After drop() the link reads on until the read that ends the stream.
    if (dropped) return read();
    grpc::Slice bytes;
    if (incoming_.DumpToSingleSlice(&bytes).ok())
      listener_.received(std::as_bytes(std::span(bytes.begin(), bytes.size())));
  }
  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (ok) writeLocked();
  }
  void OnDone(const grpc::Status& status) override {
    listener_.closed(status.error_message());
    const std::lock_guard lock(mutex_);
    done_ = true;
    changed_.notify_all();
  }
  void release() {
    {
      const std::lock_guard lock(mutex_);
      held_ = false;
    }
    RemoveHold();
  }

  LinkListener& listener_;
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer incoming_, outgoing_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> waiting_;
  bool held_ = true, reading_ = false, writing_ = false, leaving_ = false, halfClosed_ = false;
  bool dropped_ = false, done_ = false;
};

class GrpcLinks final : public Links {
 public:
  explicit GrpcLinks(ServerAddress address) : address_(std::move(address)) {
    // Same setting as in server/endpoint/grpc/grpc_endpoint.cpp.
    absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  }
  std::unique_ptr<Link> open(LinkListener& listener) override {
    return std::make_unique<GrpcLink>(address_, listener);
  }

 private:
  const ServerAddress address_;
};

}  // namespace

std::unique_ptr<Links> makeGrpcLinks(const ServerAddress& address) {
  return std::make_unique<GrpcLinks>(address);
}

}  // namespace clothstream::load

// SPDX-License-Identifier: MIT
#include "server/rpc/join_stream.h"

#include <chrono>
#include <span>
#include <utility>

#include "server/rpc/status.h"

namespace clothstream::rpc {
namespace {

// A view of the message that keeps it alive for as long as gRPC holds the slice.
grpc::ByteBuffer sharedBuffer(const stream::SharedBytes& message) {
  // gRPC takes bytes as mutable, and never writes to them.
  void* const bytes = const_cast<std::byte*>(message->data());
  const grpc::Slice slice(
      bytes, message->size(), [](void* owner) { delete static_cast<stream::SharedBytes*>(owner); },
      new stream::SharedBytes(message));
  return grpc::ByteBuffer(&slice, 1);
}

// A peer that does not read keeps a write in flight for ever.
constexpr std::chrono::seconds kLastWriteTimeout{1};

grpc::Status cancelled() {
  return {grpc::StatusCode::CANCELLED, "the client went away"};
}

}  // namespace

JoinStream::JoinStream(grpc::CallbackServerContext& context, std::function<void(JoinStream&)> onDone)
    : onDone_(std::move(onDone)), context_(&context) {}

void JoinStream::open(stream::SceneServer& server, std::function<void()> wake) {
  const std::lock_guard lock(mutex_);
  connection_ = std::make_shared<stream::Connection>(server, "grpc " + context_->peer(), std::move(wake));
  StartRead(&incoming_);
  pumpLocked();
}

void JoinStream::pump() {
  const std::lock_guard lock(mutex_);
  pumpLocked();
}

void JoinStream::pumpLocked() {
  if (!connection_) return;
  const bool finished = connection_->finished();  // asked first: what came before it is still to be written
  if (writing_) {
    if (finished) cancelSoonLocked();
  } else if (std::optional<stream::SharedBytes> message = connection_->next()) {
    lastMessage_ = std::move(*message);
    outgoing_ = sharedBuffer(lastMessage_);
    writing_ = true;
    StartWrite(&outgoing_);
  } else if (finished) {
    finishLocked(closingStatus(lastMessage_));
  }
}

void JoinStream::finish(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  // Of one that is finished the last message may still be to be written, and says more.
  if (connection_ && connection_->finished())
    pumpLocked();
  else
    finishLocked(status);
}

void JoinStream::finishLocked(const grpc::Status& status) {
  if (!connection_) return;
  connection_.reset();
  status_ = status;
  if (writing_) {
    cancelSoonLocked();
  } else {
    Finish(status_);
  }
}

void JoinStream::cancelSoonLocked() {
  if (cancellation_) return;
  cancellation_.emplace();
  cancellation_->Set(std::chrono::system_clock::now() + kLastWriteTimeout,
                     [weak = weak_from_this()](bool expired) {
                       const auto self = weak.lock();
                       if (!expired || !self) return;
                       const std::lock_guard lock(self->mutex_);
                       if (self->writing_) self->context_->TryCancel();
                     });
}

void JoinStream::OnReadDone(bool ok) {
  if (!ok) {
    const std::lock_guard lock(mutex_);
    parting_ = connection_;
    return finishLocked(grpc::Status::OK);
  }
  std::shared_ptr<stream::Connection> connection;
  {
    const std::lock_guard lock(mutex_);
    connection = connection_;
  }
  if (!connection) return;
  grpc::Slice bytes;
  if (!incoming_.DumpToSingleSlice(&bytes).ok())
    return finish({grpc::StatusCode::INTERNAL, "the message could not be read"});
  connection->receive(std::as_bytes(std::span(bytes.begin(), bytes.size())));
  const std::lock_guard lock(mutex_);
  if (connection_) StartRead(&incoming_);
}

void JoinStream::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (!connection_) {
    Finish(status_);
  } else if (!ok) {
    finishLocked(cancelled());
  } else {
    pumpLocked();
  }
}

void JoinStream::OnCancel() {
  const std::lock_guard lock(mutex_);
  cutOff_ = true;
  finishLocked(cancelled());
}

void JoinStream::OnDone() {
  {
    const std::lock_guard lock(mutex_);
    if (parting_ && !cutOff_) parting_->leave();
  }
  onDone_(*this);
}

}  // namespace clothstream::rpc

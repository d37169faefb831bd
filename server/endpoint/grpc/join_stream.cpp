// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/join_stream.h"

#include <chrono>
#include <functional>
#include <memory>
#include <span>
#include <utility>

#include "server/endpoint/grpc/caller.h"
#include "server/endpoint/grpc/status.h"
#include "server/session/wake.h"

namespace clothstream::endpoint {
namespace {

// View of the message. Keeps the message alive while gRPC holds the slice.
grpc::ByteBuffer sharedBuffer(const delivery::SharedBytes& message) {
  // gRPC takes mutable bytes but never writes to them.
  void* const bytes = const_cast<std::byte*>(message->data());
  const grpc::Slice slice(
      bytes, message->size(), [](void* owner) { delete static_cast<delivery::SharedBytes*>(owner); },
      new delivery::SharedBytes(message));
  return grpc::ByteBuffer(&slice, 1);
}

// Bounds the last write, since a client that does not read never completes it.
constexpr std::chrono::seconds kLastWriteTimeout{1};

grpc::Status cancelled() {
  return {grpc::StatusCode::CANCELLED, "the client disconnected"};
}

}  // namespace

void JoinStream::await() {
  context_.AsyncNotifyWhenDone(&ended_);
  service_.RequestJoin(&context_, &io_, &endpoint_.loop->queue(), &endpoint_.loop->queue(), begin(begun_));
}

void JoinStream::onBegun(bool ok) {
  if (!ok) return over();
  made();
  begin(ended_);
  endpoint::await<JoinStream>(endpoint_, service_);
  if (!endpoint_.refusal.ok()) return finish(endpoint_.refusal);
  auto ticket = admit(endpoint_.streams);
  if (!ticket) return finish(ticket.error());
  ticket_.emplace(std::move(*ticket));
  auto wake = session::wakeOf(
      std::weak_ptr(std::static_pointer_cast<JoinStream>(shared_from_this())),
      [&loop = *endpoint_.loop](std::function<void()> task) { loop.post(std::move(task)); },
      [](JoinStream& self) { self.attempt([&] { self.pump(); }); });
  session_ = session::Session::open(endpoint_.server,
                                    {.peer = "grpc " + context_.peer(),
                                     .address = addressKeyOf(context_.peer()),
                                     .token = tokenIn(context_),
                                     .reached = reachedBy(context_.peer())},
                                    std::move(wake));
  read();
  pump();
}

void JoinStream::read() {
  io_.Read(&incoming_, begin(read_));
}

void JoinStream::onRead(bool ok) {
  if (!session_) return;
  if (!ok) {
    departing_ = std::move(session_);
    return finish(grpc::Status::OK);
  }
  grpc::Slice bytes;
  if (!incoming_.DumpToSingleSlice(&bytes).ok())
    return finish({grpc::StatusCode::INTERNAL, "cannot read the message"});
  session_->receive(std::as_bytes(std::span(bytes.begin(), bytes.size())));
  const schedule::Clock::duration pause = session_->readPause();
  if (pause <= schedule::Clock::duration::zero()) return read();
  pause_.emplace();
  pause_->Set(&endpoint_.loop->queue(),
              std::chrono::system_clock::now() +
                  std::chrono::duration_cast<std::chrono::system_clock::duration>(pause),
              begin(paused_));
}

void JoinStream::onPaused(bool) {
  if (session_) read();
}

void JoinStream::pump() {
  if (!session_) return;
  const bool finished = session_->finished();  // checked before next(), so that no message is lost
  if (isWriting_) {
    if (finished) cancelSoon();
  } else if (std::optional<delivery::SharedBytes> message = session_->next()) {
    lastMessage_ = std::move(*message);
    isWriting_ = true;
    endpoint_.metrics.grpcBytes.add(lastMessage_->size());
    io_.Write(sharedBuffer(lastMessage_), begin(written_));
  } else if (finished) {
    finish(statusOf(session::closingOf(lastMessage_)));
  }
}

void JoinStream::onWritten(bool ok) {
  isWriting_ = false;
  if (hasEnded_) return;
  if (closing_)
    io_.Finish(*closing_, begin(finished_));
  else if (ok)
    pump();
  else
    finish(cancelled());
}

void JoinStream::finish(const grpc::Status& status) {
  if (closing_) return;
  closing_ = status;
  session_.reset();
  if (hasEnded_) return;
  if (isWriting_)
    cancelSoon();
  else
    io_.Finish(status, begin(finished_));
}

void JoinStream::cancelSoon() {
  if (cancellation_) return;
  cancellation_.emplace();
  cancellation_->Set(&endpoint_.loop->queue(), std::chrono::system_clock::now() + kLastWriteTimeout,
                     begin(lateForEnd_));
}

void JoinStream::onLateForEnd(bool expired) {
  if (expired && isWriting_) context_.TryCancel();
}

void JoinStream::onEnded(bool) {
  hasEnded_ = true;
  ticket_.reset();
  if (cancellation_) cancellation_->Cancel();
  if (pause_) pause_->Cancel();
  if (departing_ && !context_.IsCancelled()) departing_->leave();
  departing_.reset();
  finish(cancelled());
  over();
}

void JoinStream::close(const grpc::Status& status) {
  // The last message of a finished session may still wait, and it gives a more specific status.
  if (session_ && session_->finished())
    pump();
  else
    finish(status);
}

}  // namespace clothstream::endpoint

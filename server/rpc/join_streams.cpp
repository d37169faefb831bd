// SPDX-License-Identifier: MIT
#include "server/rpc/join_streams.h"

#include <utility>

namespace clothstream::rpc {
namespace {

// Answers a call that is not taken with its status.
class Refusal final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit Refusal(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

}  // namespace

JoinStreams::JoinStreams(stream::SceneServer& server, std::size_t maxStreams)
    : server_(server), maxStreams_(maxStreams), pump_([this] { pumpWoken(); }) {}

JoinStreams::~JoinStreams() {
  {
    const std::lock_guard lock(wokenMutex_);
    stopping_ = true;
  }
  wokenOrStopping_.notify_one();
  pump_.join();
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* JoinStreams::open(
    grpc::CallbackServerContext& context) {
  auto stream = std::make_shared<JoinStream>(context, [this](JoinStream& done) {
    const std::lock_guard lock(streamsMutex_);
    streams_.erase(&done);
  });
  {
    const std::lock_guard lock(streamsMutex_);
    if (!refusal_.ok()) return new Refusal(refusal_);
    if (streams_.size() >= maxStreams_)
      return new Refusal(
          {grpc::StatusCode::RESOURCE_EXHAUSTED, "the server has all the streams it takes; try again later"});
    streams_.emplace(stream.get(), stream);
  }
  // A wake must not own the stream: whoever drops the last owner inside a wake would wait in the connection's
  // destructor for that wake to return.
  stream->open(server_, [this, weak = std::weak_ptr(stream)] { wake(weak); });
  return stream.get();
}

void JoinStreams::finishAll(const grpc::Status& status) {
  std::vector<std::shared_ptr<JoinStream>> open;
  {
    const std::lock_guard lock(streamsMutex_);
    refusal_ = status;
    for (const auto& [key, stream] : streams_) open.push_back(stream);
  }
  for (const auto& stream : open) stream->finish(status);
}

void JoinStreams::wake(const std::weak_ptr<JoinStream>& stream) {
  {
    const std::lock_guard lock(wokenMutex_);
    woken_.push_back(stream);
  }
  wokenOrStopping_.notify_one();
}

void JoinStreams::pumpWoken() {
  std::vector<std::weak_ptr<JoinStream>> woken;
  std::unique_lock lock(wokenMutex_);
  while (!stopping_) {
    wokenOrStopping_.wait(lock, [this] { return stopping_ || !woken_.empty(); });
    std::swap(woken, woken_);
    lock.unlock();
    for (const std::weak_ptr<JoinStream>& weak : woken)
      if (const auto stream = weak.lock()) stream->pump();
    woken.clear();
    lock.lock();
  }
}

}  // namespace clothstream::rpc

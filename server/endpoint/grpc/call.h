// SPDX-License-Identifier: MIT
// A call that a client makes, and what the calls of one endpoint share.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <unordered_set>
#include <utility>

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include "server/endpoint/grpc/completion_loop.h"

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::endpoint {

class Call;

// The loop's thread alone touches it, but for the loop.
struct EndpointContext {
  hosting::SceneServer& server;
  const std::shared_ptr<CompletionLoop> loop;
  const std::size_t maxStreams;
  std::size_t streams = 0;  // joined, but for those that were refused
  std::size_t watches = 0;  // of health
  std::unordered_set<std::shared_ptr<Call>> calls = {};
  std::size_t callsMade = 0;               // of them, those that a client made
  grpc::Status refusal = {};               // of new calls, unless it is OK
  std::function<void()> onForgotten = {};  // when there is one call fewer, if set

  void forget(const std::shared_ptr<Call>& call) {
    calls.erase(call);
    if (onForgotten) onForgotten();
  }
};

// There is from before a client makes it, so that gRPC has where to put it, until all its operations are
// done. The loop's thread alone uses it.
class Call : public std::enable_shared_from_this<Call> {
 public:
  virtual ~Call() = default;
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  // The endpoint closes: one that was made ends with this, unless it says more itself.
  void stop(const grpc::Status& status) {
    if (isMade_) close(status);
  }

 protected:
  explicit Call(EndpointContext& endpoint) : endpoint_(endpoint) {}

  // An operation of a call, and what the call does next.
  template <typename Derived>
  class Step final : public Operation {
   public:
    Step(Derived& call, void (Derived::*next)(bool ok)) : call_(call), next_(next) {}
    void done(bool ok) override {
      const std::shared_ptr<Call> self = call_.shared_from_this();
      --self->underway_;
      (call_.*next_)(ok);
      if (self->isOver_ && self->underway_ == 0) self->leave();
    }

   private:
    Derived& call_;
    void (Derived::*const next_)(bool ok);
  };

  virtual void close(const grpc::Status& status) = 0;

  // The tag of an operation that is being begun: `operation` is a member, and lives until it is done.
  void* begin(Operation& operation) {
    ++underway_;
    return &operation;
  }
  // A client has made it.
  void made() {
    isMade_ = true;
    ++endpoint_.callsMade;
  }
  // Nothing will be begun any more.
  void over() { isOver_ = true; }

  EndpointContext& endpoint_;
  grpc::ServerContext context_;

 private:
  void leave() {
    if (isMade_) --endpoint_.callsMade;
    endpoint_.forget(shared_from_this());
  }

  std::size_t underway_ = 0;
  bool isMade_ = false, isOver_ = false;
};

// Waits for the next call of a kind.
template <typename Kind, typename... Arguments>
void await(EndpointContext& endpoint, Arguments&&... arguments) {
  const auto call = std::make_shared<Kind>(endpoint, std::forward<Arguments>(arguments)...);
  endpoint.calls.insert(call);
  call->await();
}

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
// Base class of a gRPC call, and the state that all calls of one endpoint share.
#pragma once

#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <unordered_set>
#include <utility>

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>
#include <spdlog/spdlog.h>
#include <tl/expected.hpp>

#include "server/endpoint/grpc/answer_budget.h"
#include "server/endpoint/grpc/call_rate.h"
#include "server/endpoint/grpc/caller.h"
#include "server/endpoint/grpc/completion_loop.h"
#include "server/endpoint/grpc/status.h"
#include "server/endpoint/listen/admission.h"
#include "server/schedule/clock.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::endpoint {

class Call;

// Belongs to the loop's thread; only the loop itself may be used by others.
struct GrpcEndpointContext {
  hosting::SceneServer& server;
  telemetry::ServerMetrics& metrics;
  const std::shared_ptr<CompletionLoop> loop;
  // One connection may carry many streams, so they are admitted like connections. `watches` are those of
  // health and reflection.
  Admission streams, watches;
  AnswerBudget answers;
  // A call whose answer has not been read by then is cancelled.
  const std::chrono::milliseconds answerTimeout;
  CallRate callRate = {};
  std::unordered_set<std::shared_ptr<Call>> calls = {};
  std::size_t callsMade = 0;               // number of these that a client has made
  grpc::Status refusal = {};               // status for new calls; OK accepts them
  std::function<void()> onForgotten = {};  // runs after each removed call; may be empty

  void forget(const std::shared_ptr<Call>& call) {
    calls.erase(call);
    if (onForgotten) onForgotten();
  }
};

// Created before a client makes the call, so that gRPC can store it. Lives until all its operations are done.
// Belongs to the loop's thread.
class Call : public std::enable_shared_from_this<Call> {
 public:
  virtual ~Call() = default;
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  // Called when the endpoint closes. Ends the call with this status, unless it has a more specific one. Does
  // nothing before a client has made the call.
  void stop(const grpc::Status& status) {
    if (isMade_) close(status);
  }

 protected:
  explicit Call(GrpcEndpointContext& endpoint) : endpoint_(endpoint) {}

  // An operation of a call, and the member function that continues the call.
  template <typename Derived>
  class Step final : public Operation {
   public:
    Step(Derived& call, void (Derived::*next)(bool ok)) : call_(call), next_(next) {}
    void done(bool ok) override {
      const std::shared_ptr<Call> self = call_.shared_from_this();
      --self->underway_;
      self->attempt([&] { (call_.*next_)(ok); });
      if (self->isOver_ && self->underway_ == 0) self->leave();
    }

   private:
    Derived& call_;
    void (Derived::*const next_)(bool ok);
  };

  virtual void close(const grpc::Status& status) = 0;

  // Cancels the call if `work` throws: it would wait for an operation that has not begun.
  template <typename Work>
  void attempt(const Work& work) {
    try {
      work();
    } catch (const std::exception& failure) {
      spdlog::error("gRPC: a call is cancelled: {}", failure.what());
      if (isMade_) context_.TryCancel();
    }
  }

  // Counts an operation that begins and returns its tag. `operation` must be a member of the call.
  void* begin(Operation& operation) {
    ++underway_;
    return &operation;
  }
  // Call it when a client has made the call.
  void made() {
    isMade_ = true;
    ++endpoint_.callsMade;
  }
  // Admits a stream. The error is the status that refuses it.
  tl::expected<Admission::Ticket, grpc::Status> admit(Admission& admission) {
    return admission.admit(addressOf(context_.peer()), schedule::Clock::now())
        .map_error([&](telemetry::Refusal reason) {
          endpoint_.metrics.refuse(reason);
          return statusOf(reason);
        });
  }
  // Call it when no operation will begin any more.
  void over() { isOver_ = true; }

  GrpcEndpointContext& endpoint_;
  grpc::ServerContext context_;

 private:
  void leave() {
    if (isMade_) --endpoint_.callsMade;
    endpoint_.forget(shared_from_this());
  }

  std::size_t underway_ = 0;
  bool isMade_ = false, isOver_ = false;
};

// Waits for the next call of this kind.
template <typename Kind, typename... Arguments>
void await(GrpcEndpointContext& endpoint, Arguments&&... arguments) {
  const auto call = std::make_shared<Kind>(endpoint, arguments...);
  endpoint.calls.insert(call);
  call->await();
}

}  // namespace clothstream::endpoint

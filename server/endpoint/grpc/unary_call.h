// SPDX-License-Identifier: MIT
// A call with one request and one response.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <grpcpp/alarm.h>
#include <grpcpp/support/async_unary_call.h>
#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/endpoint/grpc/call.h"
#include "server/endpoint/grpc/caller.h"
#include "server/endpoint/grpc/status.h"
#include "server/hosting/answers.h"
#include "server/hosting/scene_server.h"

namespace clothstream::endpoint {

template <typename Request, typename Response>
class UnaryCall final : public Call {
 public:
  using Writer = grpc::ServerAsyncResponseWriter<Response>;
  // gRPC function that requests the next call of this method.
  using Take = std::function<void(grpc::ServerContext*, Request*, Writer*, grpc::CompletionQueue*,
                                  grpc::ServerCompletionQueue*, void*)>;
  // Call it once, from any thread, at any time.
  class Answer {
   public:
    using Give = std::function<void(tl::expected<Response, v1::Error>)>;
    Answer(Give give, std::shared_ptr<const std::atomic<bool>> isWanted)
        : give_(std::move(give)), isWanted_(std::move(isWanted)) {}

    void operator()(tl::expected<Response, v1::Error> answer) const { give_(std::move(answer)); }
    // Returns a function that tells, from any thread, whether the client still waits for the answer.
    std::function<bool()> wanted() const {
      return [isWanted = isWanted_] { return isWanted->load(); };
    }

   private:
    Give give_;
    std::shared_ptr<const std::atomic<bool>> isWanted_;
  };
  // Called on the loop's thread.
  using Handler = std::function<void(const Request&, const grpc::ServerContext&, Answer)>;

  // `cost`: number of calls that one of these counts as (CallRate).
  UnaryCall(GrpcEndpointContext& endpoint, Take take, Handler handler, double cost)
      : Call(endpoint), take_(std::move(take)), handler_(std::move(handler)), cost_(cost) {}

  void await() {
    context_.AsyncNotifyWhenDone(&ended_);
    take_(&context_, &request_, &writer_, &endpoint_.loop->queue(), &endpoint_.loop->queue(), begin(begun_));
  }

 private:
  void onBegun(bool ok) {
    if (!ok) return over();
    begin(ended_);
    endpoint::await<UnaryCall>(endpoint_, take_, handler_, cost_);
    made();
    if (!endpoint_.refusal.ok()) return finish(endpoint_.refusal);
    if (!endpoint_.callRate.take(context_.peer(), schedule::Clock::now(), cost_)) {
      endpoint_.metrics.refuse(telemetry::Refusal::callRate);
      return finish({grpc::StatusCode::RESOURCE_EXHAUSTED, "too many calls: try again in a second"});
    }
    std::weak_ptr<UnaryCall> weak = std::static_pointer_cast<UnaryCall>(shared_from_this());
    handler_(request_, context_,
             Answer(
                 [weak = std::move(weak), loop = endpoint_.loop](tl::expected<Response, v1::Error> answer) {
                   loop->post([weak, answer = std::move(answer)]() mutable {
                     const auto self = weak.lock();
                     if (!self) return;
                     self->attempt([&] {
                       if (answer) self->response_ = std::move(*answer);
                       self->finish(answer ? grpc::Status::OK : statusOf(answer.error()));
                     });
                   });
                 },
                 isWanted_));
  }
  // The call is answered, or the client has cancelled it, or its deadline is over. A later answer is dropped.
  void onEnded(bool) {
    *isWanted_ = false;
    over();
  }
  void onFinished(bool) {
    endpoint_.answers.release(address_, bytes_);
    late_.Cancel();
  }
  void onLate(bool expired) {
    if (expired) context_.TryCancel();
  }
  void close(const grpc::Status& status) override { finish(status); }

  void finish(const grpc::Status& status) {
    if (std::exchange(isFinishing_, true)) return;
    if (status.ok())
      give();
    else
      writer_.FinishWithError(status, begin(finished_));
    late_.Set(&endpoint_.loop->queue(), std::chrono::system_clock::now() + endpoint_.answerTimeout,
              begin(expired_));
  }

  // Sends the response if the budget of answers has room for it.
  void give() {
    address_ = addressKeyOf(context_.peer());
    const std::size_t bytes = response_.ByteSizeLong();
    if (!endpoint_.answers.take(address_, bytes)) {
      endpoint_.metrics.refuse(telemetry::Refusal::unreadCalls);
      return writer_.FinishWithError({grpc::StatusCode::RESOURCE_EXHAUSTED,
                                      fmt::format("the answer of {} bytes has no room next to answers that "
                                                  "clients have not read yet: read them, or try again later",
                                                  bytes)},
                                     begin(finished_));
    }
    bytes_ = bytes;
    endpoint_.metrics.grpcBytes.add(bytes);
    writer_.Finish(response_, grpc::Status::OK, begin(finished_));
    response_ = {};  // gRPC has its own copy
  }

  const Take take_;
  const Handler handler_;
  const double cost_;
  Request request_;
  Response response_;
  Writer writer_{&context_};
  bool isFinishing_ = false;
  std::string address_;    // key of the peer's address, while its answer is sent
  std::size_t bytes_ = 0;  // of the answer that is sent
  grpc::Alarm late_;       // set while the answer is sent
  const std::shared_ptr<std::atomic<bool>> isWanted_ = std::make_shared<std::atomic<bool>>(true);
  Step<UnaryCall> begun_{*this, &UnaryCall::onBegun}, finished_{*this, &UnaryCall::onFinished},
      ended_{*this, &UnaryCall::onEnded}, expired_{*this, &UnaryCall::onLate};
};

// gRPC function that requests the next call of a method.
template <typename Method, typename Request, typename Response>
using TakeMethod = void (Method::*)(grpc::ServerContext*, Request*,
                                    grpc::ServerAsyncResponseWriter<Response>*, grpc::CompletionQueue*,
                                    grpc::ServerCompletionQueue*, void*);

// Answers calls of a method of `service` while the endpoint is open, also of peers without an identity.
// `take` is its Request... function, `cost` the number of calls that one counts as (CallRate).
template <typename Service, typename Method, typename Request, typename Response, typename Handler>
void offerToAll(GrpcEndpointContext& endpoint, Service& service, TakeMethod<Method, Request, Response> take,
                Handler handler, double cost = 1) {
  await<UnaryCall<Request, Response>>(endpoint, std::bind_front(take, &service), std::move(handler), cost);
}

// The same for peers that the server identifies by their token or address. Others get UNAUTHENTICATED. The
// handler is also given the peer's identity.
template <typename Service, typename Method, typename Request, typename Response, typename Handler>
void offer(GrpcEndpointContext& endpoint, Service& service, TakeMethod<Method, Request, Response> take,
           Handler handler, double cost = 1) {
  auto identified = [&authentication = endpoint.server.authentication, handler = std::move(handler)](
                        const Request& request, const grpc::ServerContext& context,
                        typename UnaryCall<Request, Response>::Answer answer) {
    const auto identity = authentication.identify(tokenIn(context), addressKeyOf(context.peer()).empty());
    if (!identity) return answer(tl::unexpected(hosting::toMessage(identity.error())));
    handler(request, *identity, std::move(answer));
  };
  offerToAll(endpoint, service, take, std::move(identified), cost);
}

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
// A call with one request and one response.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include <grpcpp/support/async_unary_call.h>
#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/endpoint/grpc/call.h"
#include "server/endpoint/grpc/status.h"

namespace clothstream::endpoint {

template <typename Request, typename Response>
class UnaryCall final : public Call {
 public:
  using Writer = grpc::ServerAsyncResponseWriter<Response>;
  // gRPC function that requests the next call of this method.
  using Take = std::function<void(grpc::ServerContext*, Request*, Writer*, grpc::CompletionQueue*,
                                  grpc::ServerCompletionQueue*, void*)>;
  // Call it once, from any thread, at any time.
  using Answer = std::function<void(tl::expected<Response, v1::Error>)>;
  using Handler = std::function<void(const Request&, Answer)>;

  // `cost`: number of calls that one of these counts as (CallRate).
  UnaryCall(GrpcEndpointContext& endpoint, Take take, Handler handler, double cost)
      : Call(endpoint), take_(std::move(take)), handler_(std::move(handler)), cost_(cost) {}

  void await() {
    take_(&context_, &request_, &writer_, &endpoint_.loop->queue(), &endpoint_.loop->queue(), begin(begun_));
  }

 private:
  void onBegun(bool ok) {
    if (!ok) return over();
    endpoint::await<UnaryCall>(endpoint_, take_, handler_, cost_);
    made();
    if (!endpoint_.refusal.ok()) return finish(endpoint_.refusal);
    if (!endpoint_.callRate.take(context_.peer(), schedule::Clock::now(), cost_)) {
      endpoint_.metrics.refuse(telemetry::Refusal::callRate);
      return finish({grpc::StatusCode::RESOURCE_EXHAUSTED, "too many calls: try again in a second"});
    }
    std::weak_ptr<UnaryCall> weak = std::static_pointer_cast<UnaryCall>(shared_from_this());
    handler_(request_,
             [weak = std::move(weak), loop = endpoint_.loop](tl::expected<Response, v1::Error> answer) {
               loop->post([weak, answer = std::move(answer)]() mutable {
                 const auto self = weak.lock();
                 if (!self) return;
                 if (answer) self->response_ = std::move(*answer);
                 self->finish(answer ? grpc::Status::OK : statusOf(answer.error()));
               });
             });
  }
  void onFinished(bool) { over(); }
  void close(const grpc::Status& status) override { finish(status); }

  void finish(const grpc::Status& status) {
    if (std::exchange(isFinishing_, true)) return;
    if (status.ok())
      writer_.Finish(response_, status, begin(finished_));
    else
      writer_.FinishWithError(status, begin(finished_));
  }

  const Take take_;
  const Handler handler_;
  const double cost_;
  Request request_;
  Response response_;
  Writer writer_{&context_};
  bool isFinishing_ = false;
  Step<UnaryCall> begun_{*this, &UnaryCall::onBegun}, finished_{*this, &UnaryCall::onFinished};
};

// Answers calls of a method of `service` while the endpoint is open. `take` is its Request... function,
// `cost` the number of calls that one counts as (CallRate).
template <typename Service, typename Method, typename Request, typename Response, typename Handler>
void offer(GrpcEndpointContext& endpoint, Service& service,
           void (Method::*take)(grpc::ServerContext*, Request*, grpc::ServerAsyncResponseWriter<Response>*,
                                grpc::CompletionQueue*, grpc::ServerCompletionQueue*, void*),
           Handler handler, double cost = 1) {
  await<UnaryCall<Request, Response>>(endpoint, std::bind_front(take, &service), std::move(handler), cost);
}

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/health.h"

#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <grpcpp/support/async_stream.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "server/endpoint/grpc/unary_call.h"

namespace clothstream::endpoint {
namespace {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

bool isOffered(const std::string& service) {
  return service.empty() || service == v1::ClothStream::service_full_name() ||
         service == grpc::health::v1::Health::service_full_name();
}

tl::expected<HealthCheckResponse, v1::Error> check(const HealthCheckRequest& request) {
  if (!isOffered(request.service())) {
    v1::Error error;
    error.set_code(v1::ERROR_CODE_NOT_FOUND);
    error.set_text(fmt::format("unknown service '{:.64}'; the service is {}", request.service(),
                               v1::ClothStream::service_full_name()));
    return tl::unexpected(error);
  }
  HealthCheckResponse response;
  response.set_status(HealthCheckResponse::SERVING);
  return response;
}

// A Watch call: reports SERVING at once and NOT_SERVING when the endpoint closes.
class HealthWatch final : public Call {
 public:
  HealthWatch(GrpcEndpointContext& endpoint, HealthService& service) : Call(endpoint), service_(service) {}

  void await() {
    context_.AsyncNotifyWhenDone(&ended_);
    service_.RequestWatch(&context_, &request_, &writer_, &endpoint_.loop->queue(), &endpoint_.loop->queue(),
                          begin(begun_));
  }

 private:
  void onBegun(bool ok) {
    if (!ok) return over();
    made();
    begin(ended_);
    endpoint::await<HealthWatch>(endpoint_, service_);
    if (!endpoint_.refusal.ok()) return finish(endpoint_.refusal);
    auto ticket = admit(endpoint_.watches);
    if (!ticket) return finish(ticket.error());
    ticket_.emplace(std::move(*ticket));
    write(HealthCheckResponse::SERVING);
  }
  void onWritten(bool) {
    isWriting_ = false;
    if (!closing_ || hasEnded_) return;
    if (std::exchange(isLast_, true))
      finish(*closing_);
    else
      write(HealthCheckResponse::NOT_SERVING);
  }
  void onFinished(bool) {}
  void onEnded(bool) {
    hasEnded_ = true;
    ticket_.reset();
    over();
  }

  // Reports NOT_SERVING before the end, after a write that is under way.
  void close(const grpc::Status& status) override {
    if (!ticket_ || hasEnded_) return;
    closing_ = status;
    if (!isWriting_) onWritten(true);
  }

  void write(HealthCheckResponse::ServingStatus status) {
    isWriting_ = true;
    writer_.Write(response(status), begin(written_));
  }
  void finish(const grpc::Status& status) { writer_.Finish(status, begin(finished_)); }

  HealthCheckResponse response(HealthCheckResponse::ServingStatus status) const {
    HealthCheckResponse response;
    response.set_status(isOffered(request_.service()) ? status : HealthCheckResponse::SERVICE_UNKNOWN);
    return response;
  }

  HealthService& service_;
  HealthCheckRequest request_;
  grpc::ServerAsyncWriter<HealthCheckResponse> writer_{&context_};
  std::optional<grpc::Status> closing_;      // set while the watch closes
  std::optional<Admission::Ticket> ticket_;  // none for a refused watch
  bool isWriting_ = false, isLast_ = false, hasEnded_ = false;
  Step<HealthWatch> begun_{*this, &HealthWatch::onBegun}, written_{*this, &HealthWatch::onWritten},
      finished_{*this, &HealthWatch::onFinished}, ended_{*this, &HealthWatch::onEnded};
};

}  // namespace

void offerHealth(GrpcEndpointContext& endpoint, HealthService& service) {
  offerToAll(endpoint, service, &HealthService::RequestCheck,
             [](const auto& request, const grpc::ServerContext&, auto answer) { answer(check(request)); });
  await<HealthWatch>(endpoint, service);
}

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
#include <optional>

#include <gtest/gtest.h>

#include "server/endpoint/grpc/grpc_endpoint.h"
#include "tests/endpoint/rpc_client.h"
#include "tests/endpoint/transport.h"

namespace clothstream::tests {
namespace {

class GrpcTransport final : public Transport {
 public:
  void open(hosting::SceneServer& server, const TransportOptions& options) override {
    close();
    endpoint::GrpcEndpointOptions endpointOptions;
    endpointOptions.host = options.host;
    endpointOptions.port = options.port;
    endpointOptions.maxStreams = options.maxConnections;
    endpoint_.emplace(server, endpointOptions);
  }
  void close() override { endpoint_.reset(); }
  std::uint16_t port() const override { return endpoint_->port(); }

  std::unique_ptr<Client> connect(bool smallBuffer) override {
    return std::make_unique<RpcStream>(port(), RpcOptions{.smallWindow = smallBuffer});
  }
  bool hasRoom() override {
    RpcStream stream(port());
    stream.leave();
    stream.receive();
    const StreamEnd end = stream.end();
    if (end.code == grpc::StatusCode::RESOURCE_EXHAUSTED) return false;
    EXPECT_EQ(end.code, grpc::StatusCode::OK) << end.text;
    return true;
  }
  std::chrono::seconds cutOffTime() const override { return std::chrono::seconds(20); }

  int codeOf(EndCause cause) const override {
    switch (cause) {
      case EndCause::left:
        return grpc::StatusCode::OK;
      case EndCause::unknownScene:
        return grpc::StatusCode::NOT_FOUND;
      case EndCause::outOfOrder:
        return grpc::StatusCode::FAILED_PRECONDITION;
      case EndCause::malformed:
        return grpc::StatusCode::INVALID_ARGUMENT;
      case EndCause::tooLarge:
        return grpc::StatusCode::RESOURCE_EXHAUSTED;
      case EndCause::serverStops:
        break;
    }
    return grpc::StatusCode::UNAVAILABLE;
  }
  const char* portOption() const override { return "--grpc-port"; }

 private:
  std::optional<endpoint::GrpcEndpoint> endpoint_;
};

}  // namespace

std::unique_ptr<Transport> makeGrpcTransport() {
  return std::make_unique<GrpcTransport>();
}

}  // namespace clothstream::tests

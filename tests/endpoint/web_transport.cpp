// SPDX-License-Identifier: MIT
#include <optional>

#include "server/endpoint/web/web_endpoint.h"
#include "tests/endpoint/transport.h"
#include "tests/endpoint/web_client.h"

namespace clothstream::tests {
namespace {

class WebTransport final : public Transport {
 public:
  void open(hosting::SceneServer& server, const TransportOptions& options) override {
    close();
    endpoint::WebEndpointOptions endpointOptions;
    endpointOptions.host = options.host;
    endpointOptions.port = options.port;
    endpointOptions.maxConnections = options.maxConnections;
    endpoint_.emplace(server, endpointOptions);
  }
  void close() override { endpoint_.reset(); }
  std::uint16_t port() const override { return endpoint_->port(); }

  std::unique_ptr<Client> connect(bool smallBuffer) override {
    WebSocketClient::Handshake handshake;
    handshake.receiveBufferBytes = smallBuffer ? 4096 : 0;
    return std::make_unique<WebSocketClient>(port(), handshake);
  }
  void keepAlive(Client& client) override { client.send(ping()); }
  bool hasRoom() override {
    return HttpClient(port()).get("/healthz").result() != http::status::service_unavailable;
  }
  // Two seconds after the fatal error, and before the client would count as vanished.
  std::chrono::seconds cutOffTime() const override { return std::chrono::seconds(4); }

  int codeOf(EndCause cause) const override {
    switch (cause) {
      case EndCause::left:
        return websocket::close_code::normal;
      case EndCause::tooLarge:
        return websocket::close_code::too_big;
      case EndCause::serverStops:
        return websocket::close_code::going_away;
      case EndCause::unknownScene:
      case EndCause::outOfOrder:
      case EndCause::malformed:
        break;
    }
    return websocket::close_code::policy_error;
  }
  // RFC 6455 5.5.1: a close frame holds 125 bytes, of which the code takes two.
  std::size_t maxEndText() const override { return 123; }
  const char* portOption() const override { return "--port"; }

 private:
  std::optional<endpoint::WebEndpoint> endpoint_;
};

}  // namespace

std::unique_ptr<Transport> makeWebTransport() {
  return std::make_unique<WebTransport>();
}

std::vector<TransportKind> transportKinds() {
  return {
#ifdef CLOTHSTREAM_GRPC_ENDPOINT
      {"Grpc", &makeGrpcTransport},
#endif
      {"WebSocket", &makeWebTransport},
  };
}

}  // namespace clothstream::tests

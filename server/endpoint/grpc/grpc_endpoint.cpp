// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/grpc_endpoint.h"

#include <chrono>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <absl/synchronization/mutex.h>
#include <boost/asio/thread_pool.hpp>
#include <grpc/compression.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include "server/endpoint/grpc/acceptor.h"
#include "server/endpoint/grpc/call.h"
#include "server/endpoint/grpc/credentials.h"
#include "server/endpoint/grpc/health.h"
#include "server/endpoint/grpc/reflection.h"
#include "server/endpoint/grpc/service.h"
#include "server/hosting/scene_server.h"
#include "server/session/session.h"

namespace clothstream::endpoint {
namespace {

using namespace std::chrono_literals;

constexpr auto kStopTimeout = 1s;
// Pings after 2 s without a byte and waits 2 s for the answer, so a vanished client is found within 5 s.
constexpr int kPingAfterMs = 2000;
constexpr int kPingTimeoutMs = 2000;
constexpr int kMinClientPingIntervalMs = 1000;
constexpr int kMaxIdleConnectionMs = 60'000;
constexpr int kHandshakeTimeoutMs = 10'000;
// Number of connections beyond the limit of streams. Streams on them are refused with the reason.
constexpr std::size_t kAnsweredBeyondLimit = 64;
constexpr std::size_t kMaxMemory = std::size_t{256} << 20;
constexpr int kMaxStreamsPerConnection = 64;

void configure(grpc::ServerBuilder& builder) {
  // Debian's build of gRPC checks its own locks for deadlocks, which costs about 4 % of a busy process.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kPingAfterMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinClientPingIntervalMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdleConnectionMs);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreamsPerConnection);
  // Completes a write only after the transport has sent it, not when a buffer has taken it.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_WRITE_BUFFER_SIZE, 1);
  builder.SetMaxReceiveMessageSize(static_cast<int>(session::kMaxClientMessageBytes));
  builder.SetMaxSendMessageSize(-1);
  // Frames are compressed already, and a small compressed message could expand to a large one.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  grpc::ResourceQuota quota("clothstream");
  quota.Resize(kMaxMemory);
  builder.SetResourceQuota(quota);
}

// Returns whether this gRPC has vulnerabilities by which a peer can end the process or exhaust its memory:
// CVE-2023-1428, CVE-2023-33953, CVE-2023-4785 and CVE-2023-44487. Version 1.60 limits the last one.
bool isVulnerable() {
  constexpr int kFixedMinor = 60;
  int major = 0, minor = 0;
  return std::sscanf(grpc::Version().c_str(), "%d.%d", &major, &minor) != 2 ||
         (major == 1 && minor < kFixedMinor);
}

}  // namespace

struct GrpcEndpoint::State {
  Service service;
  HealthService health;
  ReflectionService reflection;
  std::unique_ptr<Acceptor> acceptor;
  std::unique_ptr<grpc::Server> server;
  std::optional<GrpcEndpointContext> context;
  boost::asio::thread_pool slowCalls{1};  // for calls that take longer than a frame may wait

  State(hosting::SceneServer& scenes, const GrpcEndpointOptions& options) {
    grpc::ServerBuilder builder;
    configure(builder);
    ConnectionLimits limits = options.connections;
    limits.connections = options.maxStreams + kAnsweredBeyondLimit;
    acceptor = std::make_unique<Acceptor>(
        options.host, options.port, limits,
        builder.experimental().AddExternalConnectionAcceptor(
            grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
            credentialsOf(options.tls.get())),
        scenes.metrics);
    builder.RegisterService(&service);
    builder.RegisterService(&health);
    if (options.reflects) builder.RegisterService(&reflection);
    const auto loop = std::make_shared<CompletionLoop>(builder.AddCompletionQueue());
    server = builder.BuildAndStart();
    if (!server) throw std::runtime_error("gRPC cannot start a server");
    limits.connections = options.maxStreams;
    context.emplace(GrpcEndpointContext{.server = scenes,
                                        .metrics = scenes.metrics,
                                        .loop = loop,
                                        .streams = Admission(limits),
                                        .watches = Admission(limits),
                                        .answers = AnswerBudget(options.answers),
                                        .answerTimeout = options.answerTimeout});
    offerService(*context, service, slowCalls);
    offerHealth(*context, health);
    if (options.reflects) offerReflection(*context, reflection);
    if (isVulnerable() && !acceptor->isLoopback())
      spdlog::warn(
          "gRPC {} has published weaknesses by which a peer can stop the server (SECURITY.md): listen on "
          "127.0.0.1, or build with gRPC 1.60 or newer",
          grpc::Version());
    loop->start();
    acceptor->start();
  }

  ~State() {
    if (!context) return;
    acceptor.reset();
    const auto deadline = std::chrono::system_clock::now() + kStopTimeout;
    context->loop->post([this] { stopCalls(); });
    // Waits for the calls before Shutdown(): it pings the client and closes the connection after the answer.
    // The ping must follow the last bytes of the calls, so that the client receives them.
    when([this] { return context->callsMade == 0; }).wait_until(deadline);
    server->Shutdown(deadline + kStopTimeout);
    server->Wait();
    // The connections are closed, but the loop may still have completions of calls.
    when([this] { return context->calls.empty(); }).wait();
    context->loop->stop();
    slowCalls.join();
  }

  // Becomes ready when `condition` holds. The loop's thread checks it now and after each removed call. A
  // later when() replaces the condition.
  std::future<void> when(std::function<bool()> condition) {
    auto reached = std::make_shared<std::promise<void>>();
    std::future<void> future = reached->get_future();
    context->loop->post([this, reached = std::move(reached), condition = std::move(condition)]() mutable {
      context->onForgotten = [reached = std::move(reached), condition = std::move(condition)]() mutable {
        if (reached && condition()) std::exchange(reached, nullptr)->set_value();
      };
      context->onForgotten();
    });
    return future;
  }

  void stopCalls() {
    context->refusal = {grpc::StatusCode::UNAVAILABLE, "the server is stopping"};
    for (const auto& call : context->calls) call->stop(context->refusal);
  }
};

GrpcEndpoint::GrpcEndpoint(hosting::SceneServer& server, const GrpcEndpointOptions& options)
    : state_(std::make_unique<State>(server, options)) {}

GrpcEndpoint::~GrpcEndpoint() = default;

std::uint16_t GrpcEndpoint::port() const {
  return state_->acceptor->port();
}

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
// gRPC client for tests that sends any bytes. Every step ends within 20 s.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include "tests/endpoint/client.h"

namespace clothstream::tests {

inline constexpr const char* kJoin = "/clothstream.v1.ClothStream/Join";

struct RpcOptions {
  std::string method = kJoin;
  bool compressed = false;
  // Flow-control window of 64 KiB instead of one that grows with the speed of the connection.
  bool smallWindow = false;
};

// Channel with a separate connection.
std::shared_ptr<grpc::Channel> channelTo(std::uint16_t port, const RpcOptions& options = {});

// A bidirectional stream of serialised messages.
class RpcStream final : public Client {
 public:
  explicit RpcStream(std::uint16_t port, const RpcOptions& options = {});
  // Shares the connection of this channel with other streams.
  RpcStream(std::shared_ptr<grpc::Channel> channel, const std::string& method, bool compressed = false);
  ~RpcStream() override;
  RpcStream(const RpcStream&) = delete;
  RpcStream& operator=(const RpcStream&) = delete;

  bool send(const std::string& message) override;
  std::optional<std::string> receive() override;
  StreamEnd end() override;
  void leave() override { sendDone(); }
  void disconnect() override { context_.TryCancel(); }

  // Closes the client's half of the stream.
  void sendDone();
  // Waits until the server has begun to answer. Call it before receive().
  void awaitAnswer();
  // Status with which the server ended the stream.
  grpc::Status finish();

 private:
  bool await(const char* what);

  std::shared_ptr<grpc::Channel> channel_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

}  // namespace clothstream::tests

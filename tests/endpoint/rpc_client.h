// SPDX-License-Identifier: MIT
// A real gRPC client for tests that moves bytes, good and bad; every step of it ends within a time.
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

#include "tests/endpoint/viewer.h"

namespace clothstream::tests {

inline constexpr const char* kJoin = "/clothstream.v1.ClothStream/Join";

struct RpcOptions {
  std::string method = kJoin;
  bool compressed = false;
  // Takes 64 KiB that nobody read, instead of as much as the connection's speed suggests.
  bool smallWindow = false;
};

// A channel of its own, so that it shares no connection with others.
std::shared_ptr<grpc::Channel> channelTo(std::uint16_t port, const RpcOptions& options = {});

// A bidirectional stream of serialised messages.
class RpcStream {
 public:
  explicit RpcStream(std::uint16_t port, const RpcOptions& options = {});
  ~RpcStream();
  RpcStream(const RpcStream&) = delete;
  RpcStream& operator=(const RpcStream&) = delete;

  // False if the stream is broken.
  bool send(const std::string& message);
  // nullopt when the server has ended the stream; finish() says why.
  std::optional<std::string> receive();
  // Receives until `done`, answering as a polite client does; false when the server ends the stream first.
  bool watch(Viewer& viewer, const std::function<bool()>& done);
  // Says that nothing more will come.
  void sendDone();
  grpc::Status finish();
  void cancel() { context_.TryCancel(); }

 private:
  bool await(const char* what);

  std::shared_ptr<grpc::Channel> channel_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

}  // namespace clothstream::tests

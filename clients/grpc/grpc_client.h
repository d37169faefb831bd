// SPDX-License-Identifier: MIT
// The native client library: clients/core over a gRPC stream.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/grpc/failure.h"

namespace clothstream {

struct GrpcClientOptions {
  std::string scene;  // empty: the server's default
  std::string clientName = "clothstream";
  std::string displayName;  // shown to others; may be empty
  cs_role role = CS_ROLE_UNSPECIFIED;
  // The most that it wants of the stream, as cs_want has it.
  std::uint32_t quality = 0, temporalLayers = 0;
  // From the call of join() to the whole description.
  std::chrono::milliseconds joinTimeout{10'000};
  // Asked ten times a second while joining: true gives up. May be empty.
  std::function<bool()> cancelled;
  // Every message as it comes, before the cs_client gets it, on the thread that owns that. May be empty.
  std::function<void(std::span<const std::byte>)> onMessage;
  // Once joined, who is cut off tries for this long to come back; 0: the stream then ends with the
  // connection.
  std::chrono::milliseconds reconnectFor{60'000};
  // The server answers pings twice a second; when it has said nothing for this long, the connection is lost
  // (sooner where it tries to come back, as clients/core has it).
  std::chrono::milliseconds silenceTimeout{10'000};
};

// Owns a thread, and that thread owns the cs_client: `onEvents` and what visit() gets run there.
class GrpcClient {
 public:
  // After each message that changed something, with the bits of cs_receive: also before join() returns. With
  // none where the state of the client changed without a message: cut off. Must not call visit().
  using OnEvents = std::function<void(cs_client*, std::uint32_t events)>;

  // `address` as completeAddress gives it. Returns once the description is there.
  [[nodiscard]] static tl::expected<std::unique_ptr<GrpcClient>, Failure> join(
      const std::string& address, const GrpcClientOptions& options, OnEvents onEvents);
  // Leaves the scene, if it has not ended: tells the server and waits half a second at most.
  ~GrpcClient();
  GrpcClient(const GrpcClient&) = delete;
  GrpcClient& operator=(const GrpcClient&) = delete;

  // Runs `task` between two messages and returns when it has run; thread-safe. What it sends travels at once.
  // After the end of the stream the client is still there to be read.
  void visit(const std::function<void(cs_client*)>& task);

  // Why the stream ended; nothing while it runs. Thread-safe.
  std::optional<Failure> ended() const;

  // The clock that the cs_client is given, microseconds.
  static std::uint64_t nowUs();

 private:
  class Stream;
  explicit GrpcClient(std::unique_ptr<Stream> stream);
  std::unique_ptr<Stream> stream_;
};

}  // namespace clothstream

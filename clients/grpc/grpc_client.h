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

// Owns a thread, which moves the bytes of its cs_client. All functions are thread-safe.
class GrpcClient {
 public:
  // On that thread, after each message that changed something, with the bits of cs_receive: also before
  // join() returns. With none where the state of the client changed without a message: cut off. Must call
  // nothing of the GrpcClient.
  using OnEvents = std::function<void(cs_client*, std::uint32_t events)>;

  // `address` as completeAddress gives it. Returns once the description is there.
  [[nodiscard]] static tl::expected<std::unique_ptr<GrpcClient>, Failure> join(
      const std::string& address, const GrpcClientOptions& options, OnEvents onEvents);
  // Leaves the scene, if it has not ended: tells the server and waits half a second at most.
  ~GrpcClient();
  GrpcClient(const GrpcClient&) = delete;
  GrpcClient& operator=(const GrpcClient&) = delete;

  // The caller's alone until unlock(), on the same thread, which must come soon: no message is taken
  // meanwhile. What was sent with it travels then. After the end of the stream the client is still there to
  // be read.
  cs_client* lock();
  void unlock();
  // Runs `task` between lock() and unlock().
  void visit(const std::function<void(cs_client*)>& task);

  // Until something has changed since the last call, the stream has ended, or the time is over. The bits of
  // cs_receive of all that came since then.
  std::uint32_t wait(std::chrono::milliseconds timeout);

  // Why the stream ended; nothing while it runs.
  std::optional<Failure> ended() const;

  // The clock that the cs_client is given, microseconds.
  static std::uint64_t nowUs();

 private:
  class Stream;
  explicit GrpcClient(std::unique_ptr<Stream> stream);
  std::unique_ptr<Stream> stream_;
};

}  // namespace clothstream

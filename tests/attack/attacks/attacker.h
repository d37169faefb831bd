// SPDX-License-Identifier: MIT
// Connections, scenes and floods that attacks use.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <grpcpp/client_context.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "tests/attack/attacks.h"

namespace clothstream::attack {

using Clock = std::chrono::steady_clock;
using Stub = v1::ClothStream::Stub;

inline constexpr int kFlooders = 8;
inline constexpr std::size_t kPieceBytes = 60'000;

std::unique_ptr<Stub> stubOf(const Target& target);

// Calls `call` until the target's time is over. Returns the number of calls.
std::uint64_t repeat(const Target& target, const std::function<void()>& call);
// Calls `call` from kFlooders threads. Each gets its number.
std::uint64_t flood(const Target& target, const std::function<void(int)>& call);

// The beginning of a text.
std::string brief(std::string text);
std::string answerOf(const grpc::Status& status);

// Counts of equal answers, in alphabetical order.
class Answers {
 public:
  void add(const grpc::Status& status) {
    ++counts_[status.ok() ? "accepted"
                          : fmt::format("refused with code {}", static_cast<int>(status.error_code()))];
  }
  std::string text() const {
    std::string text;
    for (const auto& [answer, count] : counts_)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, answer);
    return text;
  }

 private:
  std::map<std::string, std::uint64_t> counts_;
};

grpc::Status create(Stub& stub, const v1::Scene& scene);

v1::Scene sheet(const std::string& name, std::uint32_t size, std::uint32_t substeps);
v1::Scene constrained(const std::string& name, std::uint32_t size, std::uint32_t substeps,
                      std::uint32_t iterations);

v1::ClientMessage helloTo(const std::string& scene);
v1::ClientMessage windOf(float x);

// A stream whose answers a thread reads.
class Joined {
 public:
  Joined(Stub& stub, const std::string& scene, bool reads = true)
      : stream_(stub.Join(&context_)), open_(stream_->Write(helloTo(scene))) {
    if (reads) reader_ = std::jthread([this] { read(); });
  }
  ~Joined() {
    context_.TryCancel();
    if (reader_.joinable()) reader_.join();
  }
  Joined(const Joined&) = delete;
  Joined& operator=(const Joined&) = delete;

  bool send(const v1::ClientMessage& message) {
    open_ = open_ && stream_->Write(message);
    return open_;
  }
  bool open() const { return open_ && !ended_; }
  // Notices that the simulation went back to an earlier state.
  int rolledBack() const { return rolledBack_; }
  std::string lastError() {
    const std::lock_guard lock(mutex_);
    return lastError_;
  }

 private:
  void read() {
    v1::ServerMessage message;
    while (stream_->Read(&message)) {
      if (message.notice().kind() == v1::NOTICE_KIND_ROLLED_BACK) ++rolledBack_;
      if (!message.has_error()) continue;
      const std::lock_guard lock(mutex_);
      lastError_ = message.error().text();
    }
    ended_ = true;
  }

  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ClientMessage, v1::ServerMessage>> stream_;
  bool open_;
  std::atomic<bool> ended_{false};
  std::atomic<int> rolledBack_{0};
  std::mutex mutex_;
  std::string lastError_;
  std::jthread reader_;
};

// Uploads a scene and creates it. Returns the answer.
std::string upload(Stub& stub, const std::string& content);

// A connected TCP socket, or -1.
int connectTo(const std::string& address);
// Opens connections, sends each `first`, and holds them open. Returns how many stay open.
std::string holdConnections(const Target& target, const std::string& address, int count,
                            const std::string& first);

// Attacks by theme.
std::span<const Attack> workAttacks();
std::span<const Attack> hiddenCostAttacks();
std::span<const Attack> contentAttacks();
std::span<const Attack> messageAttacks();
std::span<const Attack> connectionAttacks();
std::span<const Attack> identityAttacks();
std::span<const Attack> clientAttacks();
std::span<const Attack> endpointAttacks();
std::span<const Attack> handAttacks();
std::span<const Attack> datagramAttacks();
std::span<const Attack> clothesAttacks();

}  // namespace clothstream::attack

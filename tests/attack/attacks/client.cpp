// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include "clients/grpc/grpc_client.h"
#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

constexpr std::uint32_t kHuge = 1u << 30;
constexpr std::size_t kChunkBytes = 200'000;

// Answers each stream with content that has no end, and with messages that a client might collect.
class HostileServer final : public v1::ClothStream::Service {
 public:
  grpc::Status Join(grpc::ServerContext* context,
                    grpc::ServerReaderWriter<v1::ServerMessage, v1::ClientMessage>* stream) override {
    v1::ServerMessage message;
    v1::Welcome& welcome = *message.mutable_welcome();
    welcome.set_protocol_version(1);
    welcome.set_participant_id(1);
    welcome.set_scene("evil");
    welcome.set_codec(3);
    welcome.set_description_content_id(1);
    stream->Write(message);
    for (std::uint32_t round = 0; !context->IsCancelled(); ++round) {
      v1::Chunk& chunk = *message.mutable_chunk();
      chunk.set_content_id(1);
      chunk.set_kind(v1::CONTENT_KIND_STREAM_DESCRIPTION);
      chunk.set_index(round);
      chunk.set_count(kHuge);
      chunk.set_total_bytes(kHuge);
      chunk.set_data(std::string(kChunkBytes, '\xff'));
      if (!stream->Write(message)) break;
      v1::Notice& notice = *message.mutable_notice();
      notice.set_text(std::string(kChunkBytes, 'n'));
      if (!stream->Write(message)) break;
      v1::Presence& joined = *message.mutable_presence();
      joined.set_kind(v1::PRESENCE_KIND_JOINED);
      joined.mutable_participant()->set_id(round + 2);
      joined.mutable_participant()->set_display_name(std::string(kChunkBytes, 'p'));
      if (!stream->Write(message)) break;
    }
    return grpc::Status::OK;
  }
};

double residentMegabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) * 1024 / 1e6;
  return 0;
}

// The opposite direction: a server that attacks its client, here in one process. What the server queues is
// bounded by the window of gRPC.
std::string feedClient(const Target& target) {
  HostileServer service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const double before = residentMegabytes();
  double peak = before;
  std::string end = "the client stays";
  const auto until = Clock::now() + target.time;
  NativeClientOptions options;
  // The client calls this ten times a second.
  options.cancelled = [&] {
    peak = std::max(peak, residentMegabytes());
    return Clock::now() > until;
  };
  while (Clock::now() < until) {
    const auto client = joinByGrpc(ServerAddress(fmt::format("127.0.0.1:{}", port)), options,
                                   [](cs_client*, std::uint32_t) {});
    if (!client) end = "the client leaves: " + brief(client.error().text);
  }
  server->Shutdown(std::chrono::system_clock::now());
  constexpr double kMaxGrowth = 268.4;  // MB
  return fmt::format("{}; its memory {} by {:.0f} MB", end, peak - before <= kMaxGrowth ? "grew" : "exploded",
                     peak - before);
}

constexpr Attack kAttacksClient[] = {
    {"hostile_server", "a server sends its client content, notices and participants without end", &feedClient,
     ".*; its memory grew by [0-9]+ MB"},
};

}  // namespace

std::span<const Attack> clientAttacks() {
  return kAttacksClient;
}

}  // namespace clothstream::attack

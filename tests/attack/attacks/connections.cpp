// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <grpcpp/client_context.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/hosting/limits.h"
#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

std::string idleGrpc(const Target& target) {
  return holdConnections(target, target.grpc, 3000, "");
}

std::string idleWeb(const Target& target) {
  return holdConnections(target, target.web, 3000, "");
}

std::string halfRequests(const Target& target) {
  return holdConnections(target, target.web, 1000, "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ");
}

std::string slowReaders(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < 30; ++i) joined.push_back(std::make_unique<Joined>(*stub, "", false));
  std::this_thread::sleep_for(target.time);
  return "30 unread streams";
}

// Streams that send one message again and again, and never say hello. Returns how many are open at the end.
std::string floodWithoutHello(const Target& target, int count,
                              const std::function<v1::ClientMessage(int)>& message,
                              std::chrono::milliseconds pause) {
  const auto stub = stubOf(target);
  struct Stream {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<v1::ClientMessage, v1::ServerMessage>> stream;
    std::atomic<bool> ended{false};
    std::jthread reader;
  };
  std::vector<std::unique_ptr<Stream>> streams;
  for (int i = 0; i < count; ++i) {
    Stream& each = *streams.emplace_back(std::make_unique<Stream>());
    each.stream = stub->Join(&each.context);
    each.reader = std::jthread([&each] {
      v1::ServerMessage answer;
      while (each.stream->Read(&answer)) {
      }
      each.ended = true;
    });
  }
  int round = 0;
  repeat(target, [&] {
    for (const auto& each : streams)
      if (!each->ended) each->stream->Write(message(round));
    ++round;
    std::this_thread::sleep_for(pause);
  });
  const auto open = std::ranges::count_if(streams, [](const auto& each) { return !each->ended; });
  for (const auto& each : streams) each->context.TryCancel();
  streams.clear();
  return fmt::format("{} of {} streams are open after {} s", open, count, target.time.count());
}

std::string pingWithoutHello(const Target& target) {
  return floodWithoutHello(
      target, 30,
      [](int) {
        v1::ClientMessage message;
        message.mutable_ping()->set_client_time_us(1);
        return message;
      },
      std::chrono::milliseconds(100));
}

std::string uploadSlowly(const Target& target) {
  // The server waits for a hello, and for the time of an upload on top.
  const hosting::Limits limits(hosting::Profile::open);
  const auto wait = std::chrono::ceil<std::chrono::seconds>(limits.helloTimeout + limits.maxUploadTime);
  constexpr std::uint32_t kPieces = 1000;
  const std::string first(kPieceBytes, '\xff');
  std::string answer = floodWithoutHello(
      {target.grpc, target.web, wait + std::chrono::seconds(2)}, 30,
      [&](int round) {
        v1::ClientMessage message;
        v1::Chunk& chunk = *message.mutable_upload();
        chunk.set_content_id(1);
        chunk.set_kind(v1::CONTENT_KIND_SCENE);
        chunk.set_index(static_cast<std::uint32_t>(round));
        chunk.set_count(kPieces);
        chunk.set_total_bytes(2 * kPieceBytes);
        chunk.set_data(round == 0 ? first : "x");
        return message;
      },
      std::chrono::milliseconds(200));
  // An honest upload needs the room that the slow ones held.
  const std::string honest = upload(*stubOf(target), sheet("honest", 8, 4).SerializeAsString());
  return answer + "; an honest upload: " + honest;
}

// The first bytes of a TLS record with a ClientHello that never ends.
std::string halfHandshakes(const Target& target) {
  const std::string begin("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11);
  const std::string web =
      holdConnections({target.grpc, target.web, target.time / 2}, target.web, 1000, begin);
  return web +
         "; gRPC: " + holdConnections({target.grpc, target.web, target.time / 2}, target.grpc, 1000, begin);
}

std::string floodHandshakes(const Target& target) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                  &SSL_CTX_free);
  std::atomic<std::uint64_t> complete = 0;
  const std::uint64_t tried = flood(target, [&](int i) {
    const int file = connectTo(i % 2 == 0 ? target.web : target.grpc);
    if (file < 0) return;
    const std::unique_ptr<SSL, decltype(&SSL_free)> tls(SSL_new(context.get()), &SSL_free);
    SSL_set_fd(tls.get(), file);
    if (SSL_connect(tls.get()) == 1) ++complete;
    ::close(file);
  });
  return fmt::format("{} of {} handshakes completed", complete.load(), tried);
}

// Streams without hello, all on one connection.
std::string floodStreams(const Target& target) {
  const auto stub = stubOf(target);
  constexpr int kStreams = 2000;
  struct Stream {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<v1::ClientMessage, v1::ServerMessage>> stream;
  };
  Answers answers;
  std::mutex mutex;
  flood(target, [&](int) {
    std::vector<std::unique_ptr<Stream>> streams;
    for (int i = 0; i < kStreams / kFlooders; ++i) {
      Stream& each = *streams.emplace_back(std::make_unique<Stream>());
      each.context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
      each.stream = stub->Join(&each.context);
    }
    for (const auto& each : streams) {
      v1::ServerMessage message;
      while (each->stream->Read(&message)) {
      }
      const grpc::Status status = each->stream->Finish();
      const std::lock_guard lock(mutex);
      answers.add(status);
    }
  });
  return answers.text();
}

// Requests on connections that stay open.
std::string floodRequests(const Target& target) {
  std::array<int, kFlooders> files{};
  for (int& file : files) file = connectTo(target.web);
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
  std::array<std::uint64_t, kFlooders> answered{};
  flood(target, [&](int i) {
    std::array<char, 4096> answer{};
    const ssize_t sent = ::send(files[i], request.data(), request.size(), MSG_NOSIGNAL);
    if (sent > 0 && ::recv(files[i], answer.data(), answer.size(), 0) > 0) {
      ++answered[i];
      return;
    }
    ::close(files[i]);
    files[i] = connectTo(target.web);
  });
  for (const int file : files) ::close(file);
  return fmt::format("{} requests answered",
                     std::accumulate(answered.begin(), answered.end(), std::uint64_t{0}));
}

constexpr Attack kAttacksConnection[] = {
    {"idle_grpc", "hold 3,000 silent connections to gRPC", &idleGrpc,
     "[0-9]{1,3} of [0-9]+ connections are open after .*"},
    {"idle_web", "hold 3,000 silent connections to the page", &idleWeb,
     "[0-9]{1,3} of [0-9]+ connections are open after .*"},
    {"half_requests", "hold 1,000 requests that never end", &halfRequests,
     "[0-9]{1,3} of [0-9]+ connections are open after .*"},
    {"slow_readers", "join the victim's scene 30 times and read nothing", &slowReaders, "30 unread streams"},
    {"streams", "open 2,000 streams without hello on one connection again and again", &floodStreams,
     "[0-9]+ refused with code [48](, [0-9]+ refused with code 8)?"},
    {"requests", "ask for /healthz on eight connections without end", &floodRequests,
     "[1-9][0-9]* requests answered"},
    {"pings_without_hello", "hold 30 streams open with pings and without hello", &pingWithoutHello,
     "0 of 30 streams are open after .*", "--profile public"},
    {"slow_uploads", "begin 30 uploads and continue them a byte at a time", &uploadSlowly,
     "0 of 30 streams are open after .*; an honest upload: accepted.*",
     "--max-upload-memory 2 --profile public"},
    {"half_handshakes", "hold 2,000 TLS handshakes that never end", &halfHandshakes,
     "[0-9]{1,3} of [0-9]+ connections.*; gRPC: [0-9]{1,3} of [0-9]+ connections.*",
     "--tls self --state-dir DIRECTORY"},
    {"handshakes", "complete TLS handshakes without end", &floodHandshakes,
     "[1-9][0-9]* of [0-9]+ handshakes completed", "--tls self --state-dir DIRECTORY"},
};

}  // namespace

std::span<const Attack> connectionAttacks() {
  return kAttacksConnection;
}

}  // namespace clothstream::attack

// SPDX-License-Identifier: MIT
// Attacks below the messages of the protocol: frames of WebSocket, reflection, probes, files that block.
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/client_callback.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/grpc/channel.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "proto/codec/packet_header.h"
#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;
using grpc::reflection::v1alpha::ServerReflection;
using grpc::reflection::v1alpha::ServerReflectionRequest;
using grpc::reflection::v1alpha::ServerReflectionResponse;
using namespace std::chrono_literals;

// Bytes that arrive at a socket within this time; empty at its end.
std::string received(int file, std::chrono::milliseconds time) {
  pollfd waits{file, POLLIN, 0};
  std::array<char, 4096> bytes{};
  if (::poll(&waits, 1, static_cast<int>(time.count())) <= 0) return {};
  const ssize_t count = ::recv(file, bytes.data(), bytes.size(), MSG_DONTWAIT);
  return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
}

int openWebSocket(const Target& target) {
  const int file = connectTo(target.web);
  const std::string request =
      "GET /stream HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  ::send(file, request.data(), request.size(), MSG_NOSIGNAL);
  if (received(file, 5s).starts_with("HTTP/1.1 101")) return file;
  ::close(file);
  return -1;
}

// Masked frames without end.
class FrameFlood {
 public:
  // Pings, pongs, empty fragments of a message, or pongs with payload.
  explicit FrameFlood(int kind) {
    constexpr std::size_t kBytes = 256 * 1024;
    const std::array<std::string, 4> kinds{std::string("\x89\x80mask", 6), std::string("\x8a\x80mask", 6),
                                           std::string("\x00\x80mask", 6),
                                           std::string("\x8a\xfdmask", 6) + std::string(125, 'x')};
    const std::string& frame = kinds[static_cast<std::size_t>(kind) % kinds.size()];
    // The message that the fragments belong to.
    if (frame[0] == 0) first_ = std::string("\x02\x80mask", 6);
    while (frames_.size() < kBytes) frames_ += frame;
  }

  // Sends as much as there is room for. Returns the number of bytes, or -1 at the end of the connection.
  ssize_t send(int file) {
    const std::string& bytes = first_.empty() ? frames_ : first_;
    const ssize_t sent = ::send(file, bytes.data() + at_, bytes.size() - at_, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) return errno == EAGAIN ? 0 : -1;
    at_ += static_cast<std::size_t>(sent);
    if (at_ < bytes.size()) return sent;
    at_ = 0;
    first_.clear();
    return sent;
  }

 private:
  std::string first_, frames_;
  std::size_t at_ = 0;
};

std::string floodFrames(const Target& target) {
  constexpr const char* kReason = "too many WebSocket frames";
  constexpr std::size_t kKept = 200;
  std::atomic<std::uint64_t> bytes = 0, closed = 0, opened = 0;
  const auto end = Clock::now() + target.time;
  flood(target, [&](int i) {
    const int file = openWebSocket(target);
    if (file < 0) return std::this_thread::sleep_for(50ms);
    ++opened;
    FrameFlood frames(i);
    std::string answers;  // the newest bytes
    bool ended = false;
    while (!ended && Clock::now() < end) {
      const ssize_t sent = frames.send(file);
      if (sent > 0) bytes += static_cast<std::uint64_t>(sent);
      for (std::string more = received(file, 1ms); !more.empty(); more = received(file, 0ms)) {
        answers += more;
        answers = answers.substr(answers.size() - std::min(answers.size(), kKept));
      }
      ended = sent < 0 || answers.find(kReason) != std::string::npos;
    }
    if (answers.find(kReason) != std::string::npos) ++closed;
    ::close(file);
    std::this_thread::sleep_for(50ms);
  });
  return fmt::format("{} of {} connections were closed with the reason, after {} kB each", closed.load(),
                     opened.load(), bytes / std::max<std::uint64_t>(opened, 1) / 1000);
}

// Streams that ask again and again, next to some that ask nothing.
std::string floodReflection(const Target& target) {
  const auto stub = ServerReflection::NewStub(makeChannel(target.grpc));
  struct Idle {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<ServerReflectionRequest, ServerReflectionResponse>> stream;
  };
  std::vector<std::unique_ptr<Idle>> idle;
  for (int i = 0; i < 40; ++i) {
    idle.push_back(std::make_unique<Idle>());
    idle.back()->stream = stub->ServerReflectionInfo(&idle.back()->context);
  }
  ServerReflectionRequest request;
  request.set_file_containing_symbol("clothstream.v1.ClothStream");
  std::atomic<std::uint64_t> bytes = 0;
  std::mutex mutex;
  Answers ends;
  flood(target, [&](int) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + target.time);
    const auto stream = stub->ServerReflectionInfo(&context);
    ServerReflectionResponse response;
    std::jthread writer([&] {
      while (stream->Write(request)) {
      }
    });
    while (stream->Read(&response)) bytes += response.ByteSizeLong();
    writer.join();
    const grpc::Status status = stream->Finish();
    const std::lock_guard lock(mutex);
    ends.add(status);
  });
  for (const auto& each : idle) each->context.TryCancel();
  const double megabytes = static_cast<double>(bytes) / 1e6 / static_cast<double>(target.time.count());
  return fmt::format("{} MB a second; streams: {}", megabytes < 10 ? "less than 10" : "10 or more",
                     ends.text());
}

// Counts the watches that have got an answer and not ended yet.
class HealthWatch final : public grpc::ClientReadReactor<HealthCheckResponse> {
 public:
  HealthWatch(grpc::health::v1::Health::Stub& stub, std::atomic<int>& open) : open_(open) {
    stub.async()->Watch(&context_, &request_, this);
    StartRead(&response_);
    StartCall();
  }
  void OnReadDone(bool ok) override {
    if (!ok) return;
    ++open_;
    isOpen_ = true;
    StartRead(&response_);
  }
  void OnDone(const grpc::Status&) override {
    if (isOpen_) --open_;
    ended_.set_value();
  }
  void end() {
    context_.TryCancel();
    ended_.get_future().wait();
  }

 private:
  grpc::ClientContext context_;
  HealthCheckRequest request_;
  HealthCheckResponse response_;
  bool isOpen_ = false;
  std::atomic<int>& open_;
  std::promise<void> ended_;
};

std::string watchHealth(const Target& target) {
  constexpr int kConnections = 8, kWatchesOfEach = 50;
  std::vector<std::unique_ptr<grpc::health::v1::Health::Stub>> stubs;
  std::vector<std::unique_ptr<HealthWatch>> watches;
  std::atomic<int> open = 0;
  for (int i = 0; i < kConnections; ++i) {
    stubs.push_back(grpc::health::v1::Health::NewStub(makeChannel(target.grpc)));
    for (int j = 0; j < kWatchesOfEach; ++j)
      watches.push_back(std::make_unique<HealthWatch>(*stubs.back(), open));
  }
  std::this_thread::sleep_for(target.time);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 5s);
  v1::ListScenesResponse scenes;
  const std::string answer = answerOf(stubOf(target)->ListScenes(&context, {}, &scenes));
  const int held = open;
  for (const auto& each : watches) each->end();
  return fmt::format("{} of {} watches are open; another call: {}", held, watches.size(), answer);
}

// Connections to the port for operators that are opened again and again, while a probe asks for its health.
std::string holdProbes(const Target& target) {
  std::jthread holder([&](const std::stop_token& stop) {
    std::vector<int> held;
    while (!stop.stop_requested()) {
      held.push_back(connectTo(target.metrics));
      const std::string half = "GET /healthz HTTP/1.1\r\n";
      ::send(held.back(), half.data(), half.size(), MSG_NOSIGNAL);
      std::this_thread::sleep_for(2ms);
      if (held.size() < 500) continue;
      for (const int file : held) ::close(file);
      held.clear();
    }
    for (const int file : held) ::close(file);
  });
  int asked = 0, answered = 0;
  repeat(target, [&] {
    std::this_thread::sleep_for(100ms);
    const int file = connectTo(target.metrics);
    const std::string request = "GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    ::send(file, request.data(), request.size(), MSG_NOSIGNAL);
    ++asked;
    if (received(file, 1s).starts_with("HTTP/1.1 200")) ++answered;
    ::close(file);
  });
  return answered == asked ? fmt::format("all {} probes answered", asked)
                           : fmt::format("{} of {} probes answered", answered, asked);
}

// A body that some proxies would forward, and that must not count as a second request.
std::string smuggleRequest(const Target& target) {
  std::map<std::string, int> answers;
  for (const char* encoding : {"chunked", "xchunked", "identity", "chunked, xchunked", "\"chunked\""}) {
    const int file = connectTo(target.web);
    const std::string request = fmt::format(
        "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: {}\r\n\r\n"
        "GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        encoding);
    ::send(file, request.data(), request.size(), MSG_NOSIGNAL);
    std::string answer;
    for (std::string more = received(file, 500ms); !more.empty(); more = received(file, 500ms))
      answer += more;
    ::close(file);
    int count = 0;
    for (std::size_t at = answer.find("HTTP/1.1 "); at != std::string::npos;
         at = answer.find("HTTP/1.1 ", at + 1))
      ++count;
    ++answers[count == 1 ? "one answer" : fmt::format("{} answers", count)];
  }
  std::string text;
  for (const auto& [answer, count] : answers)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, answer);
  return text;
}

// Puts a FIFO without a writer in the place of each of these files, and lets the server read them again.
std::string blockFiles(const Target& target, const std::vector<std::string>& names) {
  std::this_thread::sleep_for(1s);
  for (const std::string& name : names) {
    const std::filesystem::path file = std::filesystem::path(target.directory) / name;
    std::filesystem::remove(file);
    if (::mkfifo(file.c_str(), S_IRUSR | S_IWUSR) != 0) return name + " cannot be replaced";
  }
  if (::kill(target.process, SIGHUP) != 0) return "no signal";
  std::this_thread::sleep_for(target.time);
  return "files are FIFOs";
}

std::string blockCertificate(const Target& target) {
  return blockFiles(target, {"tls/self.key", "tls/self.pem"});
}

std::string blockKeys(const Target& target) {
  return blockFiles(target, {"attack.pem"});
}

v1::Scene sceneOfManyCloths() {
  v1::Scene scene = sheet("wardrobe", 4, 1);
  scene.set_simulation_rate(72);
  for (int i = 1; i < 256; ++i) {
    v1::Cloth& cloth = *scene.add_cloths();
    cloth = scene.cloths(0);
    cloth.set_name(fmt::format("sheet_{}", i));
  }
  return scene;
}

// Changes the material of all cloths of a scene, while others watch it.
std::string changeMaterials(const Target& target) {
  const auto stub = stubOf(target);
  if (const grpc::Status created = create(*stub, sceneOfManyCloths()); !created.ok())
    return "not created: " + brief(created.error_message());
  grpc::ClientContext context;
  const auto viewer = stub->Join(&context);
  viewer->Write(helloTo("wardrobe"));
  std::atomic<std::uint64_t> changes = 0, changeBytes = 0, framesSeen = 0;
  std::jthread reader([&] {
    v1::ServerMessage message;
    while (viewer->Read(&message)) {
      if (message.has_frame()) {
        ++framesSeen;
        const auto packet = codec::parsePacket(std::as_bytes(std::span(message.frame().packet())));
        if (!packet) continue;
        v1::ClientMessage acknowledgement;
        acknowledgement.mutable_frame_ack()->set_tick(packet->header.tick);
        viewer->Write(acknowledgement);
      }
      if (!message.has_parameter_changed()) continue;
      ++changes;
      changeBytes += message.ByteSizeLong();
    }
  });
  Joined changer(*stub, "wardrobe");
  constexpr std::array kMaterials{"silk", "denim"};
  std::size_t next = 0;
  repeat(target, [&] {
    v1::ClientMessage message;
    message.mutable_parameter_change()->add_cloths()->set_material(kMaterials[next++ % kMaterials.size()]);
    changer.send(message);
    std::this_thread::sleep_for(33ms);
  });
  context.TryCancel();
  reader.join();
  const std::uint64_t perChange = changeBytes / std::max<std::uint64_t>(changes, 1);
  return fmt::format("{} B for each change{}; {} changes, {} frames", perChange,
                     perChange > 500 ? ", which is too much" : "", changes.load(), framesSeen.load());
}

constexpr Attack kAttacksEndpoint[] = {
    {"ws_frames", "send empty pings, pongs and fragments over WebSocket without end", &floodFrames,
     "[1-9][0-9]* of [0-9]+ connections were closed with the reason, after .*"},
    {"reflection", "ask for reflection without end, next to 40 idle streams, of a server that offers it",
     &floodReflection, "less than 10 MB a second; streams: [0-9]+ refused with code .*", "--reflection"},
    {"reflection_off", "the same of a server that does not", &floodReflection,
     "less than 10 MB a second; streams: [0-9]+ refused with code 12"},
    {"watches", "hold 400 health watches", &watchHealth,
     "(1?[0-9]{2}|2[0-4][0-9]|25[0-6]) of 400 watches are open; another call: accepted"},
    {"probes", "hold all connections to the port for operators", &holdProbes, "all [0-9]+ probes answered",
     "--metrics-port 0"},
    {"smuggling", "send requests behind a transfer encoding that does not exist", &smuggleRequest,
     "5 one answer"},
    {"blocked_certificate", "reload a certificate whose files block, and then SIGTERM", &blockCertificate,
     "files are FIFOs", "--tls self --state-dir DIRECTORY", Access::open, true},
    {"blocked_keys", "reload keys of tokens whose files block, and then SIGTERM", &blockKeys,
     "files are FIFOs", "", Access::tokens, true},
    {"materials", "change the material of 256 cloths 30 times a second", &changeMaterials,
     "[0-9]+ B for each change; [1-9][0-9]* changes, [1-9][0-9]* frames"},
};

}  // namespace

std::span<const Attack> endpointAttacks() {
  return kAttacksEndpoint;
}

}  // namespace clothstream::attack

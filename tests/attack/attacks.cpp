// SPDX-License-Identifier: MIT
#include "tests/attack/attacks.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <grpcpp/client_context.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "clients/grpc/channel.h"
#include "clothstream/v1/session.grpc.pb.h"

namespace clothstream::attack {
namespace {

using Clock = std::chrono::steady_clock;
using Stub = v1::ClothStream::Stub;

constexpr int kFlooders = 8;
constexpr std::size_t kPieceBytes = 60'000;
// Stays below the server's rate of messages.
constexpr std::chrono::milliseconds kPiecePause{5};

std::unique_ptr<Stub> stubOf(const Target& target) {
  return v1::ClothStream::NewStub(makeChannel(target.grpc));
}

// Calls `call` until the target's time is over. Returns the number of calls.
std::uint64_t repeat(const Target& target, const std::function<void()>& call) {
  std::uint64_t calls = 0;
  for (const auto end = Clock::now() + target.time; Clock::now() < end; ++calls) call();
  return calls;
}

// Calls `call` from several threads. Each gets its number.
std::uint64_t flood(const Target& target, const std::function<void(int)>& call) {
  std::array<std::uint64_t, kFlooders> calls{};
  std::vector<std::jthread> threads;
  for (int i = 0; i < kFlooders; ++i)
    threads.emplace_back([&, i] { calls[i] = repeat(target, [&] { call(i); }); });
  threads.clear();
  std::uint64_t sum = 0;
  for (const std::uint64_t each : calls) sum += each;
  return sum;
}

std::string brief(std::string text) {
  constexpr std::size_t kMost = 160;
  if (text.size() > kMost) text = text.substr(0, kMost) + "...";
  return text;
}

std::string answerOf(const grpc::Status& status) {
  return status.ok() ? "accepted" : "refused: " + brief(status.error_message());
}

// Counts of equal answers, the most frequent first.
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

grpc::Status create(Stub& stub, const v1::Scene& scene) {
  grpc::ClientContext context;
  v1::CreateSceneRequest request;
  *request.mutable_scene() = scene;
  v1::CreateSceneResponse response;
  return stub.CreateScene(&context, request, &response);
}

v1::Scene sheet(const std::string& name, std::uint32_t size, std::uint32_t substeps) {
  v1::Scene scene;
  scene.set_name(name);
  scene.set_substeps(substeps);
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_grid()->set_rows(size);
  cloth.mutable_grid()->set_columns(size);
  cloth.mutable_grid()->set_width(1);
  cloth.mutable_grid()->set_height(1);
  cloth.set_mass(0.2f);
  return scene;
}

v1::Scene constrained(const std::string& name, std::uint32_t size, std::uint32_t substeps,
                      std::uint32_t iterations) {
  v1::Scene scene = sheet(name, size, substeps);
  v1::ConstraintSolver& solver = *scene.mutable_cloths(0)->mutable_solver()->mutable_constraint();
  solver.set_iterations(iterations);
  solver.set_tolerance(0);
  return scene;
}

v1::ClientMessage helloTo(const std::string& scene) {
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(1);
  message.mutable_hello()->set_scene(scene);
  for (const std::uint32_t codec : {1u, 2u, 3u}) message.mutable_hello()->add_codecs(codec);
  return message;
}

v1::ClientMessage windOf(float x) {
  v1::ClientMessage change;
  change.mutable_parameter_change()->mutable_wind()->mutable_value()->set_x(x);
  return change;
}

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
  std::uint64_t frames() const { return frames_; }
  std::string lastError() {
    const std::lock_guard lock(mutex_);
    return lastError_;
  }

 private:
  void read() {
    v1::ServerMessage message;
    while (stream_->Read(&message)) {
      if (message.has_frame()) ++frames_;
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
  std::atomic<std::uint64_t> frames_{0};
  std::mutex mutex_;
  std::string lastError_;
  std::jthread reader_;
};

// Uploads a scene and creates it. Returns the answer.
std::string upload(Stub& stub, const std::string& content) {
  grpc::ClientContext context;
  const auto stream = stub.Join(&context);
  const auto count = static_cast<std::uint32_t>((content.size() + kPieceBytes - 1) / kPieceBytes);
  const auto start = Clock::now();
  bool open = true;
  for (std::uint32_t i = 0; open && i < count; ++i) {
    v1::ClientMessage message;
    v1::Chunk& chunk = *message.mutable_upload();
    chunk.set_content_id(1);
    chunk.set_kind(v1::CONTENT_KIND_SCENE);
    chunk.set_index(i);
    chunk.set_count(count);
    chunk.set_total_bytes(content.size());
    chunk.set_data(content.substr(i * kPieceBytes, kPieceBytes));
    open = stream->Write(message);
    std::this_thread::sleep_for(kPiecePause);
  }
  const auto uploaded = Clock::now();
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_create_scene()->set_uploaded_content_id(1);
  stream->Write(message);
  v1::ServerMessage answer;
  while (stream->Read(&answer)) {
    const auto seconds = [](Clock::duration time) { return std::chrono::duration<double>(time).count(); };
    const std::string what = answer.has_error() ? "refused: " + brief(answer.error().text()) : "accepted";
    context.TryCancel();
    return fmt::format("{} ({:.2f} s for {} bytes, then {:.2f} s)", what, seconds(uploaded - start),
                       content.size(), seconds(Clock::now() - uploaded));
  }
  return "the stream was closed: " + brief(stream->Finish().error_message());
}

// A connected TCP socket, or -1.
int connectTo(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  if (::inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr) != 1) return -1;
  const int file = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): the system's interface
  if (file >= 0 && ::connect(file, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) return file;
  if (file >= 0) ::close(file);
  return -1;
}

// Opens connections, sends each `first`, and holds them open. Returns how many stay open.
std::string holdConnections(const Target& target, const std::string& address, int count,
                            const std::string& first) {
  std::vector<int> files;
  for (int i = 0; i < count; ++i) {
    const int file = connectTo(address);
    if (file < 0) break;
    if (!first.empty()) ::send(file, first.data(), first.size(), MSG_NOSIGNAL);
    files.push_back(file);
  }
  std::this_thread::sleep_for(target.time);
  const auto open = std::ranges::count_if(files, [](int file) {
    char byte = 0;
    const ssize_t got = ::recv(file, &byte, 1, MSG_DONTWAIT | MSG_PEEK);
    return got > 0 || (got < 0 && errno == EAGAIN);
  });
  for (const int file : files) ::close(file);
  return fmt::format("{} of {} connections are open after {} s", open, files.size(), target.time.count());
}

// ---- work

std::string createHugeSolve(const Target& target) {
  return answerOf(create(*stubOf(target), constrained("evil", 512, 64, 10'000)));
}

std::string createHugeGrid(const Target& target) {
  return answerOf(create(*stubOf(target), sheet("huge", 4096, 1)));
}

std::string raiseIterations(const Target& target) {
  const auto stub = stubOf(target);
  Joined joined(*stub, "solver_constraint");
  v1::ClientMessage change;
  v1::ClothChange& cloth = *change.mutable_parameter_change()->add_cloths();
  cloth.mutable_solver()->mutable_constraint()->set_iterations(10'000);
  cloth.mutable_solver()->mutable_constraint()->set_tolerance(0);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  joined.send(change);
  std::this_thread::sleep_for(target.time);
  const std::string error = joined.lastError();
  return error.empty() ? "accepted" : "refused: " + brief(error);
}

std::string fillBudget(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  std::uint32_t size = 128;
  std::string sizes;
  for (int scene = 0; scene < 64 && size >= 2;) {
    const std::string name = fmt::format("filler_{}", scene);
    if (!create(*stub, sheet(name, size, 10)).ok()) {
      size /= 2;
      continue;
    }
    sizes += fmt::format(" {}", size);
    joined.push_back(std::make_unique<Joined>(*stub, name));
    ++scene;
  }
  std::this_thread::sleep_for(target.time);
  return fmt::format("{} scenes accepted, of these sizes:{}", joined.size(), sizes);
}

std::string createAndDelete(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  repeat(target, [&] {
    answers.add(create(*stub, sheet("again", 64, 4)));
    grpc::ClientContext context;
    v1::DeleteSceneRequest request;
    request.set_name("again");
    v1::DeleteSceneResponse response;
    stub->DeleteScene(&context, request, &response);
  });
  return answers.text();
}

// ---- hostile content

std::string uploadDenseVertices(const Target& target) {
  v1::Scene scene = sheet("dense", 2, 1);
  v1::Mesh& mesh = *scene.mutable_cloths(0)->mutable_mesh();
  constexpr int kSide = 256;
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      for (const int coordinate : {column, row, 0}) mesh.add_positions(static_cast<float>(coordinate) / 128);
  for (std::uint32_t row = 0; row + 1 < kSide; ++row)
    for (std::uint32_t column = 0; column + 1 < kSide; ++column) {
      const std::uint32_t a = row * kSide + column;
      for (const std::uint32_t node : {a, a + 1, a + kSide + 1}) mesh.add_triangles(node);
    }
  mesh.set_weld_distance(std::ldexp(1.0f, -30));
  return upload(*stubOf(target), scene.SerializeAsString());
}

std::string uploadFan(const Target& target) {
  v1::Scene scene = sheet("fan", 2, 1);
  v1::Mesh& mesh = *scene.mutable_cloths(0)->mutable_mesh();
  constexpr std::uint32_t kTriangles = 100'000;
  for (int i = 0; i < 3; ++i) mesh.add_positions(0);
  for (std::uint32_t i = 0; i < kTriangles; ++i) {
    const double angle = 2 * std::numbers::pi * i / kTriangles;
    mesh.add_positions(static_cast<float>(100 * std::cos(angle)));
    mesh.add_positions(static_cast<float>(100 * std::sin(angle)));
    mesh.add_positions(0);
    for (const std::uint32_t node : {0u, i + 1, (i + 1) % kTriangles + 1}) mesh.add_triangles(node);
  }
  return upload(*stubOf(target), scene.SerializeAsString());
}

void appendVarint(std::string& bytes, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<char>(value | 0x80));
  bytes.push_back(static_cast<char>(value));
}

std::uint64_t tagOf(const google::protobuf::Descriptor& message, const std::string& field) {
  constexpr int kLengthDelimited = 2;
  return static_cast<std::uint64_t>(message.FindFieldByName(field)->number() << 3 | kLengthDelimited);
}

std::string uploadEmptyPins(const Target& target) {
  v1::Scene scene = sheet("pins", 2, 1);
  std::string pin, cloth = scene.cloths(0).SerializeAsString();
  appendVarint(pin, tagOf(*v1::Cloth::descriptor(), "pins"));
  appendVarint(pin, 0);
  while (cloth.size() < 100'000'000) cloth += pin;
  scene.clear_cloths();
  std::string content = scene.SerializeAsString();
  appendVarint(content, tagOf(*v1::Scene::descriptor(), "cloths"));
  appendVarint(content, cloth.size());
  return upload(*stubOf(target), content + cloth);
}

std::string randomBytes(const Target& target) {
  std::uint32_t state = 1;
  std::uint64_t connections = 0;
  repeat(target, [&] {
    const int file = connectTo(connections++ % 2 == 0 ? target.grpc : target.web);
    std::string bytes(4096, ' ');
    for (char& byte : bytes) byte = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
    ::send(file, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    ::close(file);
  });
  return fmt::format("{} connections", connections);
}

// ---- floods

std::string floodChanges(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < kFlooders; ++i) joined.push_back(std::make_unique<Joined>(*stub, ""));
  const std::uint64_t sent = flood(target, [&](int i) {
    v1::ClientMessage change;
    change.mutable_parameter_change()->mutable_wind()->mutable_value()->set_x(0.01f);
    if (!joined[i]->send(change)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  const auto open = std::ranges::count_if(joined, [](const auto& each) { return each->open(); });
  return fmt::format("{} changes sent; {} of {} streams stay open", sent, open, joined.size());
}

std::string floodPauses(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  bool paused = false;
  repeat(target, [&] {
    grpc::ClientContext context;
    v1::ControlSceneRequest request;
    request.set_name("flag");
    request.set_paused(paused = !paused);
    v1::ControlSceneResponse response;
    answers.add(stub->ControlScene(&context, request, &response));
  });
  return answers.text();
}

std::string floodPoses(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < kFlooders; ++i) joined.push_back(std::make_unique<Joined>(*stub, "flag"));
  v1::ClientMessage poses;
  for (std::uint32_t id = 1; id <= 60; ++id) {
    v1::ParticipantCollider& pose = *poses.mutable_collider_poses()->add_colliders();
    pose.set_id(id);
    pose.mutable_pose()->mutable_position()->set_y(0.01f * static_cast<float>(id));
    pose.mutable_pose()->mutable_orientation()->set_w(1);
    pose.mutable_sphere()->set_radius(0.05f);
  }
  const std::uint64_t sent = flood(target, [&](int i) {
    if (!joined[i]->send(poses)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  return fmt::format("{} messages of 60 colliders sent", sent);
}

std::string floodGetScene(const Target& target) {
  std::vector<std::unique_ptr<Stub>> stubs;
  std::vector<Answers> answers(kFlooders);
  for (int i = 0; i < kFlooders; ++i) stubs.push_back(stubOf(target));
  flood(target, [&](int i) {
    grpc::ClientContext context;
    v1::GetSceneRequest request;
    request.set_name("tablecloth");
    v1::GetSceneResponse response;
    answers[i].add(stubs[i]->GetScene(&context, request, &response));
  });
  return "each of 8: " + answers[0].text();
}

std::string floodRecordings(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  int number = 0;
  repeat(target, [&] {
    grpc::ClientContext start, stop;
    v1::StartRecordingRequest request;
    request.set_name(fmt::format("r{}", ++number));
    v1::StartRecordingResponse response;
    answers.add(stub->StartRecording(&start, request, &response));
    v1::StopRecordingRequest end;
    v1::StopRecordingResponse ended;
    stub->StopRecording(&stop, end, &ended);
  });
  return answers.text();
}

// ---- connections

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
  return "30 streams that nobody reads";
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
  constexpr std::uint32_t kPieces = 1000;
  const std::string first(kPieceBytes, '\xff');
  std::string answer = floodWithoutHello(
      target, 30,
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

// Changes of parameters while other participants of the scene do not read.
std::string changeForUnreading(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> readers, silent;
  for (int i = 0; i < kFlooders; ++i) readers.push_back(std::make_unique<Joined>(*stub, ""));
  for (int i = 0; i < kFlooders; ++i) silent.push_back(std::make_unique<Joined>(*stub, "", false));
  const std::uint64_t sent = flood(target, [&](int i) {
    readers[i]->send(windOf(0.01f));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  const auto open = std::ranges::count_if(readers, [](const auto& each) { return each->open(); });
  return fmt::format("{} changes sent; {} of {} streams that read stay open", sent, open, readers.size());
}

// Colliders of many participants in the victim's own scene.
std::string fillWithColliders(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < 40; ++i) joined.push_back(std::make_unique<Joined>(*stub, "flag"));
  v1::ClientMessage poses;
  for (std::uint32_t id = 1; id <= 60; ++id) {
    v1::ParticipantCollider& pose = *poses.mutable_collider_poses()->add_colliders();
    pose.set_id(id);
    pose.mutable_pose()->mutable_position()->set_y(0.01f * static_cast<float>(id));
    pose.mutable_pose()->mutable_orientation()->set_w(1);
    pose.mutable_sphere()->set_radius(0.05f);
  }
  repeat(target, [&] {
    for (const auto& each : joined) each->send(poses);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  });
  std::string error;
  for (const auto& each : joined)
    if (error.empty()) error = each->lastError();
  return error.empty() ? "accepted" : "refused: " + brief(error);
}

// Lines of the log: each join and each end of a stream is one.
std::string floodLog(const Target& target) {
  std::vector<std::unique_ptr<Stub>> stubs;
  for (int i = 0; i < kFlooders; ++i) stubs.push_back(stubOf(target));
  const std::uint64_t joins = flood(target, [&](int i) { const Joined joined(*stubs[i], "flag"); });
  return fmt::format("{} joins", joins);
}

// ---- TLS

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

// ----

std::string rebinding(const Target& target) {
  const int file = connectTo(target.web);
  const std::string request =
      "GET /stream HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://evil.example\r\nUpgrade: websocket\r\n"
      "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
      "dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  ::send(file, request.data(), request.size(), MSG_NOSIGNAL);
  std::string answer(200, '\0');
  const ssize_t got = ::recv(file, answer.data(), answer.size(), 0);
  ::close(file);
  answer.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  return answer.substr(0, answer.find('\r'));
}

// A token of the right key name, algorithm and claims, whose signature is wrong: the most expensive refusal.
std::string forgedToken() {
  const std::string header = "eyJhbGciOiJFUzI1NiIsImtpZCI6ImF0dGFjayIsInR5cCI6IkpXVCJ9";
  const std::string claims =
      "eyJhdWQiOiJjbG90aHN0cmVhbSIsImV4cCI6NDEwMjQ0NDgwMCwicm9sZSI6Im93bmVyIiwic3ViIjoiZXZlIn0";
  const std::string signature =
      "AQIDBAUGBwgJCgsMDQ4PEBESExQVFhcYGRobHB0eHyAhIiMkJSYnKCkqKywtLi8wMTIzNDU2Nzg5Ojs8PT4_QA";
  return header + '.' + claims + '.' + signature;
}

std::string wrongTokens(const Target& target) {
  const std::array<std::string, 3> tokens{forgedToken(), std::string(4000, 'A'), "eyJhbGciOiJub25lIn0.e30."};
  std::array<std::unique_ptr<Stub>, kFlooders> stubs;
  for (auto& stub : stubs) stub = stubOf(target);
  std::mutex mutex;
  Answers answers;
  std::atomic<std::size_t> next = 0;
  flood(target, [&](int i) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + tokens[next++ % tokens.size()]);
    v1::ListScenesResponse response;
    const grpc::Status status = stubs[static_cast<std::size_t>(i)]->ListScenes(&context, {}, &response);
    const std::lock_guard lock(mutex);
    answers.add(status);
  });
  // The same in streams.
  const auto end = Clock::now() + target.time;
  for (std::size_t i = 0; Clock::now() < end; ++i) {
    grpc::ClientContext context;
    const auto stream = stubs[i % stubs.size()]->Join(&context);
    v1::ClientMessage message;
    message.mutable_authenticate()->set_token(tokens[i % tokens.size()]);
    stream->Write(message);
    v1::ServerMessage answer;
    while (stream->Read(&answer)) {
    }
    answers.add(stream->Finish());
  }
  return answers.text();
}

std::string wrongCodes(const Target& target) {
  std::array<std::unique_ptr<Stub>, kFlooders> stubs;
  for (auto& stub : stubs) stub = stubOf(target);
  std::mutex mutex;
  Answers answers;
  std::atomic<int> next = 0;
  flood(target, [&](int i) {
    grpc::ClientContext context;
    v1::AuthenticateRequest request;
    request.set_pairing_code(fmt::format("{:06}", next++ % 1'000'000));
    v1::AuthenticateResponse response;
    const grpc::Status status =
        stubs[static_cast<std::size_t>(i)]->Authenticate(&context, request, &response);
    const std::lock_guard lock(mutex);
    answers.add(status);
  });
  return answers.text();
}

constexpr Attack kAttacks[] = {
    {"huge_solve", "create 512x512 constraints with 10,000 iterations and 64 substeps", &createHugeSolve},
    {"huge_grid", "create 4,096x4,096 nodes", &createHugeGrid},
    {"raise_iterations", "raise the iterations of a scene with 1,024 nodes to 10,000", &raiseIterations},
    {"fill_budget", "create and join as many scenes as the budget allows", &fillBudget},
    {"create_and_delete", "create and delete a scene without end", &createAndDelete},
    {"dense_vertices", "upload 65,536 vertices with a tiny weld distance", &uploadDenseVertices},
    {"fan", "upload 100,000 triangles around one vertex", &uploadFan},
    {"empty_pins", "upload 100 MB of empty pins", &uploadEmptyPins},
    {"random_bytes", "send random bytes to both ports", &randomBytes},
    {"parameter_changes", "send parameter changes from eight streams without end", &floodChanges},
    {"pauses", "pause and resume another scene without end", &floodPauses},
    {"poses", "send 60 colliders from eight streams without end", &floodPoses},
    {"get_scene", "ask for a scene from eight connections without end", &floodGetScene},
    {"recordings", "start and stop recordings of the victim's scene without end", &floodRecordings,
     "--recordings DIRECTORY"},
    {"idle_grpc", "hold 3,000 silent connections to gRPC", &idleGrpc},
    {"idle_web", "hold 3,000 silent connections to the page", &idleWeb},
    {"half_requests", "hold 1,000 requests that never end", &halfRequests},
    {"slow_readers", "join the victim's scene 30 times and read nothing", &slowReaders},
    {"pings_without_hello", "hold 30 streams open with pings and without hello", &pingWithoutHello,
     "--hello-timeout 2"},
    {"slow_uploads", "begin 30 uploads and continue them a byte at a time", &uploadSlowly,
     "--max-upload-memory 2 --min-upload-rate 1000 --max-upload-time 3"},
    {"unread_changes", "change parameters of the victim's scene next to participants that do not read",
     &changeForUnreading},
    {"colliders", "join a scene with 40 participants of 60 colliders", &fillWithColliders},
    {"log_flood", "join and leave without end, with a log", &floodLog, "--log-level info --log-rate 50"},
    {"half_handshakes", "hold 2,000 TLS handshakes that never end", &halfHandshakes,
     "--tls self --state-dir DIRECTORY"},
    {"handshakes", "complete TLS handshakes without end", &floodHandshakes,
     "--tls self --state-dir DIRECTORY"},
    {"dns_rebinding", "open a WebSocket as a page of another name", &rebinding},
    {"wrong_tokens", "send forged tokens in calls and streams without end", &wrongTokens, "", Access::tokens},
    {"wrong_codes", "guess pairing codes without end", &wrongCodes, "", Access::pairing},
};

}  // namespace

std::span<const Attack> attacks() {
  return kAttacks;
}

}  // namespace clothstream::attack

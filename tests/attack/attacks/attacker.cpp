// SPDX-License-Identifier: MIT
#include "tests/attack/attacks/attacker.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "clients/grpc/channel.h"

namespace clothstream::attack {
namespace {

// Stays below the server's rate of messages.
constexpr std::chrono::milliseconds kPiecePause{5};

}  // namespace

std::unique_ptr<Stub> stubOf(const Target& target) {
  return v1::ClothStream::NewStub(makeChannel(target.grpc));
}

std::uint64_t repeat(const Target& target, const std::function<void()>& call) {
  std::uint64_t calls = 0;
  for (const auto end = Clock::now() + target.time; Clock::now() < end; ++calls) call();
  return calls;
}

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
  for (const std::uint32_t codec : {1u, 2u}) message.mutable_hello()->add_codecs(codec);
  return message;
}

v1::ClientMessage windOf(float x) {
  v1::ClientMessage change;
  change.mutable_parameter_change()->mutable_wind()->mutable_value()->set_x(x);
  return change;
}

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

std::span<const Attack> attacks() {
  static const std::vector<Attack> all = [] {
    std::vector<Attack> attacks;
    for (const auto part : {workAttacks(), contentAttacks(), messageAttacks(), connectionAttacks(),
                            identityAttacks(), handAttacks(), clientAttacks(), endpointAttacks(),
                            hiddenCostAttacks(), datagramAttacks(), clothesAttacks()})
      attacks.insert(attacks.end(), part.begin(), part.end());
    return attacks;
  }();
  return all;
}

}  // namespace clothstream::attack

// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include <fmt/format.h>
#include <grpcpp/client_context.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

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

// More scenes than a tenant may have, with an honest token.
std::string fillTenant(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  for (int i = 0; i < 24; ++i) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + target.token);
    v1::CreateSceneRequest request;
    *request.mutable_scene() = sheet(fmt::format("tenant_{}", i), 4, 1);
    v1::CreateSceneResponse response;
    answers.add(stub->CreateScene(&context, request, &response));
  }
  return answers.text();
}

constexpr Attack kAttacksIdentity[] = {
    {"dns_rebinding", "open a WebSocket as a page of another name", &rebinding, "HTTP/1\\.1 421 .*"},
    {"wrong_tokens", "send forged tokens in calls and streams without end", &wrongTokens,
     "[0-9]+ refused with code (16|8)(, [0-9]+ refused with code (16|8))*", "", Access::tokens},
    {"tenant", "create 24 scenes with a token of one tenant, which may have 8", &fillTenant,
     "8 accepted, 16 refused with code 8",
     "--participants-may create --max-scenes-per-tenant 8 --max-created-scenes 100", Access::tokens},
    {"wrong_codes", "guess pairing codes without end", &wrongCodes,
     "[0-9]+ refused with code (16|8)(, [0-9]+ refused with code (16|8))*", "", Access::pairing},
};

}  // namespace

std::span<const Attack> identityAttacks() {
  return kAttacksIdentity;
}

}  // namespace clothstream::attack

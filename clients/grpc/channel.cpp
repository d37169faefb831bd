// SPDX-License-Identifier: MIT
// Channel arguments and texts of failures.
#include "clients/grpc/channel.h"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

namespace clothstream {
namespace {

// Enough for a key frame of the largest scene. A description travels in small chunks.
constexpr int kMaxMessageBytes = 256 * 1024 * 1024;

std::string inBrackets(const std::string& text) {
  return text.empty() ? text : fmt::format(" ({})", text);
}

}  // namespace

std::shared_ptr<grpc::Channel> makeChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  // A separate connection per client, so that two clients of a process do not share flow control.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

Failure notJoined(const std::string& address, const grpc::Status& status) {
  using Kind = Failure::Kind;
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return {Kind::unreachable,
              fmt::format("No server answers at {}: is clothstream-server running there?{}", address,
                          inBrackets(status.error_message()))};
    case grpc::StatusCode::OK:
      return {Kind::refused, fmt::format("The server at {} ended the stream before it began.", address)};
    case grpc::StatusCode::UNIMPLEMENTED:
      return {Kind::refused, fmt::format("The server at {} is not a clothstream-server of this release{}.",
                                         address, inBrackets(status.error_message()))};
    default:
      return {Kind::refused, fmt::format("The server at {} refuses: {}", address, status.error_message())};
  }
}

Failure lost(const std::string& address, const grpc::Status& status) {
  if (status.ok()) return {Failure::Kind::lost, fmt::format("The server at {} ended the stream.", address)};
  return {Failure::Kind::lost,
          fmt::format("The stream from {} is lost{}.", address, inBrackets(status.error_message()))};
}

}  // namespace clothstream

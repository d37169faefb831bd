// SPDX-License-Identifier: MIT
// Channels to a server, and failures from gRPC statuses.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/status.h>
#include <tl/expected.hpp>

#include "clients/native/address.h"
#include "clients/native/failure.h"
#include "clothstream/v1/session.grpc.pb.h"

namespace clothstream {

// Longest time of a unary call.
inline constexpr std::chrono::seconds kCallTimeout{10};

// How a server proves who it is. Throws std::runtime_error if the file of authorities cannot be read.
std::shared_ptr<grpc::ChannelCredentials> credentialsOf(const ServerAddress& server);
std::shared_ptr<grpc::Channel> makeChannel(const ServerAddress& server,
                                           const std::shared_ptr<grpc::ChannelCredentials>& credentials);
// The same with credentialsOf(server).
std::shared_ptr<grpc::Channel> makeChannel(const ServerAddress& server);

// Adds the server's token, if any, to a call.
void authorize(grpc::ClientContext& call, const ServerAddress& server);

// Fingerprint of the key that the server at an https:// address shows, or empty if makeChannel() trusts the
// server already. Sends nothing but handshakes. Takes at most 20 s.
[[nodiscard]] tl::expected<std::string, Failure> unknownKeyOf(const ServerAddress& server);

// Failure of a call that ended before any message arrived.
Failure notJoined(const ServerAddress& server, const grpc::Status& status);
// Makes a unary call on a separate connection, such as callServer<v1::ListBansResponse>(address, request,
// &v1::ClothStream::Stub::ListBans).
template <typename Response, typename Request, typename Method>
[[nodiscard]] tl::expected<Response, Failure> callServer(const ServerAddress& server, const Request& request,
                                                         const Method& method,
                                                         std::chrono::milliseconds timeout = kCallTimeout) {
  const auto stub = v1::ClothStream::NewStub(makeChannel(server));
  grpc::ClientContext context;
  authorize(context, server);
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  Response response;
  const grpc::Status status = (*stub.*method)(&context, request, &response);
  if (!status.ok()) return tl::unexpected(notJoined(server, status));
  return response;
}

// Address in a URI of grpc::ClientContext::peer(), such as ipv4:192.0.2.1:50051 or ipv6:%5B::1%5D:50051,
// where the brackets may also be plain. Empty for other URIs.
std::string addressIn(std::string_view peer);

// Failure of a stream that ended although the client had not left.
Failure lost(const ServerAddress& server, const grpc::Status& status);

}  // namespace clothstream

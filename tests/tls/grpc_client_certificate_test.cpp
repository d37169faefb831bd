// SPDX-License-Identifier: MIT
// The gRPC endpoint with an authority of client certificates.
#include <memory>
#include <string>

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "server/endpoint/grpc/grpc_endpoint.h"
#include "server/tls/server_tls.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/small_server.h"
#include "tests/tls/client_certificate.h"

namespace clothstream::tests {
namespace {

using GrpcClientCertificate = SmallServer;

TEST_F(GrpcClientCertificate, RefusesOnlyCertificatesOfOtherAuthorities) {
  const e2e::TemporaryDirectory directory;
  const tls::Certificate known = makeClientCertificate();
  const auto tls = std::make_shared<tls::ServerTls>(
      [&] { return tls::selfSigned(directory.path(), {"localhost"}); }, known.chain);
  const endpoint::GrpcEndpoint endpoint(server(), {.port = 0, .tls = tls});
  const auto list = [&](const tls::Certificate& client) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetSslTargetNameOverride("localhost");
    const auto channel = grpc::CreateCustomChannel(
        "127.0.0.1:" + std::to_string(endpoint.port()),
        grpc::SslCredentials({.pem_root_certs = tls::selfSigned(directory.path(), {"localhost"}).chain,
                              .pem_private_key = client.key,
                              .pem_cert_chain = client.chain}),
        arguments);
    grpc::ClientContext call;
    call.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    v1::ListScenesResponse response;
    return v1::ClothStream::NewStub(channel)->ListScenes(&call, {}, &response);
  };
  EXPECT_EQ(list({}).error_code(), grpc::StatusCode::OK);
  EXPECT_EQ(list(known).error_code(), grpc::StatusCode::OK);
  EXPECT_EQ(list(makeClientCertificate()).error_code(), grpc::StatusCode::UNAVAILABLE);
}

}  // namespace
}  // namespace clothstream::tests

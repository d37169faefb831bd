// SPDX-License-Identifier: MIT
// Tokens in the metadata of gRPC calls, and pairing by a call.
#include <chrono>
#include <map>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "server/endpoint/grpc/grpc_endpoint.h"
#include "server/hosting/scene_server.h"
#include "server/identity/authenticator.h"
#include "server/identity/token.h"
#include "tests/endpoint/rpc_client.h"
#include "tests/endpoint/small_server.h"
#include "tests/identity/key_directory.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;

class GrpcIdentity : public SmallServer {
 protected:
  hosting::ServerOptions options() override {
    hosting::ServerOptions options;
    authenticator_ = std::make_shared<identity::Authenticator>(identity::AuthenticatorOptions{
        .keyDirectory = keys_.path(), .pairing = true, .stateDirectory = state_.path()});
    options.authenticator = authenticator_;
    return options;
  }
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    endpoint_ = std::make_unique<endpoint::GrpcEndpoint>(server(), endpoint::GrpcEndpointOptions{.port = 0});
    stub_ = v1::ClothStream::NewStub(channelTo(endpoint_->port()));
  }
  void TearDown() override {
    endpoint_.reset();
    SmallServer::TearDown();
  }

  std::string token(scene::Role role) const {
    return sign(key_, {.role = role,
                       .scene = {},
                       .name = {},
                       .subject = "ada",
                       .tenant = {},
                       .audience = "clothstream",
                       .expires = identity::WallClock::now() + std::chrono::hours(1),
                       .notBefore = {}});
  }
  static void authorize(grpc::ClientContext& call, const std::string& value) {
    call.AddMetadata("authorization", value);
  }
  // Status of ListScenes with this value of `authorization`; empty: none.
  grpc::Status list(const std::string& value) const {
    grpc::ClientContext call;
    if (!value.empty()) authorize(call, value);
    v1::ListScenesResponse response;
    return stub_->ListScenes(&call, {}, &response);
  }
  grpc::Status pause(const std::string& value) const {
    grpc::ClientContext call;
    authorize(call, value);
    v1::ControlSceneRequest request;
    request.set_paused(true);
    v1::ControlSceneResponse response;
    return stub_->ControlScene(&call, request, &response);
  }

  const KeyDirectory keys_, state_;
  const identity::TokenKey key_ = keys_.make("test.pem");
  std::shared_ptr<identity::Authenticator> authenticator_;
  std::unique_ptr<endpoint::GrpcEndpoint> endpoint_;
  std::unique_ptr<v1::ClothStream::Stub> stub_;
};

TEST_F(GrpcIdentity, CallsNeedAToken) {
  for (const std::string& value : {std::string(), std::string("Bearer "), std::string("Bearer x"),
                                   token(scene::Role::owner), "Basic " + token(scene::Role::owner)}) {
    const grpc::Status status = list(value);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_THAT(status.error_message(), HasSubstr("token"));
  }
  EXPECT_TRUE(list("Bearer " + token(scene::Role::viewer)).ok());
}

// Status of a call without a token.
template <typename Request, typename Response>
grpc::StatusCode codeOf(v1::ClothStream::Stub& stub,
                        grpc::Status (v1::ClothStream::Stub::*call)(grpc::ClientContext*, const Request&,
                                                                    Response*)) {
  grpc::ClientContext context;
  Response response;
  return (stub.*call)(&context, {}, &response).error_code();
}

TEST_F(GrpcIdentity, EveryCallNeedsAToken) {
  using Stub = v1::ClothStream::Stub;
  const std::map<std::string, grpc::StatusCode> codes{
      {"ListScenes", codeOf(*stub_, &Stub::ListScenes)},
      {"GetScene", codeOf(*stub_, &Stub::GetScene)},
      {"CreateScene", codeOf(*stub_, &Stub::CreateScene)},
      {"DeleteScene", codeOf(*stub_, &Stub::DeleteScene)},
      {"ControlScene", codeOf(*stub_, &Stub::ControlScene)},
      {"StartRecording", codeOf(*stub_, &Stub::StartRecording)},
      {"StopRecording", codeOf(*stub_, &Stub::StopRecording)},
      {"Authenticate", codeOf(*stub_, &Stub::Authenticate)},
      {"CreatePairingCode", codeOf(*stub_, &Stub::CreatePairingCode)},
      {"ListBans", codeOf(*stub_, &Stub::ListBans)},
      {"LiftBan", codeOf(*stub_, &Stub::LiftBan)}};
  for (const auto& [name, code] : codes) EXPECT_EQ(code, grpc::StatusCode::UNAUTHENTICATED) << name;
  const auto* const service = v1::ClientMessage::descriptor()->file()->FindServiceByName("ClothStream");
  for (int i = 0; i < service->method_count(); ++i) {
    const std::string name(service->method(i)->name());
    EXPECT_TRUE(name == "Join" || codes.contains(name)) << name;
  }
}

TEST_F(GrpcIdentity, RoleOfTheTokenDecidesOutsideOfScenes) {
  EXPECT_EQ(pause("Bearer " + token(scene::Role::participant)).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(pause("Bearer " + token(scene::Role::owner)).ok());
}

TEST_F(GrpcIdentity, StreamNeedsATokenInMetadataOrMessage) {
  const auto firstMessage = [&](const std::string& value) {
    grpc::ClientContext call;
    if (!value.empty()) authorize(call, value);
    const auto stream = stub_->Join(&call);
    v1::ClientMessage message;
    message.mutable_list_scenes();
    stream->Write(message);
    v1::ServerMessage answer;
    stream->Read(&answer);
    const bool answered = answer.has_list_scenes();
    if (answered) stream->WritesDone();
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), answered ? grpc::StatusCode::OK : grpc::StatusCode::UNAUTHENTICATED);
    return answer;
  };
  EXPECT_EQ(firstMessage("").error().code(), v1::ERROR_CODE_UNAUTHENTICATED);
  EXPECT_EQ(firstMessage("Bearer x").error().code(), v1::ERROR_CODE_UNAUTHENTICATED);
  EXPECT_TRUE(firstMessage("Bearer " + token(scene::Role::viewer)).has_list_scenes());
}

TEST_F(GrpcIdentity, PairsWithoutAToken) {
  const auto pair = [&](const std::string& code, v1::AuthenticateResponse& response) {
    grpc::ClientContext call;
    v1::AuthenticateRequest request;
    request.set_pairing_code(code);
    return stub_->Authenticate(&call, request, &response);
  };
  const std::string code = authenticator_->makeCode(scene::Role::owner, identity::Clock::now())->code;
  v1::AuthenticateResponse response;
  EXPECT_EQ(pair(code == "000000" ? "000001" : "000000", response).error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
  ASSERT_TRUE(pair(code, response).ok());
  EXPECT_TRUE(pause("Bearer " + response.token()).ok());

  grpc::ClientContext call;
  authorize(call, "Bearer " + response.token());
  v1::CreatePairingCodeResponse made;
  ASSERT_TRUE(stub_->CreatePairingCode(&call, {}, &made).ok());
  EXPECT_THAT(made.code(), testing::MatchesRegex("[0-9]{6}"));
  v1::AuthenticateResponse guest;
  ASSERT_TRUE(pair(made.code(), guest).ok());
  EXPECT_EQ(guest.role(), v1::ROLE_PARTICIPANT);
}

TEST_F(GrpcIdentity, ListsAndLiftsBans) {
  server().scenes.find("small")->roster.setBans(
      {{.subject = {.tenant = "studio", .name = "eve"}, .displayName = "Eve"}});
  const auto lift = [&](scene::Role role) {
    grpc::ClientContext call;
    authorize(call, "Bearer " + token(role));
    v1::LiftBanRequest request;
    request.set_subject("eve");
    v1::LiftBanResponse response;
    return stub_->LiftBan(&call, request, &response);
  };
  grpc::ClientContext call;
  authorize(call, "Bearer " + token(scene::Role::owner));
  v1::ListBansResponse bans;
  ASSERT_TRUE(stub_->ListBans(&call, {}, &bans).ok());
  ASSERT_EQ(bans.bans_size(), 1);
  EXPECT_EQ(bans.bans(0).subject(), "eve");
  EXPECT_EQ(bans.bans(0).tenant(), "studio");
  EXPECT_EQ(lift(scene::Role::participant).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(lift(scene::Role::owner).ok());
  EXPECT_EQ(lift(scene::Role::owner).error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace clothstream::tests

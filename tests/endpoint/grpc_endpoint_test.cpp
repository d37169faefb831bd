// SPDX-License-Identifier: MIT
// The gRPC endpoint, with clients good and bad.
#include "server/endpoint/grpc/grpc_endpoint.h"

#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <grpcpp/support/async_unary_call.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "grpc/health/v1/health.pb.h"
#include "tests/endpoint/rpc_client.h"
#include "tests/endpoint/small_server.h"

namespace clothstream::tests {
namespace {

using namespace std::chrono_literals;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;

class GrpcEndpointTest : public EndpointTest {
 protected:
  void SetUp() override {
    EndpointTest::SetUp();
    if (!IsSkipped()) open({});
  }
  void TearDown() override {
    endpoint.reset();
    EndpointTest::TearDown();
  }
  void open(endpoint::GrpcEndpointOptions options) {
    endpoint.reset();
    options.port = 0;
    endpoint = std::make_unique<endpoint::GrpcEndpoint>(server(), options);
  }
  std::uint16_t port() const { return endpoint->port(); }

  std::unique_ptr<endpoint::GrpcEndpoint> endpoint;
};

// A client that joined, and what it saw.
struct Joined {
  explicit Joined(std::uint16_t port, const std::string& scene = "") : stream(port) {
    stream.send(hello(scene));
    see(1);
  }
  // Sees `count` frames more; false when the server ends the stream before.
  bool see(std::uint64_t count) {
    const std::uint64_t target = viewer.frames + count;
    return stream.watch(viewer, [&] { return viewer.frames >= target; });
  }
  bool seeUntil(const std::function<bool()>& done) { return stream.watch(viewer, done); }
  // Sees all that comes, until the server ends the stream.
  grpc::Status seeTheEnd() {
    seeUntil([] { return false; });
    return stream.finish();
  }

  RpcStream stream;
  Viewer viewer;
};

TEST_F(GrpcEndpointTest, ListsScenes) {
  grpc::ClientContext context;
  v1::ListScenesResponse response;
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  ASSERT_TRUE(stub->ListScenes(&context, {}, &response).ok());
  std::vector<std::string> names;
  for (const v1::SceneSummary& scene : response.scenes()) names.push_back(scene.name());
  EXPECT_THAT(names, testing::UnorderedElementsAre("small", "other", "large"));
}

TEST_F(GrpcEndpointTest, GetsASceneAndRefusesAnUnknownOne) {
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  v1::GetSceneRequest request;
  v1::GetSceneResponse response;
  request.set_name("other");
  grpc::ClientContext known;
  ASSERT_TRUE(stub->GetScene(&known, request, &response).ok());
  EXPECT_EQ(response.scene().name(), "other");
  EXPECT_EQ(response.scene().cloths(0).grid().rows(), 8U);
  request.set_name("nowhere");
  grpc::ClientContext unknown;
  const grpc::Status status = stub->GetScene(&unknown, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("nowhere"));
}

// A scene as `other` is, without a name of its own.
v1::CreateSceneRequest likeOther(v1::ClothStream::Stub& stub) {
  v1::GetSceneRequest get;
  get.set_name("other");
  v1::GetSceneResponse other;
  grpc::ClientContext getting;
  EXPECT_TRUE(stub.GetScene(&getting, get, &other).ok());
  v1::CreateSceneRequest request;
  *request.mutable_scene() = other.scene();
  return request;
}

TEST_F(GrpcEndpointTest, CreatesASceneAndRefusesWhatIsWrongWithIt) {
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  v1::CreateSceneRequest request = likeOther(*stub);
  request.set_name("another");
  v1::CreateSceneResponse response;
  grpc::ClientContext creating;
  ASSERT_TRUE(stub->CreateScene(&creating, request, &response).ok());
  EXPECT_EQ(response.scene().name(), "another");
  EXPECT_TRUE(response.scene().created());
  request.mutable_scene()->set_substeps(0);
  grpc::ClientContext wrong;
  const grpc::Status status = stub->CreateScene(&wrong, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("substeps = 0"));
  request.set_uploaded_content_id(1);
  grpc::ClientContext nothing;
  EXPECT_EQ(stub->CreateScene(&nothing, request, &response).error_code(), grpc::StatusCode::NOT_FOUND);
  v1::DeleteSceneRequest deletion;
  deletion.set_name("another");
  v1::DeleteSceneResponse deleted;
  grpc::ClientContext deleting;
  EXPECT_TRUE(stub->DeleteScene(&deleting, deletion, &deleted).ok());
}

TEST_F(GrpcEndpointTest, WhoAsksForScenesWhileTheEndpointClosesIsAnswered) {
  constexpr std::size_t kCalls = 40;
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::CreateSceneResponse>> reader;
    v1::CreateSceneResponse response;
    grpc::Status status;
  };
  grpc::CompletionQueue queue;
  std::vector<Call> calls(kCalls);
  v1::CreateSceneRequest request = likeOther(*stub);
  for (Call& call : calls) {
    request.set_name(fmt::format("made-{}", &call - calls.data()));
    call.reader = stub->AsyncCreateScene(&call.context, request, &queue);
    call.reader->Finish(&call.response, &call.status, &call);
  }
  void* tag = nullptr;
  bool ok = false;
  const auto nextIsAnswered = [&] {
    return queue.AsyncNext(&tag, &ok, std::chrono::system_clock::now() + 10s) ==
           grpc::CompletionQueue::GOT_EVENT;
  };
  ASSERT_TRUE(nextIsAnswered());
  EXPECT_TRUE(static_cast<Call*>(tag)->status.ok());
  endpoint.reset();
  for (std::size_t i = 1; i < kCalls; ++i) ASSERT_TRUE(nextIsAnswered()) << i;
  for (const Call& call : calls)
    EXPECT_THAT(call.status.error_code(), AnyOf(grpc::StatusCode::OK, grpc::StatusCode::UNAVAILABLE));
}

TEST_F(GrpcEndpointTest, JoinsAndDecodesFrames) {
  Joined client(port());
  EXPECT_EQ(client.viewer.welcome.scene(), "small");
  EXPECT_EQ(client.viewer.description.cloths(0).vertex_count(), 64U);
  const std::uint64_t first = client.viewer.tick();
  EXPECT_TRUE(client.see(10));
  EXPECT_GE(client.viewer.tick(), first + 10);
  EXPECT_TRUE(client.viewer.errors.empty());
}

using grpc::health::v1::HealthCheckResponse;

std::string healthRequest(const std::string& service) {
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  return request.SerializeAsString();
}

// The next answer of a stream about health; UNKNOWN where there is none.
HealthCheckResponse::ServingStatus nextStatus(RpcStream& call) {
  HealthCheckResponse response;
  const std::optional<std::string> message = call.receive();
  return message && response.ParseFromString(*message) ? response.status() : HealthCheckResponse::UNKNOWN;
}

TEST_F(GrpcEndpointTest, IsHealthy) {
  for (const char* service : {"", "clothstream.v1.ClothStream"}) {
    RpcStream call(port(), {.method = "/grpc.health.v1.Health/Check"});
    ASSERT_TRUE(call.send(healthRequest(service)));
    call.sendDone();
    EXPECT_EQ(nextStatus(call), HealthCheckResponse::SERVING) << service;
    EXPECT_TRUE(call.finish().ok());
  }
}

TEST_F(GrpcEndpointTest, TheHealthOfAnotherServiceIsNotFound) {
  RpcStream call(port(), {.method = "/grpc.health.v1.Health/Check"});
  ASSERT_TRUE(call.send(healthRequest("some.Other")));
  call.sendDone();
  EXPECT_EQ(call.receive(), std::nullopt);
  const grpc::Status status = call.finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("some.Other"));
}

TEST_F(GrpcEndpointTest, WhoWatchesItsHealthHearsThatTheEndpointCloses) {
  RpcStream call(port(), {.method = "/grpc.health.v1.Health/Watch"});
  RpcStream other(port(), {.method = "/grpc.health.v1.Health/Watch"});
  ASSERT_TRUE(call.send(healthRequest("clothstream.v1.ClothStream")));
  ASSERT_TRUE(other.send(healthRequest("some.Other")));
  call.sendDone();
  other.sendDone();
  EXPECT_EQ(nextStatus(call), HealthCheckResponse::SERVING);
  EXPECT_EQ(nextStatus(other), HealthCheckResponse::SERVICE_UNKNOWN);
  endpoint.reset();
  EXPECT_EQ(nextStatus(call), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(GrpcEndpointTest, ListsItsServicesByReflection) {
  RpcStream call(port(), {.method = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"});
  ASSERT_TRUE(call.send(std::string("\x3a\x01*")));  // ServerReflectionRequest { string list_services = 7; }
  const std::optional<std::string> answer = call.receive();
  ASSERT_TRUE(answer.has_value());
  EXPECT_THAT(*answer, HasSubstr("clothstream.v1.ClothStream"));
}

TEST_F(GrpcEndpointTest, AnUnknownSceneEndsTheStreamWithNotFound) {
  RpcStream stream(port());
  stream.send(hello("nowhere"));
  Viewer viewer;
  EXPECT_FALSE(stream.watch(viewer, [] { return false; }));
  ASSERT_EQ(viewer.errors.size(), 1U) << "the error itself comes first";
  const grpc::Status status = stream.finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(status.error_message(), viewer.errors[0].text());
}

TEST_F(GrpcEndpointTest, AMessageBeforeHelloEndsTheStreamWithFailedPrecondition) {
  RpcStream stream(port());
  stream.send(colliderPose(0.25f));
  Viewer viewer;
  EXPECT_FALSE(stream.watch(viewer, [] { return false; }));
  EXPECT_EQ(stream.finish().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(GrpcEndpointTest, GarbageIsAnsweredByAnErrorToItsSenderAlone) {
  Joined other(port());
  Joined client(port());
  ASSERT_TRUE(client.stream.send(garbage(500)));
  EXPECT_TRUE(client.seeUntil([&] { return !client.viewer.errors.empty(); }));
  EXPECT_EQ(client.viewer.errors[0].code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
  EXPECT_TRUE(other.see(5));
  EXPECT_TRUE(other.viewer.errors.empty());
}

TEST_F(GrpcEndpointTest, GarbageThatGoesOnEndsTheStreamWithInvalidArgument) {
  Joined other(port());
  Joined client(port());
  for (int i = 0; i < 100 && client.stream.send(garbage(50)); ++i) {
  }
  EXPECT_EQ(client.seeTheEnd().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(other.see(5));
}

TEST_F(GrpcEndpointTest, AMessageOverTheLimitEndsTheStreamWithResourceExhausted) {
  Joined other(port());
  Joined client(port());
  client.stream.send(garbage(64 * 1024 + 1));
  EXPECT_EQ(client.seeTheEnd().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(other.see(5));
}

TEST_F(GrpcEndpointTest, CompressedMessagesAreRefused) {
  RpcStream stream(port(), {.compressed = true});
  stream.send(hello());
  EXPECT_EQ(stream.receive(), std::nullopt);
  EXPECT_EQ(stream.finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(GrpcEndpointTest, AClientsColliderIsSeenByOthersAndVanishesWithIt) {
  Joined watcher(port());
  auto leaver = std::make_unique<Joined>(port());
  const std::uint64_t id = leaver->viewer.welcome.participant_id();
  leaver->stream.send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  EXPECT_FLOAT_EQ(watcher.viewer.colliderOf(id)->position().x(), 0.25f);
  leaver->stream.cancel();
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

TEST_F(GrpcEndpointTest, AClientThatIsDoneLeavesWithOk) {
  Joined watcher(port());
  Joined leaver(port());
  const std::uint64_t id = leaver.viewer.welcome.participant_id();
  leaver.stream.send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  leaver.stream.sendDone();
  while (leaver.stream.receive()) {
  }
  EXPECT_TRUE(leaver.stream.finish().ok());
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

// While one client does not read, others see every frame; when it reads again, what waited for it is at most
// what it had left unacknowledged, and the next frame is a fresh one.
TEST_F(GrpcEndpointTest, AClientThatNeverReadsDelaysNobodyAndGetsFreshFramesAfterwards) {
  Joined other(port());
  Joined slow(port());
  const std::uint64_t stoppedAt = slow.viewer.tick();
  ASSERT_TRUE(other.seeUntil([&] { return other.viewer.tick() >= stoppedAt + 60; }));
  const std::uint64_t now = other.viewer.tick();
  std::uint64_t stale = 0;
  EXPECT_TRUE(slow.seeUntil([&] {
    if (slow.viewer.last.has_frame() && slow.viewer.tick() < now) ++stale;
    return slow.viewer.tick() >= now;
  }));
  EXPECT_LE(stale, 6U);  // two, and one more for each 33 ms of a round trip on a busy machine
  EXPECT_TRUE(slow.see(10));
}

// The write in flight to a client that does not read would last for ever.
TEST_F(GrpcEndpointTest, AnAbusiveClientThatDoesNotReadIsCutOff) {
  endpoint::GrpcEndpointOptions options;
  options.maxStreams = 2;
  open(options);
  RpcStream abusive(port(), {.smallWindow = true});
  abusive.send(hello("large"));
  ASSERT_TRUE(abusive.receive().has_value());
  Joined other(port());
  ASSERT_TRUE(other.see(10));  // by now the description is under way
  for (int i = 0; i < 100 && abusive.send(garbage(50)); ++i) {
  }
  grpc::Status status(grpc::StatusCode::RESOURCE_EXHAUSTED, "");
  const auto giveUp = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
         std::chrono::steady_clock::now() < giveUp) {
    RpcStream next(port());
    next.sendDone();
    next.receive();
    status = next.finish();
  }
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(other.see(5));
}

// A peer whose machine or network is gone does not answer pings, and its socket stays open.
TEST_F(GrpcEndpointTest, AConnectionThatDoesNotAnswerPingsIsClosedWithinFiveSeconds) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  // RFC 9113 3.4: the preface and an empty SETTINGS frame, so that the server takes it for a client.
  const std::string preface =
      std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n") + std::string("\0\0\0\4\0\0\0\0\0", 9);
  ASSERT_EQ(::send(socket, preface.data(), preface.size(), 0), static_cast<ssize_t>(preface.size()));
  const auto from = std::chrono::steady_clock::now();
  pollfd readable{socket, POLLIN, 0};
  char bytes[4096];
  ssize_t received = 1;
  while (received > 0 && ::poll(&readable, 1, 10'000) == 1) received = ::recv(socket, bytes, sizeof bytes, 0);
  EXPECT_LE(received, 0) << "still open";
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(5));
  ::close(socket);
}

TEST_F(GrpcEndpointTest, OneStreamMoreThanTheLimitIsToldSo) {
  endpoint::GrpcEndpointOptions options;
  options.maxStreams = 1;
  open(options);
  Joined first(port());
  RpcStream second(port());
  EXPECT_EQ(second.receive(), std::nullopt);
  EXPECT_EQ(second.finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(first.see(2));
}

TEST_F(GrpcEndpointTest, ManyClientsComeAndGo) {
  Joined watcher(port());
  for (int round = 0; round < 5; ++round) {
    std::vector<std::unique_ptr<Joined>> crowd;
    for (int i = 0; i < 5; ++i) crowd.push_back(std::make_unique<Joined>(port(), i % 2 ? "other" : ""));
  }
  EXPECT_TRUE(watcher.see(5));
  EXPECT_TRUE(watcher.viewer.errors.empty());
}

// What gRPC says of calls when the endpoint closes may come when their connections are gone.
TEST_F(GrpcEndpointTest, ClosesWhileManyComeAndGoAndSomeDoNotRead) {
  for (int round = 0; round < 5; ++round) {
    open({});
    std::vector<std::unique_ptr<RpcStream>> crowd;
    for (int i = 0; i < 12; ++i) {
      crowd.push_back(std::make_unique<RpcStream>(port(), RpcOptions{.smallWindow = i % 3 == 0}));
      crowd.back()->send(hello());
    }
    Joined reader(port());
    EXPECT_TRUE(reader.see(2));
    for (std::size_t i = 1; i < crowd.size(); i += 3) crowd[i]->cancel();
    endpoint.reset();
    EXPECT_EQ(reader.seeTheEnd().error_code(), grpc::StatusCode::UNAVAILABLE);
  }
}

TEST_F(GrpcEndpointTest, APortInUseSaysWhatToDo) {
  endpoint::GrpcEndpointOptions options;
  options.port = port();
  EXPECT_THAT([&] { endpoint::GrpcEndpoint(server(), options); },
              testing::ThrowsMessage<std::runtime_error>(
                  "port " + std::to_string(port()) +
                  " on 127.0.0.1 is already in use: choose another with --grpc-port"));
}

TEST_F(GrpcEndpointTest, AHostOfAnotherMachineIsNamed) {
  endpoint::GrpcEndpointOptions options;
  options.host = "192.0.2.1";  // RFC 5737: documentation, nobody's
  options.port = 0;
  EXPECT_THAT(
      [&] { endpoint::GrpcEndpoint(server(), options); },
      testing::ThrowsMessage<std::runtime_error>(HasSubstr("cannot listen on port 0 of 192.0.2.1: ")));
}

TEST_F(GrpcEndpointTest, ClosingTheEndpointEndsStreamsWithUnavailable) {
  Joined first(port()), second(port());
  endpoint.reset();
  EXPECT_EQ(first.seeTheEnd().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(second.seeTheEnd().error_code(), grpc::StatusCode::UNAVAILABLE);
}

// As a program does when it ends: what is to be said last is not lost to the endpoint that closes behind it.
TEST_F(GrpcEndpointTest, WhoIsThereWhenTheServerStopsAndTheEndpointClosesHearsOfIt) {
  std::vector<std::unique_ptr<Joined>> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(std::make_unique<Joined>(port()));
  server().stop();
  endpoint.reset();
  for (const auto& client : clients) {
    EXPECT_EQ(client->seeTheEnd().error_code(), grpc::StatusCode::UNAVAILABLE);
    ASSERT_FALSE(client->viewer.notices.empty());
    EXPECT_EQ(client->viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
  }
}

TEST_F(GrpcEndpointTest, ADeletedScenesStreamsEndWithNotFound) {
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  v1::CreateSceneRequest request;
  request.set_named("other");
  request.set_name("passing");
  v1::CreateSceneResponse created;
  grpc::ClientContext creating, deleting;
  ASSERT_TRUE(stub->CreateScene(&creating, request, &created).ok());
  Joined client(port(), "passing");
  v1::DeleteSceneRequest deletion;
  deletion.set_name("passing");
  v1::DeleteSceneResponse deleted;
  ASSERT_TRUE(stub->DeleteScene(&deleting, deletion, &deleted).ok());
  const grpc::Status status = client.seeTheEnd();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("'passing' was deleted"));
}

TEST_F(GrpcEndpointTest, StoppingTheServerSaysSoAndEndsStreamsWithUnavailable) {
  Joined client(port());
  server().stop();
  EXPECT_EQ(client.seeTheEnd().error_code(), grpc::StatusCode::UNAVAILABLE);
  ASSERT_FALSE(client.viewer.notices.empty());
  EXPECT_EQ(client.viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
}

}  // namespace
}  // namespace clothstream::tests

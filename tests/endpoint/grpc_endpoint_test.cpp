// SPDX-License-Identifier: MIT
// Tests of the gRPC endpoint only: unary calls, health checks, reflection, statuses.
#include "server/endpoint/grpc/grpc_endpoint.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/address_v4.hpp>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/descriptor_database.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/support/async_unary_call.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "grpc/health/v1/health.pb.h"
#include "grpc/reflection/v1alpha/reflection.pb.h"
#include "server/endpoint/grpc/answer_budget.h"
#include "server/endpoint/grpc/call_rate.h"
#include "server/endpoint/grpc/caller.h"
#include "server/hosting/scene_server.h"
#include "server/tls/certificate.h"
#include "tests/endpoint/rpc_client.h"
#include "tests/endpoint/small_server.h"
#include "tests/support/eventually.h"

namespace clothstream::tests {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

class GrpcEndpoint : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (!IsSkipped()) open({});
  }
  void TearDown() override {
    endpoint_.reset();
    SmallServer::TearDown();
  }
  void open(endpoint::GrpcEndpointOptions options) {
    endpoint_.reset();
    options.port = 0;
    endpoint_ = std::make_unique<endpoint::GrpcEndpoint>(server(), options);
  }
  std::uint16_t port() const { return endpoint_->port(); }
  Joined join(const std::string& scene = "") const {
    return Joined(std::make_unique<RpcStream>(port()), scene);
  }

  std::unique_ptr<endpoint::GrpcEndpoint> endpoint_;
};

TEST_F(GrpcEndpoint, ListsScenes) {
  grpc::ClientContext context;
  v1::ListScenesResponse response;
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  ASSERT_TRUE(stub->ListScenes(&context, {}, &response).ok());
  std::vector<std::string> names;
  for (const v1::SceneSummary& scene : response.scenes()) names.push_back(scene.name());
  EXPECT_THAT(names, testing::UnorderedElementsAre("small", "other", "large"));
}

TEST_F(GrpcEndpoint, GetsSceneByName) {
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

// Requests a copy of the scene "other". The caller sets its name.
v1::CreateSceneRequest copyOfOther(v1::ClothStream::Stub& stub) {
  v1::GetSceneRequest get;
  get.set_name("other");
  v1::GetSceneResponse other;
  grpc::ClientContext getting;
  EXPECT_TRUE(stub.GetScene(&getting, get, &other).ok());
  v1::CreateSceneRequest request;
  *request.mutable_scene() = other.scene();
  return request;
}

TEST_F(GrpcEndpoint, CreatesSceneAndRefusesInvalidOne) {
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  v1::CreateSceneRequest request = copyOfOther(*stub);
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

TEST_F(GrpcEndpoint, AnswersEveryCallThatIsPendingWhenItCloses) {
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
  v1::CreateSceneRequest request = copyOfOther(*stub);
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
  endpoint_.reset();
  for (std::size_t i = 1; i < kCalls; ++i) ASSERT_TRUE(nextIsAnswered()) << i;
  for (const Call& call : calls)
    EXPECT_THAT(call.status.error_code(), AnyOf(grpc::StatusCode::OK, grpc::StatusCode::UNAVAILABLE));
}

using grpc::health::v1::HealthCheckResponse;

std::string healthRequest(const std::string& service) {
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  return request.SerializeAsString();
}

// Next answer of a health call, or UNKNOWN if the call ends.
HealthCheckResponse::ServingStatus nextStatus(RpcStream& call) {
  HealthCheckResponse response;
  const std::optional<std::string> message = call.receive();
  return message && response.ParseFromString(*message) ? response.status() : HealthCheckResponse::UNKNOWN;
}

TEST_F(GrpcEndpoint, ReportsThatItServes) {
  for (const char* service : {"", "clothstream.v1.ClothStream"}) {
    RpcStream call(port(), {.method = "/grpc.health.v1.Health/Check"});
    ASSERT_TRUE(call.send(healthRequest(service)));
    call.sendDone();
    EXPECT_EQ(nextStatus(call), HealthCheckResponse::SERVING) << service;
    EXPECT_TRUE(call.finish().ok());
  }
}

TEST_F(GrpcEndpoint, DoesNotKnowHealthOfOtherService) {
  RpcStream call(port(), {.method = "/grpc.health.v1.Health/Check"});
  ASSERT_TRUE(call.send(healthRequest("some.Other")));
  call.sendDone();
  EXPECT_EQ(call.receive(), std::nullopt);
  const grpc::Status status = call.finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("some.Other"));
}

TEST_F(GrpcEndpoint, TellsHealthWatcherThatItCloses) {
  RpcStream call(port(), {.method = "/grpc.health.v1.Health/Watch"});
  RpcStream other(port(), {.method = "/grpc.health.v1.Health/Watch"});
  ASSERT_TRUE(call.send(healthRequest("clothstream.v1.ClothStream")));
  ASSERT_TRUE(other.send(healthRequest("some.Other")));
  call.sendDone();
  other.sendDone();
  EXPECT_EQ(nextStatus(call), HealthCheckResponse::SERVING);
  EXPECT_EQ(nextStatus(other), HealthCheckResponse::SERVICE_UNKNOWN);
  endpoint_.reset();
  EXPECT_EQ(nextStatus(call), HealthCheckResponse::NOT_SERVING);
  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

using ReflectionRequest = grpc::reflection::v1alpha::ServerReflectionRequest;
using ReflectionResponse = grpc::reflection::v1alpha::ServerReflectionResponse;
constexpr const char* kReflection = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";

std::string reflectionRequest(const std::string& symbol) {
  ReflectionRequest request;
  request.set_file_containing_symbol(symbol);
  return request.SerializeAsString();
}

ReflectionResponse reflected(RpcStream& call, const std::string& request) {
  ReflectionResponse response;
  EXPECT_TRUE(call.send(request));
  EXPECT_TRUE(response.ParseFromString(call.receive().value_or("")));
  return response;
}

TEST_F(GrpcEndpoint, ReflectsItsServicesIfItShould) {
  open({.reflects = true});
  RpcStream call(port(), {.method = kReflection});
  ReflectionRequest list;
  list.set_list_services("*");
  EXPECT_THAT(reflected(call, list.SerializeAsString()).list_services_response().DebugString(),
              AllOf(HasSubstr("clothstream.v1.ClothStream"), HasSubstr("grpc.health.v1.Health")));
  const auto files = reflected(call, reflectionRequest("clothstream.v1.ClothStream.Join"))
                         .file_descriptor_response()
                         .file_descriptor_proto();
  google::protobuf::SimpleDescriptorDatabase database;
  for (const std::string& file : files) {
    google::protobuf::FileDescriptorProto message;
    ASSERT_TRUE(message.ParseFromString(file));
    EXPECT_TRUE(database.Add(message)) << message.name();
  }
  google::protobuf::DescriptorPool pool(&database);
  EXPECT_NE(pool.FindServiceByName("clothstream.v1.ClothStream"), nullptr);
  ReflectionRequest byName;
  byName.set_file_by_filename("clothstream/v1/scene.proto");
  EXPECT_TRUE(reflected(call, byName.SerializeAsString()).has_file_descriptor_response());
  for (const char* other : {"no.such.Name", "clothstream.v1.SavedParts"})
    EXPECT_EQ(reflected(call, reflectionRequest(other)).error_response().error_code(),
              grpc::StatusCode::NOT_FOUND)
        << other;
  call.sendDone();
  EXPECT_TRUE(call.finish().ok());
}

TEST_F(GrpcEndpoint, HasNoReflectionUnlessAskedFor) {
  RpcStream call(port(), {.method = kReflection});
  call.send(reflectionRequest("clothstream.v1.ClothStream"));
  EXPECT_EQ(call.receive(), std::nullopt);
  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(GrpcEndpoint, ReflectionHasTheLimitsOfOtherCalls) {
  open({.reflects = true});
  RpcStream call(port(), {.method = kReflection});
  int answers = 0;
  while (answers < 1000 && call.send(reflectionRequest("clothstream.v1.ClothStream")) && call.receive())
    ++answers;
  EXPECT_LT(answers, 200);
  EXPECT_EQ(call.finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  RpcStream large(port(), {.method = kReflection});
  large.send(reflectionRequest(std::string(2000, 'x')));
  EXPECT_EQ(large.receive(), std::nullopt);
  EXPECT_EQ(large.finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

// They neither stay nor take the place of others.
TEST_F(GrpcEndpoint, IdleReflectionStreamsEnd) {
  open({.answerTimeout = 200ms, .reflects = true});
  std::vector<std::unique_ptr<RpcStream>> idle;
  for (int i = 0; i < 40; ++i) idle.push_back(std::make_unique<RpcStream>(port(), RpcOptions{kReflection}));
  Joined viewer = join();
  EXPECT_TRUE(viewer.see(2));
  for (const auto& stream : idle) {
    EXPECT_EQ(stream->receive(), std::nullopt);
    EXPECT_FALSE(stream->finish().ok());
  }
}

TEST_F(GrpcEndpoint, RefusesCompressedMessages) {
  RpcStream stream(port(), {.compressed = true});
  stream.send(hello());
  EXPECT_EQ(stream.receive(), std::nullopt);
  EXPECT_EQ(stream.finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);
}

// A client whose machine or network has failed does not answer pings, and its socket stays open.
TEST_F(GrpcEndpoint, ClosesConnectionThatDoesNotAnswerPingsWithinTenSeconds) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  // RFC 9113 3.4: the preface and an empty SETTINGS frame, so that the server accepts the connection.
  const std::string preface =
      std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n") + std::string("\0\0\0\4\0\0\0\0\0", 9);
  ASSERT_EQ(::send(socket, preface.data(), preface.size(), 0), static_cast<ssize_t>(preface.size()));
  const auto from = std::chrono::steady_clock::now();
  pollfd readable{socket, POLLIN, 0};
  char bytes[4096];
  ssize_t received = 1;
  while (received > 0 && ::poll(&readable, 1, 10'000) == 1) received = ::recv(socket, bytes, sizeof bytes, 0);
  EXPECT_LE(received, 0) << "still open";
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(10));
  ::close(socket);
}

TEST(CallRateTest, LimitsCallsOfAnAddressWithoutItsPort) {
  endpoint::CallRate rate;
  const schedule::Clock::time_point now{std::chrono::hours(1)};
  const auto callsAllowed = [&](const std::string& peer) {
    int calls = 0;
    while (calls < 1000 && rate.take(peer, now)) ++calls;
    return calls;
  };
  constexpr int kAtOnce = 2 * static_cast<int>(endpoint::CallRate::kCallsPerSecond);
  EXPECT_EQ(callsAllowed("ipv4:192.0.2.1:50000"), kAtOnce);
  EXPECT_EQ(callsAllowed("ipv4:192.0.2.1:50001"), 0);
  EXPECT_EQ(callsAllowed("ipv4:192.0.2.2:50000"), kAtOnce);
  EXPECT_EQ(callsAllowed("ipv6:%5B2001:db8::1%5D:50000"), kAtOnce);
  EXPECT_EQ(callsAllowed("ipv6:%5B2001:db8::2%5D:50001"), 0) << "the same first 64 bits";
  EXPECT_EQ(callsAllowed("ipv6:%5Bfe80::1%252%5D:50000"), kAtOnce);
  EXPECT_EQ(callsAllowed("ipv6:%5Bfe80::1%252%5D:50001"), 0);
  EXPECT_EQ(callsAllowed("ipv6:%5Bfe80::2%252%5D:50000"), kAtOnce) << "another machine of the network";
  EXPECT_EQ(endpoint::addressOf("ipv6:%5Bfe80::1%252%5D:50000"), boost::asio::ip::make_address("fe80::1%2"));
  EXPECT_TRUE(rate.take("ipv4:192.0.2.1:50000", now + std::chrono::seconds(1)));
}

TEST(AnswerBudgetTest, LimitsAnswersInAllAndOfAnAddress) {
  endpoint::AnswerBudget budget({.bytes = 100, .bytesOfAddress = 60});
  EXPECT_TRUE(budget.take("a", 40) && budget.take("a", 20));
  EXPECT_FALSE(budget.take("a", 1));
  EXPECT_TRUE(budget.take("b", 30));
  EXPECT_FALSE(budget.take("b", 11)) << "101 bytes in all";
  EXPECT_TRUE(budget.take("", 10)) << "of this machine";
  EXPECT_FALSE(budget.take("", 1));
  budget.release("a", 40);
  EXPECT_TRUE(budget.take("", 40)) << "addresses of this machine have no limit of their own";
  budget.release("a", 20);
  budget.release("b", 30);
  budget.release("", 50);
  EXPECT_TRUE(budget.take("a", 1000)) << "the only one may be larger";
  EXPECT_FALSE(budget.take("b", 1));
  budget.release("a", 1000);
  EXPECT_TRUE(budget.take("b", 1));
}

// Makes the scene "mesh", whose definition has about 240 kB.
void makeMeshScene(hosting::SceneServer& server) {
  constexpr std::uint32_t kSide = 96;
  v1::GetSceneRequest get;
  get.set_name("other");
  const auto other = server.unaryCalls.getScene(get);
  ASSERT_TRUE(other);
  v1::CreateSceneRequest request;
  request.set_name("mesh");
  *request.mutable_scene() = other->scene();
  v1::Cloth& cloth = *request.mutable_scene()->mutable_cloths(0);
  cloth.clear_pins();
  cloth.set_mass(0.015f * kSide * kSide);  // stable, also at the light nodes of the edge
  v1::Mesh& mesh = *cloth.mutable_mesh();
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) {
      for (const float coordinate : {0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0.0f})
        mesh.add_positions(coordinate);
      const std::uint32_t node = y * kSide + x;
      if (x == 0 || y == 0) continue;
      for (const std::uint32_t corner :
           {node, node - 1, node - kSide, node - 1, node - kSide - 1, node - kSide})
        mesh.add_triangles(corner);
    }
  std::promise<std::string> made;
  server.unaryCalls.createScene(
      request, [&](const auto& answer) { made.set_value(answer ? "" : answer.error().text()); });
  ASSERT_EQ(made.get_future().get(), "");
}

// A call of GetScene for the scene "mesh" whose client does not read the answer.
std::unique_ptr<RpcStream> getMeshWithoutReading(std::uint16_t port) {
  auto call = std::make_unique<RpcStream>(
      port, RpcOptions{.method = "/clothstream.v1.ClothStream/GetScene", .smallWindow = true});
  v1::GetSceneRequest request;
  request.set_name("mesh");
  call->send(request.SerializeAsString());
  call->sendDone();
  call->awaitAnswer();
  return call;
}

grpc::Status getMesh(std::uint16_t port) {
  grpc::ClientContext context;
  v1::GetSceneRequest request;
  request.set_name("mesh");
  v1::GetSceneResponse response;
  return v1::ClothStream::NewStub(channelTo(port))->GetScene(&context, request, &response);
}

bool isWithoutRoom(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
         status.error_message().find("answers that clients have not read yet") != std::string::npos;
}

TEST_F(GrpcEndpoint, LimitsAnswersThatClientsDoNotRead) {
  makeMeshScene(server());
  open({.answers = {.bytes = 300'000}});
  EXPECT_TRUE(getMesh(port()).ok());
  const auto unread = getMeshWithoutReading(port());
  EXPECT_TRUE(eventually([&] { return isWithoutRoom(getMesh(port())); }));
  const auto reason = static_cast<std::size_t>(telemetry::Refusal::unreadCalls);
  EXPECT_GE(server().metrics.refusals[reason].value(), 1U);
  unread->disconnect();
  EXPECT_TRUE(eventually([&] { return getMesh(port()).ok(); })) << "an ended call makes room";
}

TEST_F(GrpcEndpoint, CancelsCallWhoseAnswerIsNotRead) {
  makeMeshScene(server());
  open({.answers = {.bytes = 300'000}, .answerTimeout = 1s});
  const auto unread = getMeshWithoutReading(port());
  EXPECT_TRUE(eventually([&] { return isWithoutRoom(getMesh(port())); }));
  EXPECT_TRUE(eventually([&] { return getMesh(port()).ok(); }));
  EXPECT_EQ(unread->receive(), std::nullopt) << "the rest of the answer never comes";
  EXPECT_EQ(unread->finish().error_code(), grpc::StatusCode::CANCELLED);
}

// Opens Join streams, or health watches, on one connection. Returns the status of the first refused one.
grpc::Status openUntilRefused(const std::shared_ptr<grpc::Channel>& channel, const std::string& method) {
  std::vector<std::unique_ptr<RpcStream>> streams;
  while (streams.size() < 40) {
    streams.push_back(std::make_unique<RpcStream>(channel, method));
    RpcStream& stream = *streams.back();
    const bool isJoin = method == kJoin;
    if (stream.send(isJoin ? ping() : healthRequest("")) && stream.receive()) continue;
    return stream.finish();
  }
  return grpc::Status::OK;
}

constexpr const char* kWatch = "/grpc.health.v1.Health/Watch";

TEST_F(GrpcEndpoint, LimitsNewStreamsPerSecond) {
  open({.connections = {.connectionsPerSecond = 5}});
  for (const char* method : {kJoin, kWatch}) {
    const grpc::Status status = openUntilRefused(channelTo(port()), method);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("too many new streams (--profile)"));
  }
  const auto reason = static_cast<std::size_t>(telemetry::Refusal::connectionRate);
  EXPECT_GE(server().metrics.refusals[reason].value(), 2U);
}

// Needs an address of this machine other than loopback, which has no such limit.
TEST_F(GrpcEndpoint, LimitsStreamsOfAnAddressOnOneConnection) {
  const std::vector<std::string> names = tls::namesOfThisMachine();
  const auto other = std::ranges::find_if(names, [](const std::string& name) {
    boost::system::error_code error;
    const auto address = boost::asio::ip::make_address_v4(name, error);
    return !error && !address.is_loopback();
  });
  if (other == names.end()) GTEST_SKIP() << "this machine has only loopback addresses";
  open({.host = "0.0.0.0", .connections = {.connectionsPerAddress = 4}});
  for (const char* method : {kJoin, kWatch}) {
    const auto channel =
        grpc::CreateChannel(fmt::format("{}:{}", *other, port()), grpc::InsecureChannelCredentials());
    const grpc::Status status = openUntilRefused(channel, method);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("streams of this address are open (--profile)"));
  }
  EXPECT_EQ(openUntilRefused(channelTo(port()), kJoin).error_code(), grpc::StatusCode::OK);
}

TEST_F(GrpcEndpoint, RefusesTooManyCalls) {
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  std::atomic<bool> refused = false;
  std::vector<std::jthread> callers;
  for (int i = 0; i < 8; ++i)
    callers.emplace_back([&] {
      for (int calls = 0; calls < 1000 && !refused; ++calls) {
        grpc::ClientContext context;
        v1::ListScenesResponse response;
        const grpc::Status status = stub->ListScenes(&context, {}, &response);
        if (status.ok()) continue;
        EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
        EXPECT_EQ(status.error_message(), "too many calls: try again in a second");
        refused = true;
      }
    });
  callers.clear();
  EXPECT_TRUE(refused);
  Joined viewer = join();
  EXPECT_TRUE(viewer.see(2));
}

TEST_F(GrpcEndpoint, RefusesSilentConnectionsBeyondLimitAndFreesTheirPlaces) {
  endpoint::GrpcEndpointOptions options;
  options.maxStreams = 1;
  open(options);
  Joined viewer = join();
  const auto connect = [&] {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port());
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    return socket;
  };
  // gRPC greets an accepted connection with a SETTINGS frame; a refused one is closed.
  const auto isAccepted = [](int socket) {
    pollfd readable{socket, POLLIN, 0};
    char byte;
    return ::poll(&readable, 1, 20'000) == 1 && ::recv(socket, &byte, 1, MSG_PEEK) == 1;
  };
  std::vector<int> silent;
  for (int i = 0; i < 64; ++i) silent.push_back(connect());  // beside the viewer's
  for (const int socket : silent) EXPECT_TRUE(isAccepted(socket));
  const int refused = connect();
  EXPECT_FALSE(isAccepted(refused));
  ::close(refused);
  EXPECT_TRUE(viewer.see(2));
  for (const int socket : silent) ::close(socket);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  bool accepted = false;
  while (!accepted && std::chrono::steady_clock::now() < end) {
    const int next = connect();
    accepted = isAccepted(next);
    ::close(next);
  }
  EXPECT_TRUE(accepted);
  EXPECT_TRUE(viewer.see(2));
}

TEST_F(GrpcEndpoint, RefusesStreamBeyondLimit) {
  endpoint::GrpcEndpointOptions options;
  options.maxStreams = 1;
  open(options);
  Joined first = join();
  RpcStream second(port());
  EXPECT_EQ(second.receive(), std::nullopt);
  EXPECT_EQ(second.finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(first.see(2));
}

// Completions of calls may arrive after their connections have closed.
TEST_F(GrpcEndpoint, ClosesWhileClientsComeAndGoAndSomeDoNotRead) {
  for (int round = 0; round < 5; ++round) {
    open({});
    std::vector<std::unique_ptr<RpcStream>> clients;
    for (int i = 0; i < 12; ++i) {
      clients.push_back(std::make_unique<RpcStream>(port(), RpcOptions{.smallWindow = i % 3 == 0}));
      clients.back()->send(hello());
    }
    Joined reader = join();
    EXPECT_TRUE(reader.see(2));
    for (std::size_t i = 1; i < clients.size(); i += 3) clients[i]->disconnect();
    endpoint_.reset();
    EXPECT_EQ(reader.seeEnd().code, grpc::StatusCode::UNAVAILABLE);
  }
}

// The server program stops the scenes and then closes the endpoint. The last notice must still arrive.
TEST_F(GrpcEndpoint, DeliversLastNoticeWhenServerStopsAndEndpointCloses) {
  std::vector<Joined> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(join());
  server().stop();
  endpoint_.reset();
  for (Joined& client : clients) {
    EXPECT_EQ(client.seeEnd().code, grpc::StatusCode::UNAVAILABLE);
    ASSERT_FALSE(client.viewer.notices.empty());
    EXPECT_EQ(client.viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
  }
}

TEST_F(GrpcEndpoint, EndsStreamsOfDeletedSceneWithNotFound) {
  const auto stub = v1::ClothStream::NewStub(channelTo(port()));
  v1::CreateSceneRequest request;
  request.set_named("other");
  request.set_name("passing");
  v1::CreateSceneResponse created;
  grpc::ClientContext creating, deleting;
  ASSERT_TRUE(stub->CreateScene(&creating, request, &created).ok());
  Joined client = join("passing");
  v1::DeleteSceneRequest deletion;
  deletion.set_name("passing");
  v1::DeleteSceneResponse deleted;
  ASSERT_TRUE(stub->DeleteScene(&deleting, deletion, &deleted).ok());
  const StreamEnd end = client.seeEnd();
  EXPECT_EQ(end.code, grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(end.text, HasSubstr("'passing' was deleted"));
}

}  // namespace
}  // namespace clothstream::tests

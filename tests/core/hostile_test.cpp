// SPDX-License-Identifier: MIT
// Malformed and random input: the client reports an error and never crashes.
#include <csignal>
#include <cstdlib>
#include <functional>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "clients/core/wire/server_message.h"
#include "clients/core/wire/wire.h"
#include "proto/text/utf8.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::HasSubstr;

// One message of each kind, in an order that a client accepts.
std::vector<std::string> session() {
  ScriptedServer server({.normals = codec::NormalMode::octahedral, .cloths = {{"a", 4, 3}, {"b", 3, 3}}});
  std::vector<std::string> messages{server.welcome()};
  for (std::string& chunk : server.chunks(400)) messages.push_back(std::move(chunk));
  messages.push_back(server.frame(1));
  messages.push_back(server.frame(2));
  messages.push_back(ScriptedServer::pong(1, 2));
  v1::ServerMessage message;
  message.mutable_notice()->set_text("notice");
  messages.push_back(message.SerializeAsString());
  v1::ParameterChange& change = *message.mutable_parameter_changed()->mutable_change();
  change.mutable_gravity()->mutable_value()->set_y(-1);
  change.add_cloths()->mutable_bend()->set_stiffness(1);
  messages.push_back(message.SerializeAsString());
  v1::SceneSummary& summary = *message.mutable_list_scenes()->add_scenes();
  summary.set_name("curtain");
  summary.set_description("A curtain");
  summary.set_vertex_count(10);
  messages.push_back(message.SerializeAsString());
  messages.push_back(ScriptedServer::error(v1::ERROR_CODE_INVALID_ARGUMENT, "no", false));
  return messages;
}

// Reads everything that the client returns, so that a sanitizer checks it.
void readAll(ClientUnderTest& client) {
  const std::uint32_t vertices = cs_vertex_count(client.get());
  float sum = 0;
  for (std::uint32_t i = 0; i < 3 * vertices; ++i)
    sum += cs_positions(client.get())[i] + cs_normals(client.get())[i] +
           cs_played_positions(client.get())[i] + cs_played_normals(client.get())[i];
  std::uint32_t indices = 0;
  const std::uint32_t* triangles = cs_triangles(client.get(), &indices);
  for (std::uint32_t i = 0; i < indices; ++i) ASSERT_LT(triangles[i], vertices);
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_collider(client.get(), i, &collider) != 0; ++i) sum += collider.radius;
  for (std::uint32_t i = 0, corners = 0; cs_get_collider(client.get(), i, &collider) != 0; ++i) {
    const float* hull = cs_get_hull(client.get(), i, &corners, &triangles, &indices);
    for (std::uint32_t k = 0; k < 3 * corners; ++k) sum += hull[k];
    for (std::uint32_t k = 0; k < indices; ++k) ASSERT_LT(triangles[k], corners);
  }
  volatile float sink = sum;
  static_cast<void>(sink);
  client.outgoing();
}

// Sends the messages with message `index` replaced by `corrupted`.
void runSession(const std::vector<std::string>& messages, std::size_t index, const std::string& corrupted) {
  ClientUnderTest client;
  cs_play_out_options options;
  cs_default_play_out(&options);
  cs_set_play_out(client.get(), &options);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    client.receive(i == index ? corrupted : messages[i], i * 1000);
    cs_update(client.get(), i * 1000);
    cs_play_out(client.get(), i * 1000, i * 1000, nullptr);
  }
  readAll(client);
}

TEST(Hostile, SurvivesEveryTruncationOfEveryMessage) {
  const std::vector<std::string> messages = session();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    for (std::size_t length = 0; length < messages[i].size(); ++length)
      runSession(messages, i, messages[i].substr(0, length));
  }
}

TEST(Hostile, SurvivesEveryFlippedBitOfEveryMessage) {
  const std::vector<std::string> messages = session();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    for (std::size_t bit = 0; bit < 8 * messages[i].size(); ++bit) {
      std::string corrupted = messages[i];
      corrupted[bit / 8] = static_cast<char>(corrupted[bit / 8] ^ (1 << (bit % 8)));
      runSession(messages, i, corrupted);
    }
  }
}

TEST(Hostile, SurvivesRandomBytesAtRandomPlaces) {
  const std::vector<std::string> messages = session();
  std::mt19937 random(11);
  const auto below = [&](std::size_t bound) {
    return std::uniform_int_distribution<std::size_t>(0, bound - 1)(random);
  };
  for (int run = 0; run < 5000; ++run) {
    const std::size_t index = below(messages.size());
    std::string corrupted = messages[index];
    for (std::size_t changes = 1 + below(8); changes > 0 && !corrupted.empty(); --changes)
      corrupted[below(corrupted.size())] = static_cast<char>(below(256));
    runSession(messages, index, corrupted);
  }
}

TEST(Hostile, MalformedMessageFailsTheClientWithAReason) {
  ClientUnderTest client;
  EXPECT_EQ(client.receive("HTTP/1.1 400 Bad Request\r\n"), static_cast<std::uint32_t>(CS_EVENT_ERROR));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("is a clothstream-server"));
  EXPECT_EQ(client.receive(ScriptedServer().welcome()), 0u) << "a failed client ignores messages";
}

// Programs may pass names to functions that refuse other text.
TEST(Hostile, NamesThatAreNotUtf8FailTheClient) {
  ScriptedServer server;
  ClientUnderTest client;
  client.join(server);
  v1::Frame frame = server.frameMessage(1, codec::PacketKind::key);
  const std::string kName = "st\xcdne";
  frame.mutable_colliders(1)->set_name(kName);
  EXPECT_EQ(client.receive(ScriptedServer::serialise(frame)), static_cast<std::uint32_t>(CS_EVENT_ERROR));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_collider(client.get(), i, &collider) != 0; ++i)
    EXPECT_NE(collider.name, kName);
}

TEST(Utf8, AcceptsEveryLengthOfCharacter) {
  for (const std::string_view text :
       {"", "a", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xee\x80\x80", "\xef\xbf\xbf",
        "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "a\xc3\xa4z"})
    EXPECT_TRUE(isUtf8(text)) << text;
}

TEST(Utf8, RefusesMalformedText) {
  for (const std::string_view text :
       {"\x80", "\xc0\x80", "\xc1\xbf", "\xc2", "\xc2z", "\xe0\x9f\xbf", "\xe0\xa0", "\xed\xa0\x80",
        "\xe2\x28\xa1", "\xf0\x8f\xbf\xbf", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xf0\x90\x80", "\xff",
        "a\xfe"})
    EXPECT_FALSE(isUtf8(text)) << ::testing::PrintToString(text);
}

cs_limits defaultLimits() {
  cs_limits limits;
  cs_default_limits(&limits);
  return limits;
}

// Joins with these limits and sends this description. Returns the error text, "" if the client has joined.
std::string refusalOf(const v1::StreamDescription& description, const cs_limits& limits = defaultLimits()) {
  ClientUnderTest client;
  EXPECT_EQ(cs_set_limits(client.get(), &limits), 1);
  client.receive(ScriptedServer().welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 256 * 1024, 1));
  return cs_get_state(client.get()) == CS_STATE_FAILED ? cs_error_text(client.get()) : "";
}

TEST(Hostile, RefusesDescriptionBeyondEachLimit) {
  const v1::StreamDescription description =
      ScriptedServer({.cloths = {{"a", 4, 3}, {"b", 3, 3}}}).description();  // 21 vertices, 20 triangles
  EXPECT_EQ(refusalOf(description), "");
  cs_limits limits = defaultLimits();
  limits.max_vertices = 21;
  limits.max_triangles = 20;
  limits.max_cloths = 2;
  limits.max_content_bytes = description.ByteSizeLong();
  EXPECT_EQ(refusalOf(description, limits), "") << "the limits themselves are allowed";
  const auto lowered = [&](auto cs_limits::*limit) {
    cs_limits lower = limits;
    --(lower.*limit);
    return refusalOf(description, lower);
  };
  EXPECT_THAT(lowered(&cs_limits::max_vertices),
              HasSubstr("21 vertices; this client accepts at most 20 (cs_limits.max_vertices)"));
  EXPECT_THAT(lowered(&cs_limits::max_triangles), HasSubstr("20 triangles; this client accepts at most 19"));
  EXPECT_THAT(lowered(&cs_limits::max_cloths), HasSubstr("2 cloths; this client accepts at most 1"));
  EXPECT_THAT(lowered(&cs_limits::max_content_bytes), HasSubstr("(cs_limits.max_content_bytes)"));
}

TEST(Hostile, RefusesHugeSizesThatAreOnlyStated) {
  v1::StreamDescription description = ScriptedServer().description();
  v1::ClothDescription& cloth = *description.mutable_cloths(0);
  cloth.set_vertex_count(defaultLimits().max_vertices + 1);
  EXPECT_THAT(refusalOf(description), HasSubstr("max_vertices"));
  cloth.set_vertex_count(63);
  cloth.set_rows(~0u);
  cloth.set_columns(~0u);
  EXPECT_THAT(refusalOf(description), HasSubstr("max_triangles"));
}

TEST(Hostile, RefusesMoreSubmeshesOfAllClothsThanAllowed) {
  v1::StreamDescription description = ScriptedServer({.cloths = {{"a", 4, 3}, {"b", 3, 3}}}).description();
  for (int i = 0; i < 40'000; ++i) {
    description.mutable_cloths(0)->add_submeshes();
    description.mutable_cloths(1)->add_submeshes();
  }
  EXPECT_THAT(refusalOf(description), HasSubstr("is not a StreamDescription"));
}

TEST(Hostile, RefusesWelcomeWithTooManyParticipants) {
  v1::ServerMessage message;
  ASSERT_TRUE(message.ParseFromString(ScriptedServer().welcome()));
  for (int i = 0; i < 3; ++i) message.mutable_welcome()->add_participants()->set_id(i + 1);
  cs_limits limits = defaultLimits();
  limits.max_participants = 2;
  ClientUnderTest client;
  ASSERT_EQ(cs_set_limits(client.get(), &limits), 1);
  client.receive(message.SerializeAsString());
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("(cs_limits.max_participants)"));
}

TEST(Hostile, FloodOfPresenceKeepsABoundedNumberOfParticipantsWithShortNames) {
  const ScriptedServer server;
  ClientUnderTest client;
  client.join(server);
  v1::ServerMessage message;
  v1::Presence& presence = *message.mutable_presence();
  presence.set_kind(v1::PRESENCE_KIND_JOINED);
  for (std::uint64_t id = 1; id <= 5000; ++id) {
    presence.mutable_participant()->set_id(id);
    client.receive(message.SerializeAsString());
  }
  EXPECT_EQ(cs_participant_count(client.get()), defaultLimits().max_participants);
  presence.mutable_participant()->set_display_name(std::string(1025, 'x'));
  client.receive(message.SerializeAsString());
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
}

TEST(Hostile, RefusesLimitsThatAreNotAllowed) {
  ClientUnderTest client;
  EXPECT_EQ(cs_set_limits(client.get(), nullptr), 0);
  for (const auto& change : std::vector<std::function<void(cs_limits&)>>{
           [](cs_limits& limits) { limits.version = 0; }, [](cs_limits& limits) { limits.max_vertices = 0; },
           [](cs_limits& limits) { limits.max_triangles = ~0u; },
           [](cs_limits& limits) { limits.max_cloths = 257; },
           [](cs_limits& limits) { limits.max_participants = ~0u; },
           [](cs_limits& limits) { limits.max_content_bytes = 268'435'457; }}) {
    cs_limits limits = defaultLimits();
    change(limits);
    EXPECT_EQ(cs_set_limits(client.get(), &limits), 0);
  }
}

TEST(Hostile, SkipsUnknownFieldsAndBodies) {
  // Field 500 as a varint, field 501 as bytes, field 502 as 64 bits, field 503 as 32 bits.
  const std::string unknown(
      "\xa0\x1f\x05\xaa\x1f\x02xy\xb1\x1f"
      "12345678\xbd\x1f"
      "1234",
      24);
  ASSERT_TRUE(wellFormed(Bytes(unknown)));
  ScriptedServer server;
  ClientUnderTest client;
  EXPECT_EQ(client.receive(unknown), 0u);
  client.receive(server.welcome() + unknown);
  client.receive(server.chunks()[0] + unknown);
  EXPECT_EQ(client.receive(server.frame(1) + unknown), static_cast<std::uint32_t>(CS_EVENT_FRAME));
}

TEST(Hostile, SkipsKnownFieldsWithAnotherWireType) {
  v1::Frame sent = ScriptedServer().frameMessage(1, codec::PacketKind::key);
  sent.set_tick_time_us(5);
  // Field 1 (bytes) as a varint, field 2 (a varint) as 64 bits.
  const std::string bytes = sent.SerializeAsString() + "\x08\x07\x11" + "12345678";
  Frame read;
  ASSERT_TRUE(readFrame(Bytes(bytes), read));
  EXPECT_EQ(read.tickTimeUs, 5u);
  EXPECT_EQ(std::string(read.packet), sent.packet());
}

TEST(Interface, ReturnsErrorsInsteadOfExceptions) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer's allocator ends the program";
#endif
  // Only a failed allocation throws.
  const auto runOutOfMemory = [] {
    const cs_client_options options{};
    const rlimit none{};
    setrlimit(RLIMIT_DATA, &none);
    try {
      for (;;) cs_create(&options);
    } catch (...) {
      std::_Exit(0);
    }
  };
  EXPECT_EXIT(runOutOfMemory(), ::testing::KilledBySignal(SIGABRT), "");
}

TEST(Wire, RefusesMalformedFields) {
  const auto isWhole = [](std::string_view bytes) { return wellFormed(Bytes(bytes.data(), bytes.size())); };
  using namespace std::string_view_literals;
  EXPECT_TRUE(isWhole(""sv));
  EXPECT_TRUE(isWhole("\x08\x01"sv));
  EXPECT_TRUE(isWhole("\x08\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"sv));
  EXPECT_FALSE(isWhole("\x08\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"sv)) << "a varint of 11 bytes";
  EXPECT_FALSE(isWhole("\x08"sv));
  EXPECT_FALSE(isWhole("\x08\x80"sv));
  EXPECT_FALSE(isWhole("\x00\x01"sv)) << "field 0";
  EXPECT_FALSE(isWhole("\xc0\xa3\x09\x01"sv)) << "field 19000";
  EXPECT_FALSE(isWhole("\x0b\x0c"sv)) << "a group";
  EXPECT_FALSE(isWhole("\x0a\x02x"sv));
  EXPECT_FALSE(isWhole("\x0a\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"sv)) << "a length of 2^64 - 1";
  EXPECT_FALSE(isWhole("\x0d\x01\x02\x03"sv));
  EXPECT_FALSE(isWhole("\x09\x01\x02\x03\x04\x05\x06\x07"sv));
}

}  // namespace
}  // namespace clothstream::client

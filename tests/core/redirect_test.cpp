// SPDX-License-Identifier: MIT
// Errors that name the server that has the scene, and the connections that follow them.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

class Redirect : public ::testing::Test {
 protected:
  void SetUp() override { cs_follow_redirects(client.get(), 1); }

  std::uint32_t refuse(const std::string& name, v1::ErrorCode code = v1::ERROR_CODE_NOT_FOUND) {
    return client.receive(ScriptedServer::error(code, "the scene is elsewhere", true, name), now);
  }
  std::uint32_t announceMove(const std::string& name) {
    v1::ServerMessage message;
    message.mutable_moving()->set_server(name);
    return client.receive(message.SerializeAsString(), now);
  }
  // The transport opens a connection, after it has closed the one before.
  void connect() {
    cs_connecting(client.get(), now);
    client.outgoing();
  }
  void failToConnect() {
    connect();
    cs_disconnected(client.get(), now);
  }
  // Welcome has a resume token, so that the client reconnects.
  void join() {
    v1::ServerMessage welcome;
    welcome.ParseFromString(server.welcome());
    welcome.mutable_welcome()->set_resume_token("0123456789abcdef");
    client.receive(welcome.SerializeAsString(), now);
    client.receiveAll(server.chunks(), now);
    client.outgoing();
  }
  std::string next() const { return cs_connect_server(client.get()); }
  std::string named() const { return cs_error_server(client.get()); }
  cs_state state() const { return cs_get_state(client.get()); }

  static constexpr std::uint64_t kSecond = 1'000'000;
  std::uint64_t now = 100 * kSecond;
  ScriptedServer server;
  ClientUnderTest client;
};

TEST_F(Redirect, AcceptsOnlyDnsNames) {
  const std::string longest = std::string(63, 'a') + '.' + std::string(63, 'b') + '.' + std::string(63, 'c') +
                              '.' + std::string(61, 'd');
  ASSERT_THAT(longest, SizeIs(253));
  for (const std::string& name : {std::string("localhost"), std::string("eu-2.Example.org"), longest,
                                  std::string("1.example"), std::string("10.0.0.x1"), std::string("0xfg")}) {
    ClientUnderTest other;
    other.receive(ScriptedServer::error(v1::ERROR_CODE_NOT_FOUND, "elsewhere", true, name));
    EXPECT_EQ(cs_error_server(other.get()), name);
  }
  const std::string zero("a\0b", 3);
  for (const std::string& name : {std::string(),
                                  longest + "e",
                                  std::string(64, 'a'),
                                  std::string("."),
                                  std::string("a."),
                                  std::string(".a"),
                                  std::string("a..b"),
                                  std::string("-a.example"),
                                  std::string("a-.example"),
                                  std::string("a_b.example"),
                                  std::string("a b"),
                                  std::string("a:8080"),
                                  std::string("https://a"),
                                  std::string("a/b"),
                                  std::string("user@a"),
                                  std::string("192.0.2.1"),
                                  std::string("127.1"),
                                  std::string("2130706433"),
                                  std::string("0x7f.1"),
                                  std::string("example.0x7F"),
                                  std::string("a.0x"),
                                  std::string("example.1"),
                                  std::string("::1"),
                                  std::string("[::1]"),
                                  std::string("f\xc3\xbc.example"),
                                  std::string("\xff"),
                                  zero}) {
    v1::ServerMessage message;
    message.ParseFromString(ScriptedServer::error(v1::ERROR_CODE_NOT_FOUND, "elsewhere", true));
    message.mutable_error()->set_server(name);
    ClientUnderTest other;
    cs_follow_redirects(other.get(), 1);
    EXPECT_EQ(other.receive(message.SerializeAsString()), std::uint32_t{CS_EVENT_ERROR});
    EXPECT_STREQ(cs_error_server(other.get()), "") << name;
    EXPECT_STREQ(cs_error_text(other.get()), "elsewhere") << name;
    EXPECT_EQ(cs_get_state(other.get()), CS_STATE_FAILED) << name;
    EXPECT_STREQ(cs_connect_server(other.get()), "") << name;
  }
}

TEST_F(Redirect, AppliesOnlyToFatalNotFoundAndCutOff) {
  client.receive(ScriptedServer::error(v1::ERROR_CODE_NOT_FOUND, "no such participant", false, "b.example"));
  EXPECT_THAT(named(), IsEmpty());
  EXPECT_THAT(next(), IsEmpty());
  EXPECT_EQ(refuse("b.example", v1::ERROR_CODE_REMOVED), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_THAT(named(), IsEmpty());
  EXPECT_EQ(state(), CS_STATE_FAILED);
}

TEST_F(Redirect, FollowsNotFoundWhileJoining) {
  connect();
  EXPECT_EQ(refuse("b.example"), 0u);
  EXPECT_EQ(named(), "b.example");
  EXPECT_EQ(next(), "b.example");
  EXPECT_EQ(state(), CS_STATE_JOINING);
  cs_disconnected(client.get(), now);
  EXPECT_EQ(cs_connect_at(client.get()), now);
  EXPECT_EQ(next(), "b.example");
  cs_connecting(client.get(), now);
  EXPECT_TRUE(client.outgoing().at(0).has_hello());
  join();
  EXPECT_EQ(state(), CS_STATE_JOINED);
  EXPECT_EQ(next(), "b.example") << "later connections go there too";
}

TEST_F(Redirect, ReturnsWithTheResumeTokenAfterCutOff) {
  join();
  EXPECT_EQ(refuse("b.example", v1::ERROR_CODE_CUT_OFF), 0u);
  cs_disconnected(client.get(), now);
  EXPECT_EQ(state(), CS_STATE_RECONNECTING);
  EXPECT_EQ(next(), "b.example");
  cs_connecting(client.get(), now);
  EXPECT_EQ(client.outgoing().at(0).hello().resume_token(), "0123456789abcdef");
  join();
  EXPECT_EQ(state(), CS_STATE_JOINED);
}

TEST_F(Redirect, ReportsWhereTheSceneMovesSoon) {
  join();
  EXPECT_EQ(announceMove("b.example"), std::uint32_t{CS_EVENT_MOVING});
  EXPECT_STREQ(cs_next_server(client.get()), "b.example");
  EXPECT_THAT(next(), IsEmpty()) << "it has not moved yet";
  EXPECT_EQ(state(), CS_STATE_JOINED);
  EXPECT_EQ(refuse("b.example", v1::ERROR_CODE_CUT_OFF), 0u);
  EXPECT_EQ(next(), "b.example");
  connect();
  EXPECT_STREQ(cs_next_server(client.get()), "") << "of the connection before";
  join();
  EXPECT_EQ(announceMove("b.example"), 0u) << "it is there already";
  EXPECT_EQ(announceMove("192.0.2.1"), 0u) << "no DNS name";
  cs_follow_redirects(client.get(), 0);
  EXPECT_EQ(announceMove("c.example"), 0u);
  EXPECT_STREQ(cs_next_server(client.get()), "");
}

TEST_F(Redirect, AnnouncesThreeMovesWithinAMinute) {
  join();
  for (const char* name : {"b.example", "c.example", "b.example"})
    EXPECT_EQ(announceMove(name), std::uint32_t{CS_EVENT_MOVING});
  EXPECT_EQ(announceMove("d.example"), 0u);
  EXPECT_STREQ(cs_next_server(client.get()), "b.example");
  now += 60 * kSecond;
  EXPECT_EQ(announceMove("d.example"), std::uint32_t{CS_EVENT_MOVING});
}

TEST_F(Redirect, IsIgnoredByDefault) {
  cs_follow_redirects(client.get(), 0);
  join();
  EXPECT_EQ(refuse("b.example", v1::ERROR_CODE_CUT_OFF), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_EQ(named(), "b.example");
  EXPECT_THAT(next(), IsEmpty());
  EXPECT_EQ(state(), CS_STATE_JOINED);
  cs_disconnected(client.get(), now);
  connect();
  EXPECT_EQ(refuse("b.example"), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_EQ(named(), "b.example");
  EXPECT_EQ(state(), CS_STATE_FAILED);
}

TEST_F(Redirect, StopsAfterThreeWithinAMinute) {
  for (const char* name : {"b.example", "c.example", "b.example"}) {
    connect();
    EXPECT_EQ(refuse(name), 0u);
    cs_disconnected(client.get(), now += kSecond);
  }
  connect();
  EXPECT_EQ(refuse("c.example"), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_EQ(state(), CS_STATE_FAILED);
  EXPECT_EQ(named(), "c.example");
  EXPECT_EQ(cs_error_code(client.get()), static_cast<std::uint32_t>(v1::ERROR_CODE_NOT_FOUND));
  EXPECT_STREQ(cs_error_text(client.get()), "the scene is elsewhere");
}

TEST_F(Redirect, CountsAgainAfterAMinuteAndAfterAJoinedStream) {
  const auto follow = [&](const std::string& name) {
    connect();
    const std::uint32_t events = refuse(name);
    cs_disconnected(client.get(), now);
    return events == 0;
  };
  for (const char* name : {"b", "c", "d"}) EXPECT_TRUE(follow(name));
  now += 60 * kSecond;
  for (const char* name : {"b", "c", "d"}) EXPECT_TRUE(follow(name));
  connect();
  join();
  EXPECT_EQ(refuse("e", v1::ERROR_CODE_CUT_OFF), 0u);
  cs_disconnected(client.get(), now);
  for (const char* name : {"b", "c"}) EXPECT_TRUE(follow(name));
  EXPECT_FALSE(follow("d"));
  EXPECT_EQ(state(), CS_STATE_FAILED);
}

TEST_F(Redirect, ServerThatNamesItselfIsNotFollowed) {
  connect();
  EXPECT_EQ(refuse("b.example"), 0u);
  cs_disconnected(client.get(), now);
  connect();
  join();
  EXPECT_EQ(refuse("b.example", v1::ERROR_CODE_CUT_OFF), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_EQ(state(), CS_STATE_JOINED);
  cs_disconnected(client.get(), now);
  connect();
  EXPECT_EQ(refuse("b.example"), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_EQ(state(), CS_STATE_FAILED);
}

TEST_F(Redirect, EachFourthAttemptGoesBackWhileTheNamedServerDoesNotAnswer) {
  join();
  refuse("b.example", v1::ERROR_CODE_CUT_OFF);
  cs_disconnected(client.get(), now);
  for (int round = 0; round < 2; ++round) {
    for (int attempt = 0; attempt < 3; ++attempt) {
      EXPECT_EQ(next(), "b.example");
      failToConnect();
    }
    EXPECT_THAT(next(), IsEmpty());
    failToConnect();
  }
  for (int attempt = 0; attempt < 3; ++attempt) failToConnect();
  // The first server does not know the scene. That ends nothing, because another one is named.
  connect();
  EXPECT_EQ(refuse(""), std::uint32_t{CS_EVENT_ERROR});
  cs_disconnected(client.get(), now);
  EXPECT_EQ(state(), CS_STATE_RECONNECTING);
  EXPECT_EQ(next(), "b.example");
  connect();
  EXPECT_EQ(refuse(""), std::uint32_t{CS_EVENT_ERROR});
  EXPECT_EQ(state(), CS_STATE_FAILED) << "the named server does not have the scene";
}

TEST_F(Redirect, StaysAtTheFirstServerIfItHasTheSceneAgain) {
  join();
  refuse("b.example", v1::ERROR_CODE_CUT_OFF);
  cs_disconnected(client.get(), now);
  for (int attempt = 0; attempt < 3; ++attempt) failToConnect();
  connect();
  join();
  EXPECT_THAT(next(), IsEmpty());
  cs_disconnected(client.get(), now);
  EXPECT_THAT(next(), IsEmpty());
}

TEST_F(Redirect, MirrorFollowsToo) {
  const cs_client_options options = optionsFor("curtain");
  const std::unique_ptr<cs_client, decltype(&cs_destroy)> mirror(cs_create_mirror(&options), &cs_destroy);
  cs_follow_redirects(mirror.get(), 1);
  const std::string message = ScriptedServer::error(v1::ERROR_CODE_NOT_FOUND, "elsewhere", true, "b.example");
  cs_decoded nothing{};
  EXPECT_EQ(cs_receive_decoded(mirror.get(), reinterpret_cast<const std::uint8_t*>(message.data()),
                               message.size(), &nothing, now),
            0u);
  EXPECT_EQ(cs_get_state(mirror.get()), CS_STATE_JOINING);
  EXPECT_STREQ(cs_connect_server(mirror.get()), "b.example");
}

}  // namespace
}  // namespace clothstream::client

// SPDX-License-Identifier: MIT
// Tokens, pairing, roles, bans and quotas, as peers see them.
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/identity/authenticator.h"
#include "server/identity/token.h"
#include "tests/identity/key_directory.h"
#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using namespace std::chrono_literals;

using identity::Authenticator;
using identity::AuthenticatorOptions;
using identity::Claims;
using identity::WallClock;
using scene::Role;
using testing::ElementsAre;
using testing::HasSubstr;
using tests::TestPeer;
using Body = v1::ServerMessage;

// Starts the server. Leaves the test if there is no device.
#define START_ASKING(...)   \
  startAsking(__VA_ARGS__); \
  if (IsSkipped()) return

class IdentityTest : public tests::ServerTest {
 protected:
  // Starts a server that requires tokens or pairing.
  void startAsking(hosting::ServerOptions options = {}) {
    authenticator_ = std::make_shared<Authenticator>(
        AuthenticatorOptions{.keyDirectory = keys_.path(), .pairing = true, .stateDirectory = state_.path()});
    options.authenticator = authenticator_;
    start(std::move(options));
  }

  static Claims claims(const std::string& subject, Role role) {
    return {.role = role,
            .scene = {},
            .name = {},
            .subject = subject,
            .tenant = {},
            .audience = "clothstream",
            .expires = WallClock::now() + 1h,
            .notBefore = {}};
  }
  std::string token(const Claims& content) const { return sign(key_, content); }
  std::string token(const std::string& subject, Role role) const { return token(claims(subject, role)); }
  static Arrival with(const std::string& token) { return {.peer = "test", .address = {}, .token = token}; }
  static Arrival from(const std::string& address) {
    return {.peer = "test", .address = address, .token = {}};
  }

  // Sends a message and returns the answer.
  static Body ask(TestPeer& peer, v1::ClientMessage message) {
    message.set_request_id(99);
    peer.send(message);
    return peer.readUntil([](const Body& answer) { return answer.request_id() == 99; });
  }
  static v1::ClientMessage authenticate(const std::string& token) {
    v1::ClientMessage message;
    message.mutable_authenticate()->set_token(token);
    return message;
  }
  static v1::ClientMessage pair(const std::string& code) {
    v1::ClientMessage message;
    message.mutable_authenticate()->set_pairing_code(code);
    return message;
  }
  static v1::ClientMessage remove(const TestPeer& peer, bool ban) {
    v1::ClientMessage message;
    message.mutable_remove_participant()->set_participant_id(peer.welcome().participant_id());
    message.mutable_remove_participant()->set_ban(ban);
    return message;
  }
  static v1::ClientMessage pause(const std::string& scene) {
    v1::ClientMessage message;
    message.mutable_control_scene()->set_name(scene);
    message.mutable_control_scene()->set_paused(true);
    return message;
  }
  static v1::ClientMessage create(const std::string& name) {
    v1::ClientMessage message;
    message.mutable_create_scene()->set_named("small");
    message.mutable_create_scene()->set_name(name);
    return message;
  }
  // Every message that needs an identity.
  static std::vector<v1::ClientMessage> demands() {
    std::vector<v1::ClientMessage> all(22);
    all[0].mutable_hello()->set_protocol_version(1);
    all[1].mutable_list_scenes();
    all[2].mutable_get_scene();
    all[3] = create("x");
    all[4].mutable_delete_scene()->set_name("x");
    all[5] = pause("");
    all[6].mutable_upload();
    all[7].mutable_start_recording();
    all[8].mutable_stop_recording();
    all[9].mutable_list_bans();
    all[10].mutable_lift_ban()->set_subject("x");
    all[11].mutable_create_pairing_code();
    all[12].mutable_set_role();
    all[13].mutable_parameter_change();
    all[14].mutable_collider_poses();
    all[15].mutable_remove_participant();
    all[16].mutable_frame_ack();
    all[17].mutable_key_frame_request();
    all[18].mutable_datagram_offer();
    all[19].mutable_surface()->set_remove(true);
    all[20].mutable_wear_body()->set_collider("x");
    all[21].mutable_get_surface_part()->set_id(1);
    return all;
  }

  const tests::KeyDirectory keys_, state_;
  const identity::TokenKey key_ = keys_.make("test.pem");
  std::shared_ptr<Authenticator> authenticator_;
};

TEST_F(IdentityTest, PeerWithoutTokenGetsNothingButAnError) {
  START_ASKING();
  for (const v1::ClientMessage& demand : demands()) {
    TestPeer peer(server());
    peer.send(demand);
    const v1::ServerMessage last = peer.readToTheEnd();
    EXPECT_EQ(last.error().code(), v1::ERROR_CODE_UNAUTHENTICATED) << demand.ShortDebugString();
    EXPECT_TRUE(last.error().fatal());
    EXPECT_THAT(last.error().text(), HasSubstr("requires a token or a pairing code"));
  }
  const auto* const bodies = v1::ClientMessage::descriptor()->FindOneofByName("body");
  ASSERT_EQ(demands().size() + 2, static_cast<std::size_t>(bodies->field_count()))
      << "all messages except ping and authenticate are demands";
  TestPeer peer(server());
  v1::ClientMessage ping;
  ping.mutable_ping()->set_client_time_us(7);
  peer.send(ping);
  EXPECT_EQ(peer.readUntil(Body::kPong).pong().client_time_us(), 7u);
  EXPECT_EQ(server().unaryCalls.listScenes().scenes(0).participants(), 0u);
}

TEST_F(IdentityTest, TokenWorksWithTheConnectionAndInAMessage) {
  START_ASKING();
  TestPeer early(server(), with(token("ada", Role::participant)));
  early.join();
  TestPeer late(server());
  const v1::AuthenticateResponse answer = ask(late, authenticate(token("ben", Role::viewer))).authenticate();
  EXPECT_EQ(answer.role(), v1::ROLE_VIEWER);
  EXPECT_EQ(answer.token(), "") << "only pairing gives a token";
  EXPECT_GT(answer.expires_s(), 0u);
  late.join();
  EXPECT_EQ(late.welcome().role(), v1::ROLE_VIEWER);
}

TEST_F(IdentityTest, WrongTokenClosesTheStream) {
  START_ASKING();
  Claims expired = claims("ada", Role::owner), elsewhere = claims("ada", Role::owner);
  expired.expires = WallClock::now() - 1s;
  elsewhere.audience = "other";
  const struct {
    std::string token, why;
  } cases[] = {{"x", "not a JSON Web Token"}, {token(expired), "expired"}, {token(elsewhere), "audience"}};
  for (const auto& wrong : cases) {
    TestPeer connected(server(), with(wrong.token));
    TestPeer told(server());
    told.send(authenticate(wrong.token));
    for (TestPeer* peer : {&connected, &told}) {
      const v1::Error error = peer->readToTheEnd().error();
      EXPECT_EQ(error.code(), v1::ERROR_CODE_UNAUTHENTICATED);
      EXPECT_THAT(error.text(), HasSubstr(wrong.why));
    }
  }
  EXPECT_GT(server().metrics.refusals[static_cast<std::size_t>(telemetry::Refusal::token)].value(), 5u);
}

TEST_F(IdentityTest, TokenOfOneSceneReachesNoOther) {
  START_ASKING();
  Claims content = claims("ada", Role::owner);
  content.scene = "other";
  TestPeer peer(server(), with(token(content)));
  v1::ClientMessage list;
  list.mutable_list_scenes();
  const v1::ListScenesResponse scenes = ask(peer, list).list_scenes();
  ASSERT_EQ(scenes.scenes_size(), 1);
  EXPECT_EQ(scenes.scenes(0).name(), "other");
  v1::ClientMessage get;
  get.mutable_get_scene()->set_name("small");
  for (const v1::ClientMessage& message : {get, pause("small"), create("mine"), pause("")})
    EXPECT_EQ(ask(peer, message).error().code(), v1::ERROR_CODE_PERMISSION_DENIED)
        << message.ShortDebugString();
  EXPECT_TRUE(ask(peer, pause("other")).has_control_scene());
  peer.hello("");
  EXPECT_EQ(peer.readUntil(Body::kWelcome).welcome().scene(), "other");
  TestPeer stranger(server(), with(token(content)));
  stranger.hello("small");
  EXPECT_EQ(stranger.readToTheEnd().error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
}

TEST_F(IdentityTest, TokenOfOneSceneLearnsNoNamesOfOthers) {
  START_ASKING();
  Claims content = claims("ada", Role::owner);
  content.scene = "gone";
  TestPeer peer(server(), with(token(content)));
  v1::ClientMessage get, drop, bans, record;
  get.mutable_get_scene()->set_name("gone");
  drop.mutable_delete_scene()->set_name("gone");
  bans.mutable_list_bans()->set_scene("gone");
  record.mutable_start_recording()->set_scene("gone");
  for (const v1::ClientMessage& message : {get, drop, bans, record, pause("gone")}) {
    const v1::Error error = ask(peer, message).error();
    EXPECT_EQ(error.code(), v1::ERROR_CODE_NOT_FOUND) << message.ShortDebugString();
    EXPECT_EQ(error.text(), "there is no scene 'gone'");
  }
  peer.hello("");
  EXPECT_EQ(peer.readToTheEnd().error().text(), "there is no scene 'gone'");
  TestPeer everywhere(server(), with(token("ben", Role::viewer)));
  EXPECT_EQ(ask(everywhere, get).error().text(), "there is no scene 'gone'; there are small, other");
}

TEST_F(IdentityTest, OnlyOwnersByTokenOwnScenes) {
  START_ASKING();
  TestPeer first(server(), with(token("ben", Role::participant)));
  first.join();
  EXPECT_EQ(first.welcome().role(), v1::ROLE_PARTICIPANT);
  TestPeer owner(server(), with(token("ada", Role::owner)));
  owner.join();
  EXPECT_EQ(owner.welcome().role(), v1::ROLE_OWNER);
  TestPeer second(server(), with(token("cy", Role::owner)));
  second.join();
  EXPECT_EQ(second.welcome().role(), v1::ROLE_OWNER);
  owner.leave();
  second.leave();
  first.readUntil([&, left = 0](const Body& message) mutable {
    EXPECT_NE(message.presence().kind(), v1::PRESENCE_KIND_ROLE_CHANGED);
    left += message.presence().kind() == v1::PRESENCE_KIND_LEFT ? 1 : 0;
    return left == 2;
  });
  EXPECT_FALSE(server().scenes.find("small")->roster.owned());
}

TEST_F(IdentityTest, ParticipantsControlNothingUnlessTheServerAllowsIt) {
  const std::vector<v1::ClientMessage> actions = [] {
    std::vector<v1::ClientMessage> all{pause("small"), create("mine"), {}, {}, {}};
    all[2].mutable_start_recording()->set_scene("small");
    all[3].mutable_delete_scene()->set_name("small");
    all[4].mutable_list_bans()->set_scene("small");
    return all;
  }();
  START_ASKING();
  for (const bool inside : {false, true}) {
    TestPeer peer(server(), with(token("ben", Role::participant)));
    if (inside) peer.join();
    for (const v1::ClientMessage& action : actions) {
      const v1::Error error = ask(peer, action).error();
      EXPECT_EQ(error.code(), v1::ERROR_CODE_PERMISSION_DENIED) << action.ShortDebugString();
      EXPECT_THAT(error.text(), HasSubstr("requires the role owner"));
    }
  }
  TestPeer owner(server(), with(token("ada", Role::owner)));
  EXPECT_TRUE(ask(owner, pause("small")).has_control_scene());
  EXPECT_TRUE(ask(owner, create("mine")).has_create_scene());
}

TEST_F(IdentityTest, ParticipantsMayDoWhatTheServerAllows) {
  hosting::ServerOptions options;
  options.participantsMay.create = options.participantsMay.remove = options.participantsMay.control =
      options.participantsMay.own = true;
  START_ASKING(options);
  TestPeer peer(server(), with(token("ben", Role::participant)));
  EXPECT_TRUE(ask(peer, create("mine")).has_create_scene());
  EXPECT_TRUE(ask(peer, pause("mine")).has_control_scene());
  v1::ClientMessage drop;
  drop.mutable_delete_scene()->set_name("mine");
  EXPECT_TRUE(ask(peer, drop).has_delete_scene());
  peer.join();
  EXPECT_EQ(peer.welcome().role(), v1::ROLE_OWNER);
  TestPeer viewer(server(), with(token("cy", Role::viewer)));
  EXPECT_EQ(ask(viewer, pause("small")).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
}

TEST_F(IdentityTest, NameInTheTokenReplacesTheOneInHello) {
  START_ASKING();
  Claims content = claims("ada", Role::participant);
  content.name = "Ada";
  TestPeer peer(server(), with(token(content)));
  v1::Hello hello;
  hello.set_display_name("Another name");
  peer.hello(hello);
  EXPECT_EQ(peer.readUntil(Body::kWelcome).welcome().participants(0).display_name(), "Ada");
  content.name = "a\nb";
  TestPeer hostile(server(), with(token(content)));
  hostile.hello("");
  EXPECT_EQ(hostile.readToTheEnd().error().code(), v1::ERROR_CODE_INVALID_ARGUMENT);
}

TEST_F(IdentityTest, StreamEndsAfterItsTokenUnlessItIsRenewed) {
  START_ASKING();
  TestPeer renewed(server(), with(token("ada", Role::owner)));
  TestPeer forgotten(server(), with(token("ben", Role::participant)));
  renewed.join();
  forgotten.join();
  Claims longer = claims("ada", Role::owner);
  longer.expires = WallClock::now() + 3h;
  EXPECT_TRUE(ask(renewed, authenticate(token(longer))).has_authenticate());
  EXPECT_EQ(ask(renewed, authenticate(token("cy", Role::owner))).error().code(), v1::ERROR_CODE_OUT_OF_ORDER);
  authenticator_->setClock([] { return WallClock::now() + 1h + Authenticator::kExpiryGrace + 1s; });
  const v1::Error error = forgotten.readToTheEnd().error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_UNAUTHENTICATED);
  EXPECT_THAT(error.text(), HasSubstr("expired"));
  renewed.readFrames(2);
  EXPECT_FALSE(renewed.finished());
}

TEST_F(IdentityTest, StreamEndsWhenItsKeyIsRemoved) {
  hosting::ServerOptions options;
  options.helloTimeout = 60s;
  START_ASKING(options);
  const identity::TokenKey next = keys_.make("next.pem");
  authenticator_->reload();
  TestPeer joined(server(), with(token("ada", Role::owner))),
      outside(server(), with(token("ben", Role::viewer)));
  TestPeer other(server(), with(sign(next, claims("cy", Role::participant))));
  joined.join();
  other.join();
  std::filesystem::remove(keys_.path() / "test.pem");
  authenticator_->reload();
  for (TestPeer* peer : {&joined, &outside}) {
    const v1::Error error = peer->readToTheEnd().error();
    EXPECT_EQ(error.code(), v1::ERROR_CODE_UNAUTHENTICATED);
    EXPECT_THAT(error.text(), HasSubstr("key of your token is no longer in use"));
  }
  other.readFrames(2);
  EXPECT_FALSE(other.finished());
}

TEST_F(IdentityTest, LowerTokenLowersTheRoleInTheStreamAndAfterAReturn) {
  START_ASKING();
  TestPeer owner(server(), with(token("ada", Role::owner)));
  owner.join();
  ASSERT_EQ(owner.welcome().role(), v1::ROLE_OWNER);
  owner.send(authenticate(token("ada", Role::participant)));
  EXPECT_EQ(owner.readUntil(Body::kPresence).presence().participant().role(), v1::ROLE_PARTICIPANT);
  v1::ClientMessage drop = remove(owner, false);
  EXPECT_EQ(ask(owner, drop).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
  TestPeer viewer(server(), with(token("ada", Role::viewer)));
  v1::Hello hello;
  hello.set_resume_token(owner.welcome().resume_token());
  hello.set_attempt(2);
  viewer.hello(hello);
  const v1::Welcome welcome = viewer.readUntil(Body::kWelcome).welcome();
  EXPECT_TRUE(welcome.resumed());
  EXPECT_EQ(welcome.role(), v1::ROLE_VIEWER);
}

TEST_F(IdentityTest, ExpiredTokenMakesNoPairingCodeDuringTheGrace) {
  START_ASKING();
  TestPeer owner(server(), with(token("ada", Role::owner)));
  owner.join();
  v1::ClientMessage demand;
  demand.mutable_create_pairing_code();
  EXPECT_TRUE(ask(owner, demand).has_create_pairing_code());
  authenticator_->setClock([] { return WallClock::now() + 1h + 1s; });
  const v1::Error error = ask(owner, demand).error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_UNAUTHENTICATED);
  EXPECT_THAT(error.text(), HasSubstr("expired"));
  EXPECT_FALSE(owner.finished());
}

TEST_F(IdentityTest, BanHoldsForTheSubjectUntilItIsLifted) {
  START_ASKING();
  TestPeer owner(server(), with(token("ada", Role::owner)));
  TestPeer banned(server(), with(token("ben", Role::participant)));
  TestPeer sameSubject(server(), with(token("ben", Role::viewer)));
  owner.join();
  banned.join();
  sameSubject.join();
  owner.send(remove(banned, true));
  for (TestPeer* peer : {&banned, &sameSubject}) {
    const v1::Error error = peer->readToTheEnd().error();
    EXPECT_EQ(error.code(), v1::ERROR_CODE_REMOVED);
    EXPECT_THAT(error.text(), HasSubstr("banned"));
  }
  for (const std::string& resume : {std::string(), banned.welcome().resume_token()}) {
    TestPeer again(server(), with(token("ben", Role::owner)));
    v1::Hello hello;
    hello.set_resume_token(resume);
    again.hello(hello);
    EXPECT_EQ(again.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
  }
  TestPeer outside(server(), with(token("ben", Role::owner)));
  EXPECT_EQ(ask(outside, pause("small")).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
  TestPeer elsewhere(server(), with(token("ben", Role::participant)));
  elsewhere.join("other");

  v1::ClientMessage list, lift;
  list.mutable_list_bans();
  lift.mutable_lift_ban()->set_subject("ben");
  const v1::ListBansResponse bans = ask(owner, list).list_bans();
  ASSERT_EQ(bans.bans_size(), 1);
  EXPECT_EQ(bans.bans(0).subject(), "ben");
  EXPECT_TRUE(ask(owner, lift).has_lift_ban());
  EXPECT_EQ(ask(owner, lift).error().code(), v1::ERROR_CODE_NOT_FOUND);
  TestPeer forgiven(server(), with(token("ben", Role::participant)));
  forgiven.join();
}

TEST_F(IdentityTest, BanDoesNotHoldForTheSameNameInAnotherTenant) {
  START_ASKING();
  Claims one = claims("ben", Role::participant), other = one;
  one.tenant = "studio";
  other.tenant = "school";
  TestPeer owner(server(), with(token("ada", Role::owner))), banned(server(), with(token(one)));
  owner.join();
  banned.join();
  owner.send(remove(banned, true));
  EXPECT_EQ(banned.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
  TestPeer namesake(server(), with(token(other))), again(server(), with(token(one)));
  namesake.join();
  again.hello("");
  EXPECT_EQ(again.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
  v1::ClientMessage list;
  list.mutable_list_bans();
  EXPECT_EQ(ask(owner, list).list_bans().bans(0).tenant(), "studio");
}

TEST_F(IdentityTest, OwnerCannotBanItsOwnSubject) {
  START_ASKING();
  TestPeer owner(server(), with(token("ada", Role::owner)));
  owner.join();
  EXPECT_EQ(ask(owner, remove(owner, true)).error().code(), v1::ERROR_CODE_INVALID_ARGUMENT);
}

TEST_F(IdentityTest, RemovedParticipantCannotReturnWithItsResumeToken) {
  start();  // no identities
  if (IsSkipped()) return;
  TestPeer owner(server()), removed(server());
  owner.join();
  removed.join();
  owner.send(remove(removed, false));
  EXPECT_EQ(removed.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
  TestPeer again(server());
  v1::Hello hello;
  hello.set_resume_token(removed.welcome().resume_token());
  again.hello(hello);
  EXPECT_EQ(again.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
}

TEST_F(IdentityTest, ResumeTokenOfAnotherSubjectDoesNotTakeOver) {
  START_ASKING();
  TestPeer owner(server(), with(token("ada", Role::owner)));
  owner.join();
  TestPeer thief(server(), with(token("eve", Role::participant)));
  v1::Hello hello;
  hello.set_resume_token(owner.welcome().resume_token());
  hello.set_attempt(2);
  thief.hello(hello);
  const v1::Welcome welcome = thief.readUntil(Body::kWelcome).welcome();
  EXPECT_FALSE(welcome.resumed());
  EXPECT_EQ(welcome.role(), v1::ROLE_PARTICIPANT);
  EXPECT_FALSE(owner.finished());
}

TEST_F(IdentityTest, ConnectionsOfASubjectAreLimited) {
  hosting::ServerOptions options;
  options.maxConnectionsPerToken = 2;
  START_ASKING(options);
  TestPeer one(server(), with(token("ada", Role::participant)));
  TestPeer two(server(), with(token("ada", Role::viewer)));
  TestPeer three(server(), with(token("ada", Role::participant)));
  const v1::Error error = three.readToTheEnd().error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), HasSubstr("open connections, its maximum (--profile)"));
  TestPeer other(server(), with(token("ben", Role::participant)));
  other.join();
  two.vanish();
  TestPeer next(server(), with(token("ada", Role::participant)));
  next.join();
}

TEST_F(IdentityTest, CreatedScenesOfATenantAreLimited) {
  hosting::ServerOptions options;
  options.maxScenesPerTenant = 1;
  START_ASKING(options);
  Claims one = claims("ada", Role::owner), other = claims("ben", Role::owner);
  one.tenant = "studio";
  other.tenant = "school";
  TestPeer ada(server(), with(token(one))), ben(server(), with(token(other)));
  EXPECT_TRUE(ask(ada, create("first")).has_create_scene());
  const v1::Error error = ask(ada, create("second")).error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), HasSubstr("--max-scenes-per-tenant"));
  EXPECT_TRUE(ask(ben, create("third")).has_create_scene());
}

TEST_F(IdentityTest, TenantMayCreateAQuarterOfTheScenesByDefault) {
  hosting::ServerOptions options;
  options.maxCreatedScenes = 7;
  START_ASKING(options);
  Claims one = claims("ada", Role::owner), other = claims("ben", Role::owner);
  one.tenant = "studio";
  TestPeer ada(server(), with(token(one))), ben(server(), with(token(other)));
  EXPECT_TRUE(ask(ada, create("first")).has_create_scene());
  EXPECT_THAT(ask(ada, create("second")).error().text(), HasSubstr("--max-scenes-per-tenant"));
  EXPECT_TRUE(ask(ben, create("third")).has_create_scene());
}

TEST_F(IdentityTest, CreatedSceneIsControlledByItsTenantAlone) {
  START_ASKING();
  Claims mine = claims("ada", Role::owner), theirs = claims("ben", Role::owner);
  mine.tenant = "studio";
  TestPeer owner(server(), with(token(mine)));
  ASSERT_TRUE(ask(owner, create("mine")).has_create_scene());
  for (const char* tenant : {"", "school"}) {
    theirs.tenant = tenant;
    TestPeer other(server(), with(token(theirs)));
    v1::ClientMessage drop, record, bans;
    drop.mutable_delete_scene()->set_name("mine");
    record.mutable_start_recording()->set_scene("mine");
    bans.mutable_list_bans()->set_scene("mine");
    for (const v1::ClientMessage& message : {pause("mine"), drop, record, bans}) {
      const v1::Error error = ask(other, message).error();
      EXPECT_EQ(error.code(), v1::ERROR_CODE_PERMISSION_DENIED) << message.ShortDebugString();
      EXPECT_THAT(error.text(), HasSubstr("belongs to another tenant"));
    }
    EXPECT_TRUE(ask(other, pause("small")).has_control_scene()) << "the server started with this one";
    other.hello("mine");
    EXPECT_EQ(other.readUntil(Body::kWelcome).welcome().role(), v1::ROLE_PARTICIPANT);
  }
  EXPECT_TRUE(ask(owner, pause("mine")).has_control_scene());
}

TEST_F(IdentityTest, CodePairsAndItsTokenWorksLater) {
  START_ASKING();
  const std::string code = authenticator_->makeCode(Role::owner, schedule::Clock::now())->code;
  std::string token;
  {
    TestPeer peer(server(), from("a"));
    const v1::AuthenticateResponse paired = ask(peer, pair(code)).authenticate();
    token = paired.token();
    EXPECT_EQ(paired.role(), v1::ROLE_OWNER);
    peer.join();
    EXPECT_EQ(peer.welcome().role(), v1::ROLE_OWNER);
    v1::ClientMessage demand;
    demand.mutable_create_pairing_code();
    const v1::CreatePairingCodeResponse guest = ask(peer, demand).create_pairing_code();
    EXPECT_EQ(guest.role(), v1::ROLE_PARTICIPANT);
    EXPECT_EQ(guest.valid_s(), 300u);
    TestPeer invited(server(), from("b"));
    EXPECT_EQ(ask(invited, pair(guest.code())).authenticate().role(), v1::ROLE_PARTICIPANT);
    invited.join();
    EXPECT_EQ(invited.welcome().role(), v1::ROLE_PARTICIPANT);
    EXPECT_EQ(ask(invited, demand).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
    demand.mutable_create_pairing_code()->set_role(static_cast<v1::Role>(9));
    EXPECT_EQ(ask(peer, demand).error().code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  }
  TestPeer again(server(), with(token));
  again.join();
  EXPECT_EQ(again.welcome().role(), v1::ROLE_OWNER);
}

TEST_F(IdentityTest, WrongCodesCloseTheStreamAndLockTheAddressOut) {
  START_ASKING();
  const std::string code = authenticator_->makeCode(Role::owner, schedule::Clock::now())->code;
  const std::string wrong = code == "000000" ? "000001" : "000000";
  for (int i = 0; i < 5; ++i) {
    TestPeer peer(server(), from("a"));
    peer.send(pair(wrong));
    const v1::Error error = peer.readToTheEnd().error();
    EXPECT_EQ(error.code(), v1::ERROR_CODE_WRONG_PAIRING_CODE);
    EXPECT_TRUE(error.fatal());
    EXPECT_THAT(error.text(), HasSubstr("is wrong"));
  }
  TestPeer locked(server(), from("a"));
  locked.send(pair(code));
  EXPECT_THAT(locked.readToTheEnd().error().text(), HasSubstr("try again in a minute"));
  TestPeer other(server(), from("b"));
  EXPECT_TRUE(ask(other, pair(code)).has_authenticate());
  EXPECT_EQ(server().metrics.refusals[static_cast<std::size_t>(telemetry::Refusal::pairingCode)].value(), 6u);
}

TEST_F(IdentityTest, WithoutIdentitiesOtherMachinesDoNotOwn) {
  hosting::ServerOptions options;
  options.authenticator =
      std::make_shared<Authenticator>(AuthenticatorOptions{.keyDirectory = {}, .stateDirectory = {}});
  start(options);
  if (IsSkipped()) return;
  TestPeer remote(server(), from("a"));
  EXPECT_EQ(ask(remote, create("mine")).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_EQ(ask(remote, pause("small")).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
  v1::ClientMessage upload;
  upload.mutable_upload();
  EXPECT_EQ(ask(remote, upload).error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
  remote.join();
  EXPECT_EQ(remote.welcome().role(), v1::ROLE_PARTICIPANT);
  TestPeer local(server());
  EXPECT_TRUE(ask(local, pause("other")).has_control_scene());
  local.join();
  EXPECT_EQ(local.welcome().role(), v1::ROLE_OWNER);
}

TEST_F(IdentityTest, WithoutAuthenticatorTokensAreIgnored) {
  start();
  if (IsSkipped()) return;
  TestPeer peer(server(), with("a token of another server"));
  peer.join();
  EXPECT_EQ(peer.welcome().role(), v1::ROLE_OWNER);
  TestPeer other(server());
  EXPECT_TRUE(ask(other, authenticate("x")).has_authenticate());
}

}  // namespace
}  // namespace clothstream::session

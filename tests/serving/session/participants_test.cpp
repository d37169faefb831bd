// SPDX-License-Identifier: MIT
// Roles, presence and reconnection, as peers see them.
#include <algorithm>
#include <chrono>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scene/resume_token.h"
#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using namespace schedule;
using namespace scene;
using namespace hosting;

using testing::HasSubstr;
using tests::TestPeer;
using Body = v1::ServerMessage;

// Starts the server. Leaves the test if there is no device.
#define START(...)    \
  start(__VA_ARGS__); \
  if (IsSkipped()) return

class ParticipantsTest : public tests::ServerTest {
 protected:
  static void join(TestPeer& peer, const std::string& name, v1::Role role = v1::ROLE_UNSPECIFIED) {
    v1::Hello hello;
    hello.set_display_name(name);
    hello.set_role(role);
    peer.hello(hello);
    peer.readFrames(1);
  }
  // Hello of a client that reconnects as `lost` with that client's description.
  static v1::Hello returning(const TestPeer& lost) {
    v1::Hello hello;
    hello.set_resume_token(lost.welcome().resume_token());
    hello.set_description_content_id(lost.welcome().description_content_id());
    return hello;
  }
  static v1::Presence presence(TestPeer& peer, v1::PresenceKind kind) {
    return peer
        .readUntil(
            [&](const Body& message) { return message.has_presence() && message.presence().kind() == kind; })
        .presence();
  }
  // Sends a message and returns the error that answers it.
  static v1::Error refusal(TestPeer& peer, v1::ClientMessage message) {
    message.set_request_id(99);
    peer.send(message);
    return peer.readUntil([](const Body& answer) { return answer.request_id() == 99; }).error();
  }
};

TEST_F(ParticipantsTest, WelcomeListsParticipantsAndPresenceAnnouncesChanges) {
  START();
  TestPeer ada(server()), ben(server());
  join(ada, "Ada");
  EXPECT_EQ(ada.welcome().role(), v1::ROLE_OWNER);
  EXPECT_EQ(ada.welcome().hold_ms(), 60'000u);
  EXPECT_EQ(ada.welcome().resume_token().size(), kTokenBytes);
  EXPECT_FALSE(ada.welcome().resumed());
  join(ben, "Ben \xc3\xa9");
  ASSERT_EQ(ben.welcome().participants_size(), 2);
  EXPECT_EQ(ben.welcome().participants(0).display_name(), "Ada");
  EXPECT_EQ(ben.welcome().participants(1).id(), ben.welcome().participant_id());
  const v1::Presence joined = presence(ada, v1::PRESENCE_KIND_JOINED);
  EXPECT_EQ(joined.participant().display_name(), "Ben \xc3\xa9");
  EXPECT_EQ(joined.participant().client_name(), "test");
  EXPECT_EQ(joined.participant().role(), v1::ROLE_PARTICIPANT);
  ada.leave();
  EXPECT_EQ(presence(ben, v1::PRESENCE_KIND_LEFT).reason(), v1::LEAVE_REASON_LEFT);
  EXPECT_EQ(presence(ben, v1::PRESENCE_KIND_ROLE_CHANGED).participant().role(), v1::ROLE_OWNER);
}

TEST_F(ParticipantsTest, RefusesUnprintableNames) {
  START();
  for (const std::string& name :
       {std::string(65, 'x'), std::string("a\nb"), std::string("a\x7f"), std::string("a\xc2\x85"),
        std::string("a\xe2\x80\xae"), std::string("a\xe2\x81\xa6"), std::string("a\0b", 3)}) {
    TestPeer peer(server());
    v1::Hello hello;
    hello.set_display_name(name);
    peer.hello(hello);
    const v1::Error error = peer.readToTheEnd().error();
    EXPECT_EQ(error.code(), v1::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_THAT(error.text(), HasSubstr("hello.displayName"));
  }
  TestPeer peer(server());
  v1::Hello hello;
  hello.set_role(static_cast<v1::Role>(17));
  peer.hello(hello);
  EXPECT_THAT(peer.readToTheEnd().error().text(), HasSubstr("hello.role = 17"));
}

TEST_F(ParticipantsTest, ForbiddenActionIsRefusedAndChangesNothing) {
  START();
  TestPeer owner(server()), participant(server()), viewer(server());
  join(owner, "Ada");
  join(participant, "Ben");
  join(viewer, "Cy", v1::ROLE_VIEWER);

  struct Asked {
    const char* what;
    v1::ClientMessage message;
    const char* role;  // required role
  };
  std::vector<Asked> asked(11);
  asked[0] = {"colliderPoses.colliders", {}, "participant"};
  v1::ParticipantCollider& hand = *asked[0].message.mutable_collider_poses()->add_colliders();
  hand.mutable_sphere()->set_radius(0.1f);
  asked[1] = {"colliderPoses.grabs", {}, "participant"};
  asked[1].message.mutable_collider_poses()->add_grabs();
  asked[2] = {"parameterChange", {}, "participant"};
  asked[2].message.mutable_parameter_change()->mutable_wind()->mutable_value()->set_x(9);
  asked[3] = {"parameterChange.cloths", {}, "participant"};
  asked[3].message.mutable_parameter_change()->add_cloths()->set_damping(1);
  asked[4] = {"controlScene", {}, "owner"};
  asked[4].message.mutable_control_scene()->set_paused(true);
  asked[5] = {"deleteScene", {}, "owner"};
  asked[5].message.mutable_delete_scene()->set_name("small");
  asked[6] = {"setRole", {}, "owner"};
  asked[6].message.mutable_set_role()->set_participant_id(owner.welcome().participant_id());
  asked[6].message.mutable_set_role()->set_role(v1::ROLE_VIEWER);
  asked[7] = {"removeParticipant", {}, "owner"};
  asked[7].message.mutable_remove_participant()->set_participant_id(owner.welcome().participant_id());
  asked[8] = {"startRecording", {}, "owner"};
  asked[8].message.mutable_start_recording();
  asked[9] = {"stopRecording", {}, "owner"};
  asked[9].message.mutable_stop_recording();
  asked[10] = {"wearBody", {}, "participant"};
  asked[10].message.mutable_wear_body();
  for (const Asked& tried : asked)
    for (TestPeer* peer : {&viewer, &participant}) {
      if (peer == &participant && std::string(tried.role) == "participant") continue;
      const v1::Error error = refusal(*peer, tried.message);
      EXPECT_EQ(error.code(), v1::ERROR_CODE_PERMISSION_DENIED) << tried.what;
      EXPECT_THAT(error.text(), HasSubstr(tried.what));
      EXPECT_THAT(error.text(), HasSubstr(std::string("requires the role ") + tried.role));
      EXPECT_FALSE(error.fatal());
    }
  const v1::Scene now = server().unaryCalls.getScene({})->scene();
  EXPECT_EQ(now.environment().wind().x(), 0);
  EXPECT_FALSE(server().unaryCalls.listScenes().scenes(0).paused());
  viewer.readFrames(2);
  for (const v1::ColliderState& collider : viewer.frames().back().colliders)
    EXPECT_EQ(collider.participant_id(), 0u);
  EXPECT_FALSE(owner.finished());
}

TEST_F(ParticipantsTest, ServerLimitsWhatParticipantsMayChange) {
  ServerOptions options;
  options.participantsMay = {.environment = true, .cloths = false, .colliders = false};
  START(options);
  TestPeer owner(server()), participant(server());
  join(owner, "Ada");
  join(participant, "Ben");
  v1::ClientMessage cloth;
  cloth.mutable_parameter_change()->add_cloths()->set_damping(1);
  EXPECT_THAT(refusal(participant, cloth).text(),
              HasSubstr("parameterChange.cloths: requires the role owner"));
  v1::ParameterChange wind;
  wind.mutable_wind()->mutable_value()->set_x(2);
  participant.change(wind);
  EXPECT_EQ(owner.readUntil(Body::kParameterChanged).parameter_changed().participant_id(),
            participant.welcome().participant_id());
  owner.change(cloth.parameter_change());
  EXPECT_EQ(participant
                .readUntil([](const Body& message) {
                  return message.parameter_changed().change().cloths_size() == 1;
                })
                .parameter_changed()
                .participant_id(),
            owner.welcome().participant_id());
}

TEST_F(ParticipantsTest, PauseIsAnnouncedWithItsOwner) {
  START();
  TestPeer owner(server()), viewer(server());
  join(owner, "Ada");
  join(viewer, "Cy", v1::ROLE_VIEWER);
  v1::ClientMessage pause;
  pause.mutable_control_scene()->set_paused(true);
  owner.send(pause);
  const v1::Notice notice = viewer.readUntil(Body::kNotice).notice();
  EXPECT_EQ(notice.kind(), v1::NOTICE_KIND_SCENE_PAUSED);
  EXPECT_EQ(notice.participant_id(), owner.welcome().participant_id());
  // A request from outside the scene, as `clothstream resume` sends it.
  v1::ControlSceneRequest goOn;
  goOn.set_paused(false);
  ASSERT_TRUE(server().unaryCalls.controlScene(goOn).has_value());
  EXPECT_EQ(viewer.readUntil(Body::kNotice).notice().participant_id(), 0u);
}

TEST_F(ParticipantsTest, OnlyOwnersControlASceneWithoutOutsideControl) {
  ServerOptions options;
  options.outsideControl = false;
  START(options);
  v1::ControlSceneRequest reset;
  reset.set_reset(true);
  EXPECT_TRUE(server().unaryCalls.controlScene(reset).has_value());  // the scene has no owner
  TestPeer owner(server()), stranger(server());
  join(owner, "Ada");
  const auto refused = server().unaryCalls.controlScene(reset);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_THAT(refused.error().text(), HasSubstr("not in the scene 'small'"));
  v1::ClientMessage message;
  *message.mutable_control_scene() = reset;
  EXPECT_EQ(refusal(stranger, message).code(), v1::ERROR_CODE_PERMISSION_DENIED);
  owner.send(message);
  EXPECT_EQ(owner.readUntil(Body::kNotice).notice().kind(), v1::NOTICE_KIND_SCENE_RESET);
}

TEST_F(ParticipantsTest, RemovedParticipantIsNotifiedAndClosed) {
  START();
  TestPeer owner(server()), other(server());
  join(owner, "Ada");
  join(other, "Ben");
  v1::ClientMessage message;
  message.mutable_remove_participant()->set_participant_id(other.welcome().participant_id());
  owner.send(message);
  const v1::Error last = other.readToTheEnd().error();
  EXPECT_EQ(last.code(), v1::ERROR_CODE_REMOVED);
  EXPECT_TRUE(last.fatal());
  EXPECT_TRUE(other.finished());
  EXPECT_EQ(presence(owner, v1::PRESENCE_KIND_LEFT).reason(), v1::LEAVE_REASON_REMOVED);
}

TEST_F(ParticipantsTest, ReconnectResumesTheParticipantWithAKeyFrame) {
  START();
  TestPeer watcher(server()), lost(server());
  join(watcher, "Ada");
  join(lost, "Ben");
  const std::uint64_t id = lost.welcome().participant_id();
  lost.poses({{1, 0.5f}});
  const auto hasCollider = [&](const Body&) {
    return std::ranges::any_of(watcher.frames().back().colliders, [&](const v1::ColliderState& collider) {
      return collider.participant_id() == id && collider.position().x() == 0.5f;
    });
  };
  watcher.readUntil(hasCollider);
  lost.vanish();
  EXPECT_TRUE(presence(watcher, v1::PRESENCE_KIND_DISCONNECTED).participant().away());
  EXPECT_EQ(server().unaryCalls.listScenes().scenes(0).participants(), 1u);

  TestPeer back(server());
  back.inherit(lost);
  v1::Hello hello = returning(lost);
  hello.set_display_name("Eve");
  back.hello(hello);
  const v1::Welcome welcome = back.readUntil(Body::kWelcome).welcome();
  EXPECT_TRUE(welcome.resumed());
  EXPECT_EQ(welcome.participant_id(), id);
  EXPECT_EQ(welcome.description_content_id(), lost.welcome().description_content_id());
  EXPECT_EQ(welcome.participants(1).display_name(), "Ben");
  // The description has not changed, so it is not sent again. The next message is a frame.
  EXPECT_TRUE(back.readUntil([](const Body& message) { return message.has_frame() || message.has_chunk(); })
                  .has_frame());
  EXPECT_TRUE(back.frames().front().key);
  EXPECT_EQ(presence(watcher, v1::PRESENCE_KIND_RETURNED).participant().id(), id);
  watcher.readFrames(1);
  EXPECT_TRUE(hasCollider({}));
}

TEST_F(ParticipantsTest, ReconnectSendsAChangedDescription) {
  START();
  TestPeer other(server()), lost(server());
  join(other, "Ada");
  join(lost, "Ben");
  lost.vanish();
  v1::ParameterChange wind;
  wind.mutable_wind()->mutable_value()->set_x(3);
  other.change(wind);
  other.readUntil(Body::kParameterChanged);
  TestPeer back(server());
  back.hello(returning(lost));
  back.readFrames(1);
  EXPECT_TRUE(back.welcome().resumed());
  EXPECT_NE(back.welcome().description_content_id(), lost.welcome().description_content_id());
  EXPECT_EQ(back.description().definition().environment().wind().x(), 3);
}

TEST_F(ParticipantsTest, UnknownTokenCreatesAParticipant) {
  START();
  TestPeer peer(server());
  v1::Hello hello;
  hello.set_resume_token(std::string(16, 'x'));
  hello.set_description_content_id(1);
  peer.hello(hello);
  peer.readFrames(1);
  EXPECT_FALSE(peer.welcome().resumed());
  EXPECT_EQ(peer.welcome().participants_size(), 1);
}

TEST_F(ParticipantsTest, SecondConnectionTakesOver) {
  START();
  TestPeer old(server()), fresh(server());
  join(old, "Ada");
  fresh.hello(returning(old));
  EXPECT_TRUE(fresh.readUntil(Body::kWelcome).welcome().resumed());
  EXPECT_EQ(old.readToTheEnd().error().code(), v1::ERROR_CODE_TAKEN_OVER);
  old.vanish();
  EXPECT_EQ(server().scenes.all().front()->roster.size(), 1u);
  EXPECT_EQ(server().scenes.all().front()->roster.away(), 0u);
}

TEST_F(ParticipantsTest, SilentParticipantKeepsItsPlaceAndReconnects) {
  ServerOptions options;
  options.silence = std::chrono::milliseconds(300);
  START(options);
  TestPeer silent(server());
  silent.acknowledges = false;
  v1::Hello hello;
  silent.hello(hello);
  EXPECT_EQ(silent.readToTheEnd().error().code(), v1::ERROR_CODE_CUT_OFF);
  TestPeer back(server());
  back.hello(returning(silent));
  EXPECT_TRUE(back.readUntil(Body::kWelcome).welcome().resumed());
}

TEST_F(ParticipantsTest, WithoutGracePeriodALostParticipantIsGone) {
  ServerOptions options;
  options.reconnectGrace.place = Clock::duration::zero();
  START(options);
  TestPeer watcher(server()), lost(server());
  join(watcher, "Ada");
  join(lost, "Ben");
  lost.vanish();
  EXPECT_EQ(presence(watcher, v1::PRESENCE_KIND_LEFT).reason(), v1::LEAVE_REASON_TIMED_OUT);
}

TEST_F(ParticipantsTest, ReloadedPageReturnsAsTheSameParticipant) {
  START();
  TestPeer watcher(server()), reloaded(server());
  join(watcher, "Ada");
  join(reloaded, "Ben");
  reloaded.closePage();
  EXPECT_TRUE(presence(watcher, v1::PRESENCE_KIND_DISCONNECTED).participant().away());
  TestPeer back(server());
  back.hello(returning(reloaded));
  EXPECT_TRUE(back.readUntil(Body::kWelcome).welcome().resumed());
}

TEST_F(ParticipantsTest, PlaceOfClosedPageExpiresBeforeThatOfLostConnection) {
  ServerOptions options;
  options.reconnectGrace.page = std::chrono::milliseconds(100);
  START(options);
  TestPeer watcher(server()), closed(server());
  join(watcher, "Ada");
  join(closed, "Ben");
  closed.closePage();
  EXPECT_EQ(presence(watcher, v1::PRESENCE_KIND_LEFT).reason(), v1::LEAVE_REASON_TIMED_OUT);
}

TEST_F(ParticipantsTest, ClosedPageLeavesAtOnceWithoutPageGrace) {
  ServerOptions options;
  options.reconnectGrace.page = Clock::duration::zero();
  START(options);
  TestPeer watcher(server()), closed(server());
  join(watcher, "Ada");
  join(closed, "Ben");
  closed.closePage();
  EXPECT_EQ(presence(watcher, v1::PRESENCE_KIND_LEFT).reason(), v1::LEAVE_REASON_LEFT);
}

TEST_F(ParticipantsTest, TwoHandsGrabTheSameCloth) {
  START();
  TestPeer one(server()), two(server());
  join(one, "Ada");
  join(two, "Ben");
  const auto grabbing = [](float x) {
    v1::ClientMessage message;
    v1::Grab& grab = *message.mutable_collider_poses()->add_grabs();
    grab.set_id(1);
    grab.mutable_pose()->mutable_position()->set_x(x);
    grab.mutable_pose()->mutable_position()->set_y(-0.5f);
    grab.set_reach(1);
    return message;
  };
  one.send(grabbing(-0.3f));
  two.send(grabbing(0.3f));
  std::set<std::uint64_t> holding;
  one.readUntil([&](const Body& message) {
    for (const v1::GrabEvent& event : message.tick_events().grabs())
      if (event.kind() == v1::GRAB_EVENT_KIND_TAKEN && event.vertices() > 0)
        holding.insert(event.participant_id());
    return holding.size() == 2;
  });
  EXPECT_EQ(holding, (std::set{one.welcome().participant_id(), two.welcome().participant_id()}));
}

}  // namespace
}  // namespace clothstream::session

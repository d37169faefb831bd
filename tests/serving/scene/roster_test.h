// SPDX-License-Identifier: MIT
// Fixture: a roster and its members, with a simulated clock.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/mailbox.h"
#include "server/delivery/subscribers.h"
#include "server/scene/inbox.h"
#include "server/scene/newest_poses.h"
#include "server/scene/roster.h"
#include "server/schedule/clock.h"
#include "server/telemetry/metrics.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {

// A connection that joins, and what the roster answers.
struct Member {
  Member() { mailbox->subscribe(nullptr, {.rate = 40}, *metrics); }

  std::vector<v1::ServerMessage> read() {
    std::vector<v1::ServerMessage> messages;
    while (const auto bytes = mailbox->next(Clock::time_point{}))
      messages.emplace_back().ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size()));
    return messages;
  }
  // Presence messages as text: "joined 2", "left 2 timed out", "role 3 owner by 1", "body 2 'avatar'".
  std::vector<std::string> heard() {
    std::vector<std::string> lines;
    for (const v1::ServerMessage& message : read()) {
      const v1::Presence& presence = message.presence();
      constexpr const char* kKinds[] = {"?", "joined", "left", "role", "away", "back", "body"};
      constexpr const char* kReasons[] = {"", "", " timed out", " removed"};
      const bool isRole = presence.kind() == v1::PRESENCE_KIND_ROLE_CHANGED;
      std::string line = fmt::format(
          "{} {}{}{}{}", kKinds[presence.kind()], presence.participant().id(), isRole ? " " : "",
          isRole ? nameOf(fromMessage(presence.participant().role())) : "", kReasons[presence.reason()]);
      if (presence.kind() == v1::PRESENCE_KIND_BODY_CHANGED)
        line += fmt::format(" '{}'", presence.participant().body());
      if (presence.by_participant_id() != 0) line += fmt::format(" by {}", presence.by_participant_id());
      if (presence.kind() == v1::PRESENCE_KIND_DISCONNECTED ||
          presence.kind() == v1::PRESENCE_KIND_RETURNED) {
        EXPECT_EQ(presence.participant().away(), presence.kind() == v1::PRESENCE_KIND_DISCONNECTED);
      }
      lines.push_back(line);
    }
    return lines;
  }

  std::unique_ptr<telemetry::SceneMetrics> metrics = std::make_unique<telemetry::SceneMetrics>();
  std::shared_ptr<delivery::Mailbox> mailbox = std::make_shared<delivery::Mailbox>(nullptr);
  Roster::Admission admission;
};

// Subject of a token, and what the token permits.
struct Person {
  Subject subject;
  Rights rights{};
};

inline Person tokenOf(const char* subject, Ownership ownership, bool onlyViews = false) {
  return {.subject = {.tenant = {}, .name = subject},
          .rights = {.ownership = ownership, .onlyViews = onlyViews}};
}

class RosterTest : public ::testing::Test {
 protected:
  Member join(Role wanted = Role::none, const std::string& token = {}) {
    return join({.subject = {}, .rights = {}}, wanted, token);
  }
  Member join(const Person& person, Role wanted = Role::none, const std::string& token = {}) {
    Member member;
    auto admission = tryJoin(member, wanted, token, 0, person);
    EXPECT_TRUE(admission.has_value());
    if (admission) member.admission = std::move(*admission);
    return member;
  }
  tl::expected<Roster::Admission, Roster::Refusal> tryJoin(Member& member, Role wanted = {},
                                                           const std::string& token = {},
                                                           std::uint32_t attempt = 0,
                                                           const Person& person = {}) {
    return roster.join({.clientName = "test",
                        .displayName = "Ada",
                        .role = wanted,
                        .token = token,
                        .subject = person.subject,
                        .rights = person.rights,
                        .attempt = attempt},
                       member.mailbox, ids, limit, now);
  }
  Member comeBack(const Member& lost, const Person& person = {}) {
    return join(person, Role::none, lost.admission.token);
  }
  void lose(const Member& member) {
    roster.disconnect(*member.mailbox, {std::chrono::seconds(60), std::chrono::seconds(2)}, now);
  }
  void leave(const Member& member) { roster.leave(*member.mailbox, LeaveReason::left, now); }
  messages::Result<void> setRole(const Member& by, std::uint64_t id, Role role) {
    return setRole(by, id, toMessage(role));
  }
  messages::Result<void> setRole(const Member& by, std::uint64_t id, v1::Role role) {
    v1::SetRole message;
    message.set_participant_id(id);
    message.set_role(role);
    return roster.setRole(*by.mailbox, message, now);
  }
  messages::Result<void> remove(const Member& by, std::uint64_t id, bool ban = false) {
    v1::RemoveParticipant message;
    message.set_participant_id(id);
    message.set_ban(ban);
    return roster.remove(*by.mailbox, message, now);
  }
  messages::Result<void> pose(const Member& member, float x) {
    v1::ColliderPoses message;
    message.add_colliders();
    model::ParticipantPoses poses{.colliders = {tests::handAt(1, x)}, .grabs = {{.id = 4}}};
    return newest.post(*member.mailbox, message, poses, {}, now);
  }
  // Inputs of the next tick as text: "1: 1 colliders, 1 grabs".
  std::vector<std::string> inputs() {
    Inputs drained;
    inbox.drain(drained);
    std::vector<std::string> lines;
    for (const Poses& poses : drained.poses)
      lines.push_back(fmt::format("{}: {} colliders, {} grabs", poses.participant,
                                  poses.now.poses.colliders.size(), poses.now.poses.grabs.size()));
    return lines;
  }
  void pass(Clock::duration time) {
    now += time;
    roster.expire(now);
  }

  Clock::time_point now = Clock::time_point{} + std::chrono::seconds(1000);
  std::atomic<std::uint64_t> ids{0};
  std::size_t limit = 8;
  delivery::Subscribers subscribers;
  Inbox inbox;
  NewestPoses newest{subscribers, inbox};
  Roster roster{subscribers, newest, nullptr};
  NewestPoses later{subscribers, inbox};  // for a roster of a later run
};

}  // namespace clothstream::scene

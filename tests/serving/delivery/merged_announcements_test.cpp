// SPDX-License-Identifier: MIT
// Announcements that a subscriber does not read are merged, and lead to the same state.
#include "server/delivery/merged_announcements.h"

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/subscribers.h"
#include "server/messages/scene_message.h"

namespace clothstream::delivery {
namespace {

v1::ServerMessage parsed(const SharedBytes& bytes) {
  v1::ServerMessage message;
  EXPECT_TRUE(message.ParseFromArray(bytes->data(), static_cast<int>(bytes->size())));
  return message;
}

SharedBytes presence(v1::PresenceKind kind, std::uint64_t id, v1::Role role = v1::ROLE_PARTICIPANT) {
  v1::ServerMessage message;
  message.mutable_presence()->set_kind(kind);
  message.mutable_presence()->mutable_participant()->set_id(id);
  message.mutable_presence()->mutable_participant()->set_role(role);
  return serialise(message);
}

SharedBytes contact(v1::ContactEventKind kind, std::uint32_t collider, std::uint64_t tick) {
  v1::ServerMessage message;
  message.mutable_tick_events()->set_tick(tick);
  v1::ContactEvent& event = *message.mutable_tick_events()->add_contacts();
  event.set_kind(kind);
  event.set_collider_id(collider);
  event.set_cloth("sheet");
  return serialise(message);
}

v1::ParameterChange wind(float x) {
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(x);
  return change;
}

std::vector<v1::ServerMessage> mergedOf(const std::deque<SharedBytes>& announcements) {
  std::vector<v1::ServerMessage> messages;
  for (const SharedBytes& bytes : merged(announcements)) messages.push_back(parsed(bytes));
  return messages;
}

TEST(MergedAnnouncements, JoinsChangesOfParametersWithTickAndParticipantOfTheNewest) {
  v1::ParameterChange drag;
  drag.add_cloths()->set_drag(0.5f);
  const auto messages = mergedOf(
      {parametersChanged(wind(1), 5, 7), parametersChanged(drag, 6, 8), parametersChanged(wind(2), 9, 7)});
  ASSERT_EQ(messages.size(), 1u);
  const v1::ParameterChanged& changed = messages[0].parameter_changed();
  EXPECT_EQ(changed.tick(), 9u);
  EXPECT_EQ(changed.participant_id(), 7u);
  EXPECT_EQ(changed.change().wind().value().x(), 2);
  ASSERT_EQ(changed.change().cloths_size(), 1);
  EXPECT_EQ(changed.change().cloths(0).drag(), 0.5f);
}

TEST(MergedAnnouncements, ZeroReplacesAnEarlierNumberOfASpring) {
  v1::ParameterChange stiff, soft;
  stiff.add_cloths()->mutable_bend()->set_damping(3);
  soft.add_cloths()->mutable_bend()->set_stiffness(2);
  messages::mergeChange(soft, stiff);
  EXPECT_EQ(stiff.cloths(0).bend().stiffness(), 2);
  EXPECT_EQ(stiff.cloths(0).bend().damping(), 0);
}

// One change to random parameters of "a", "b" or every cloth.
v1::ParameterChange randomChange(std::mt19937& random) {
  const auto below = [&](unsigned bound) { return static_cast<unsigned>(random() % bound); };
  v1::ParameterChange change;
  const auto number = [&] { return static_cast<float>(below(100)); };
  if (below(3) == 0) change.mutable_gravity()->mutable_value()->set_y(number());
  if (below(3) == 0) change.set_air_density(number());
  for (unsigned i = below(3); i > 0; --i) {
    v1::ClothChange& cloth = *change.add_cloths();
    constexpr const char* kNames[] = {"", "a", "b"};
    cloth.set_name(kNames[below(3)]);
    if (below(2) == 0) cloth.set_drag(number());
    if (below(2) == 0) cloth.mutable_structural()->set_stiffness(number());
    if (below(2) == 0) cloth.mutable_self_collision()->set_radius(number());
    if (below(2) == 0) cloth.mutable_self_collision()->set_friction(number());
    if (below(4) == 0) cloth.mutable_solver()->mutable_xpbd()->set_iterations(below(100));
  }
  return change;
}

TEST(MergedAnnouncements, OneMergedChangeHasTheEffectOfAll) {
  std::mt19937 random(3);
  for (int run = 0; run < 200; ++run) {
    v1::ParameterChange stepByStep, merged;
    for (const char* name : {"a", "b", "c"}) stepByStep.add_cloths()->set_name(name);
    v1::ParameterChange atOnce = stepByStep;
    for (int i = 0; i < 10; ++i) {
      const v1::ParameterChange change = randomChange(random);
      messages::applyChange(change, stepByStep);
      messages::mergeChange(change, merged);
    }
    messages::applyChange(merged, atOnce);
    ASSERT_EQ(atOnce.SerializeAsString(), stepByStep.SerializeAsString()) << merged.DebugString();
    ASSERT_LE(merged.cloths_size(), 3);
  }
}

TEST(MergedAnnouncements, KeepsTheNewestPresenceOfEachParticipant) {
  const auto messages =
      mergedOf({presence(v1::PRESENCE_KIND_JOINED, 1), presence(v1::PRESENCE_KIND_JOINED, 2),
                presence(v1::PRESENCE_KIND_DISCONNECTED, 3),
                presence(v1::PRESENCE_KIND_ROLE_CHANGED, 1, v1::ROLE_OWNER),
                presence(v1::PRESENCE_KIND_LEFT, 2), presence(v1::PRESENCE_KIND_LEFT, 3)});
  ASSERT_EQ(messages.size(), 2u) << "participant 2 joined and left again";
  EXPECT_EQ(messages[0].presence().kind(), v1::PRESENCE_KIND_JOINED);
  EXPECT_EQ(messages[0].presence().participant().role(), v1::ROLE_OWNER);
  EXPECT_EQ(messages[1].presence().kind(), v1::PRESENCE_KIND_LEFT);
  EXPECT_EQ(messages[1].presence().participant().id(), 3u);
}

TEST(MergedAnnouncements, KeepsTheNewestNoticeOfEachSubject) {
  const auto messages =
      mergedOf({notice(v1::NOTICE_KIND_SCENE_PAUSED, "", 1), notice(v1::NOTICE_KIND_ROLLED_BACK, "", 2),
                notice(v1::NOTICE_KIND_SCENE_RESUMED, "", 3), notice(v1::NOTICE_KIND_ROLLED_BACK, "", 4)});
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0].notice().kind(), v1::NOTICE_KIND_SCENE_RESUMED);
  EXPECT_EQ(messages[1].notice().tick(), 4u);
}

TEST(MergedAnnouncements, KeepsTheNewestEventOfEachContactAndBoundsThem) {
  const auto one =
      mergedOf({contact(v1::CONTACT_EVENT_KIND_BEGAN, 1, 5), contact(v1::CONTACT_EVENT_KIND_BEGAN, 2, 6),
                contact(v1::CONTACT_EVENT_KIND_ENDED, 1, 7)});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].tick_events().tick(), 7u);
  ASSERT_EQ(one[0].tick_events().contacts_size(), 2);
  EXPECT_EQ(one[0].tick_events().contacts(1).kind(), v1::CONTACT_EVENT_KIND_ENDED);
  std::deque<SharedBytes> many;
  for (std::uint32_t i = 0; i < 2 * kMaxMergedEvents; ++i)
    many.push_back(contact(v1::CONTACT_EVENT_KIND_BEGAN, i, i));
  const auto events = mergedOf(many);
  ASSERT_EQ(events.size(), 1u);
  ASSERT_EQ(events[0].tick_events().contacts_size(), static_cast<int>(kMaxMergedEvents));
  EXPECT_EQ(events[0].tick_events().contacts(0).collider_id(), kMaxMergedEvents) << "the newest stay";
}

// The events of one tick of a scene with many contacts.
SharedBytes contactsOf(std::uint64_t tick) {
  v1::ServerMessage message;
  message.mutable_tick_events()->set_tick(tick);
  for (std::uint32_t collider = 0; collider < 200; ++collider) {
    v1::ContactEvent& event = *message.mutable_tick_events()->add_contacts();
    event.set_kind(tick % 2 == 0 ? v1::CONTACT_EVENT_KIND_BEGAN : v1::CONTACT_EVENT_KIND_ENDED);
    event.set_participant_id(collider);
    event.set_collider_id(collider);
    event.set_cloth("sheet");
  }
  return serialise(message);
}

TEST(MergedAnnouncements, SubscribersWithTheSameAnnouncementsShareOneMerge) {
  SharedMerges merges;
  const std::deque<SharedBytes> same{contactsOf(1), contactsOf(2)};
  const std::deque<SharedBytes> copy = same, fewer{same.back()};
  const SharedBytes first = merges.of(same).front();
  EXPECT_EQ(merges.of(copy).front(), first);
  EXPECT_EQ(merges.computed(), 1u);
  EXPECT_EQ(merges.of(fewer).size(), 1u);
  EXPECT_EQ(merges.computed(), 2u);
  EXPECT_EQ(merges.of(copy).front(), first) << "after other announcements were merged";
  EXPECT_EQ(merges.computed(), 2u);
}

TEST(Subscribers, SilentOnesGetTheirAnnouncementsMergedOnceForAll) {
  telemetry::SceneMetrics metrics;
  Subscribers subscribers;
  std::vector<std::shared_ptr<Mailbox>> silent;
  for (std::uint64_t i = 1; i <= 60; ++i) {
    silent.push_back(std::make_shared<Mailbox>([] {}));
    silent.back()->subscribe(nullptr, {.rate = 72}, metrics);
    subscribers.add(silent.back(), i);
  }
  // More than twice what makes a mailbox merge.
  std::uint64_t tick = 0;
  for (std::size_t bytes = 0; bytes <= 3 * ControlMessages::kMaxBytes;) {
    const SharedBytes message = contactsOf(++tick);
    bytes += message->size() + ControlMessages::kMessageOverhead;
    subscribers.announce(message);
  }
  std::vector<std::vector<SharedBytes>> all;
  for (const auto& mailbox : silent) {
    auto& messages = all.emplace_back();
    while (const auto message = mailbox->next(Clock::now())) messages.push_back(*message);
    ASSERT_EQ(messages.size(), all.front().size());
    EXPECT_EQ(messages, all.front()) << "a merged message is one object for all mailboxes";
  }
  const v1::ServerMessage merged = parsed(all.front().front());
  EXPECT_EQ(merged.tick_events().contacts_size(), 200);
  EXPECT_EQ(parsed(all.front().back()).tick_events().tick(), tick);
}

TEST(Subscribers, ChangesOfOthersNeverCloseASubscriberThatDoesNotRead) {
  telemetry::SceneMetrics metrics;
  Subscribers subscribers;
  const auto mailbox = std::make_shared<Mailbox>([] {});
  mailbox->subscribe(nullptr, {.rate = 72}, metrics);
  subscribers.add(mailbox, 1);
  constexpr std::uint64_t kChanges = 20'000;
  v1::ParameterChange first;
  first.set_air_density(0.5f);
  subscribers.announce(parametersChanged(first, 1));
  for (std::uint64_t tick = 2; tick <= kChanges; ++tick) {
    subscribers.announce(parametersChanged(wind(static_cast<float>(tick)), tick));
    subscribers.announce(presence(v1::PRESENCE_KIND_JOINED, tick));
    subscribers.announce(presence(v1::PRESENCE_KIND_LEFT, tick));
  }
  ASSERT_FALSE(mailbox->closed());
  // The subscriber reads at last, and arrives at the newest state.
  std::size_t bytes = 0;
  v1::ParameterChange state;
  std::vector<std::uint64_t> present;
  while (const auto message = mailbox->next(Clock::now())) {
    bytes += (*message)->size() + ControlMessages::kMessageOverhead;
    const v1::ServerMessage each = parsed(*message);
    if (each.has_parameter_changed()) messages::mergeChange(each.parameter_changed().change(), state);
    const std::uint64_t id = each.presence().participant().id();
    if (each.presence().kind() == v1::PRESENCE_KIND_JOINED) present.push_back(id);
    if (each.presence().kind() == v1::PRESENCE_KIND_LEFT) std::erase(present, id);
  }
  EXPECT_LE(bytes, ControlMessages::kMaxBytes);
  EXPECT_EQ(state.air_density(), 0.5f);
  EXPECT_EQ(state.wind().value().x(), static_cast<float>(kChanges));
  EXPECT_TRUE(present.empty());
}

}  // namespace
}  // namespace clothstream::delivery

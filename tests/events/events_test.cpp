// SPDX-License-Identifier: MIT
// Events of scenes, and their delivery to a backend that is not always well.
#include "server/events/events.h"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/delivery/mailbox.h"
#include "server/events/webhook.h"
#include "server/scene/live_scene.h"
#include "server/scene/roster.h"
#include "tests/events/receiver.h"
#include "tests/serving/small_scene.h"
#include "tests/support/eventually.h"

namespace clothstream::events {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::ElementsAre;
using tests::eventually;
using tests::ReceivedRequest;
using tests::Receiver;

const std::string kKey(32, 'k');

class EventsTest : public ::testing::Test {
 protected:
  // Times are short, so that the test does not wait.
  static EventsOptions optionsFor(std::uint16_t port) {
    EventsOptions options;
    options.sender.url = *parseUrl(fmt::format("http://127.0.0.1:{}/in?from=test", port));
    options.sender.key = kKey;
    options.sender.server = "here";
    options.sender.agent = "test 1";
    options.sender.firstRetry = 10ms;
    options.sender.longestRetry = 40ms;
    options.usagePeriod = 1h;
    return options;
  }
  void start(EventsOptions options) { events_ = std::make_shared<Events>(std::move(options)); }
  void start() { start(optionsFor(receiver_->port())); }
  void receive(Receiver::Answers answers, std::size_t answerBytes = 2) {
    receiver_ = std::make_unique<Receiver>(std::move(answers), 0, answerBytes);
  }

  std::unique_ptr<scene::LiveScene> makeScene(const std::string& name = "small") {
    auto scene = std::make_unique<scene::LiveScene>(tests::smallScene(name));
    scene->terms.tenant = "acme";
    scene->observe(events_->observe(*scene));
    return scene;
  }
  std::shared_ptr<delivery::Mailbox> join(scene::LiveScene& scene, const std::string& subject = "ada") {
    auto mailbox = std::make_shared<delivery::Mailbox>(nullptr);
    mailboxes_.push_back(mailbox);
    const auto admission = scene.roster.join({.clientName = "test",
                                              .displayName = "Ada",
                                              .role = scene::Role::none,
                                              .token = {},
                                              .subject = {.tenant = "acme", .name = subject}},
                                             mailbox, ids_, 100, scene::Clock::now());
    EXPECT_TRUE(admission);
    return mailbox;
  }
  static void leave(scene::LiveScene& scene, const delivery::Mailbox& mailbox) {
    scene.roster.leave(mailbox, scene::LeaveReason::left, scene::Clock::now());
  }

  // Waits for this number of requests, and returns all.
  std::vector<ReceivedRequest> requests(std::size_t count) {
    EXPECT_TRUE(eventually([&] { return receiver_->requests().size() >= count; }));
    return receiver_->requests();
  }
  bool eventuallyStatus(std::uint64_t delivered, std::uint64_t retried, std::uint64_t dropped) {
    return eventually([&] {
      const scene::ObserverStatus status = events_->status();
      return status.delivered == delivered && status.retried == retried && status.dropped == dropped;
    });
  }
  static std::vector<std::string> typesOf(const std::vector<ReceivedRequest>& requests) {
    std::vector<std::string> types;
    for (const ReceivedRequest& request : requests) types.push_back(json::parse(request.body)["type"]);
    return types;
  }
  static std::vector<std::uint64_t> participantsOf(const std::vector<ReceivedRequest>& requests) {
    std::vector<std::uint64_t> numbers;
    for (const ReceivedRequest& request : requests)
      numbers.push_back(json::parse(request.body)["data"]["participant"]);
    return numbers;
  }

  std::unique_ptr<Receiver> receiver_ = std::make_unique<Receiver>();
  std::shared_ptr<Events> events_;
  std::atomic<std::uint64_t> ids_{0};
  std::vector<std::shared_ptr<delivery::Mailbox>> mailboxes_;
};

TEST_F(EventsTest, SendsSignedEventsInTheirOrder) {
  start();
  const auto scene = makeScene();
  const auto ada = join(*scene), bob = join(*scene, "bob");
  leave(*scene, *ada);
  const std::vector<ReceivedRequest> all = requests(3);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_THAT(typesOf(all), ElementsAre("participant.joined", "participant.joined", "participant.left"));
  EXPECT_THAT(participantsOf(all), ElementsAre(1, 2, 1));

  const json joined = json::parse(all[0].body), left = json::parse(all[2].body);
  EXPECT_THAT(joined["timestamp"].get<std::string>(),
              testing::MatchesRegex("....-..-..T..:..:...[0-9][0-9][0-9]Z"));
  EXPECT_EQ(joined["data"], (json{{"server", "here"},
                                  {"scene", "small"},
                                  {"participant", 1},
                                  {"role", "owner"},
                                  {"subject", "ada"},
                                  {"tenant", "acme"}}));
  EXPECT_TRUE(left["data"]["connectedSeconds"].is_number());
  EXPECT_GE(left["data"]["connectedSeconds"].get<double>(), 0);
  EXPECT_EQ(json::parse(all[1].body)["data"]["role"], "participant");

  for (const ReceivedRequest& request : all) {
    EXPECT_EQ(request.target, "/in?from=test");
    EXPECT_EQ(request.headers.at("content-type"), "application/json");
    EXPECT_EQ(request.headers.at("user-agent"), "test 1");
    EXPECT_EQ(request.headers.at("host"), fmt::format("127.0.0.1:{}", receiver_->port()));
    EXPECT_EQ(request.headers.at("webhook-signature"),
              signatureOf(kKey, request.headers.at("webhook-id"),
                          std::stoll(request.headers.at("webhook-timestamp")), request.body));
  }
  EXPECT_NE(all[0].headers.at("webhook-id"), all[1].headers.at("webhook-id"));
  EXPECT_TRUE(eventuallyStatus(3, 0, 0));
}

TEST_F(EventsTest, RepeatsTheSameEventUntilItIsAccepted) {
  const std::vector<int> answers{500, Receiver::kClose, 408, 429, 302, 204};
  receive([answers](std::size_t number) { return number < answers.size() ? answers[number] : 200; });
  start();
  const auto scene = makeScene();
  join(*scene);
  join(*scene);
  const std::vector<ReceivedRequest> all = requests(answers.size() + 1);
  EXPECT_THAT(participantsOf(all), ElementsAre(1, 1, 1, 1, 1, 1, 2));
  for (std::size_t i = 1; i < answers.size(); ++i) {
    EXPECT_EQ(all[i].headers.at("webhook-id"), all[0].headers.at("webhook-id"));
    EXPECT_EQ(all[i].body, all[0].body);
  }
  EXPECT_NE(all.back().headers.at("webhook-id"), all[0].headers.at("webhook-id"));
  EXPECT_TRUE(eventuallyStatus(2, 5, 0));
}

TEST_F(EventsTest, DropsAnEventThatIsRefused) {
  receive([](std::size_t number) { return number == 0 ? 400 : number == 1 ? 410 : 200; });
  start();
  const auto scene = makeScene();
  for (int i = 0; i < 3; ++i) join(*scene);
  EXPECT_THAT(participantsOf(requests(3)), ElementsAre(1, 2, 3));
  EXPECT_TRUE(eventuallyStatus(1, 0, 2));
}

TEST_F(EventsTest, DropsTheOldestEventsWhenTooManyWait) {
  const std::uint16_t port = receiver_->port();
  receiver_.reset();
  EventsOptions options = optionsFor(port);
  options.sender.maxWaiting = 3;
  start(options);
  const auto scene = makeScene();
  for (int i = 0; i < 8; ++i) join(*scene);
  EXPECT_TRUE(eventually([&] { return events_->status().retried > 2; }));
  EXPECT_EQ(events_->status().dropped, 5u);
  receiver_ = std::make_unique<Receiver>([](std::size_t) { return 200; }, port);
  // An event that was being delivered when the others came has stayed.
  EXPECT_EQ(participantsOf(requests(3)).back(), 8u);
  EXPECT_TRUE(eventually([&] { return events_->status().delivered == 3; }));
  EXPECT_EQ(receiver_->requests().size(), 3u);
}

TEST_F(EventsTest, TriesAgainIfNoAnswerComes) {
  receive([](std::size_t number) { return number == 0 ? Receiver::kNoAnswer : 200; });
  EventsOptions options = optionsFor(receiver_->port());
  options.sender.timeouts = {.connect = 200ms, .answer = 200ms};
  start(options);
  const auto scene = makeScene();
  join(*scene);
  EXPECT_THAT(participantsOf(requests(2)), ElementsAre(1, 1));
  EXPECT_TRUE(eventuallyStatus(1, 1, 0));
}

TEST_F(EventsTest, AcceptsALongAnswerWithoutReadingIt) {
  receive([](std::size_t) { return 200; }, std::size_t{16} << 20);
  start();
  const auto scene = makeScene();
  join(*scene);
  EXPECT_TRUE(eventuallyStatus(1, 0, 0));
  EXPECT_EQ(receiver_->requests().size(), 1u);
}

TEST_F(EventsTest, ReportsWhatASceneHasUsedSinceTheLastTime) {
  EventsOptions options = optionsFor(receiver_->port());
  options.usagePeriod = 20ms;
  start(options);
  auto used = makeScene("used");
  const auto unused = makeScene("unused");
  const auto sum = [&](const char* what) {
    double total = 0;
    for (const ReceivedRequest& request : receiver_->requests()) {
      const json data = json::parse(request.body)["data"];
      EXPECT_EQ(data["scene"], "used");
      EXPECT_EQ(data["tenant"], "acme");
      EXPECT_FALSE(data.contains("participant") || data.contains("role") || data.contains("subject"));
      total += data[what].get<double>();
    }
    return total;
  };
  used->metrics.deviceTotal.record(0.25);
  used->metrics.sentBytes.add(1000);
  EXPECT_TRUE(eventually([&] { return sum("deviceSeconds") == 0.25 && sum("sentBytes") == 1000; }));
  used->metrics.sentBytes.add(500);
  EXPECT_TRUE(eventually([&] { return sum("sentBytes") == 1500; }));
  used->metrics.deviceTotal.record(0.5);
  used.reset();
  EXPECT_TRUE(eventually([&] { return sum("deviceSeconds") == 0.75; }));
  EXPECT_THAT(typesOf(receiver_->requests()), testing::Each("scene.usage"));
  EXPECT_LE(receiver_->requests().size(), 4u) << "nothing is reported without use";
}

TEST_F(EventsTest, EndOfASceneReportsParticipantsAndThenUsage) {
  start();
  auto scene = makeScene();
  join(*scene);
  scene->metrics.deviceTotal.record(0.125);
  scene.reset();
  const std::vector<ReceivedRequest> all = requests(3);
  EXPECT_THAT(typesOf(all), ElementsAre("participant.joined", "participant.left", "scene.usage"));
  EXPECT_EQ(json::parse(all.back().body)["data"]["deviceSeconds"], 0.125);
}

TEST_F(EventsTest, DeliversWaitingEventsAtTheEnd) {
  std::atomic<bool> down{true};
  receive([&](std::size_t) { return down ? 503 : 200; });
  EventsOptions options = optionsFor(receiver_->port());
  options.sender.firstRetry = options.sender.longestRetry = 1h;
  options.patience = 20s;
  start(options);
  auto scene = makeScene();
  join(*scene);
  requests(1);
  down = false;
  scene.reset();
  events_.reset();
  EXPECT_THAT(typesOf(receiver_->requests()),
              ElementsAre("participant.joined", "participant.joined", "participant.left"));
}

TEST_F(EventsTest, EndsInTimeIfTheBackendDoesNotAnswer) {
  receive([](std::size_t) { return Receiver::kNoAnswer; });
  EventsOptions options = optionsFor(receiver_->port());
  options.patience = 100ms;
  start(options);
  auto scene = makeScene();
  join(*scene);
  requests(1);
  const auto begin = std::chrono::steady_clock::now();
  scene.reset();
  events_.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

// Does not wait at the end for a lookup, which cannot be interrupted.
TEST_F(EventsTest, UnknownNamesAreTriedAgain) {
  EventsOptions options = optionsFor(1);
  options.sender.url = *parseUrl("http://no-such-name.invalid/");
  options.patience = 10ms;
  start(options);
  const auto scene = makeScene();
  join(*scene);
  EXPECT_TRUE(eventually([&] { return events_->status().retried >= 2; }));
}

}  // namespace
}  // namespace clothstream::events

// SPDX-License-Identifier: MIT
// Recordings that start and end while the scene runs.
#include "server/recording/scene_journal.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/recordings.h"
#include "server/recording/resimulate.h"
#include "server/scene/scene_host.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/serving/small_scene.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::recording {
namespace {

using ::testing::HasSubstr;

class SceneJournalTest : public tests::GpuTest {
 protected:
  void SetUp() override {
    tests::GpuTest::SetUp();
    if (IsSkipped()) return;
    make({});
  }
  void TearDown() override {
    if (publisher) publisher->drain();
    host.reset();
  }
  void make(RecorderOptions options, bool always = false) {
    if (publisher) publisher->drain();
    host.reset();
    options.directory = directory.path();
    options.serverName = "test";
    journal = std::make_shared<SceneJournal>("small", options, always);
    live = std::make_unique<scene::LiveScene>(tests::smallScene(), scene::SceneTerms{}, journal);
    publisher = std::make_unique<delivery::FramePublisher>();
    host = std::make_unique<scene::SceneHost>(tests::device(), *live, *publisher);
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) {
      now += std::chrono::seconds(1);
      host->begin(now);
      host->finish();
      publisher->drain();
    }
  }
  void grab(bool holds) {
    model::ParticipantPoses poses;
    if (holds)
      poses.grabs.push_back({.id = 1,
                             .pose = {.position = {0, -0.5f, 0.2f}},
                             .radius = 0.2f,
                             .place = model::GrabPlace{.point = {.triangle = 80, .second = 0.5f}}});
    live->inbox.postPoses(3, poses, now);
  }
  // Kinds of all notices from now on that a participant of the scene receives.
  std::shared_ptr<delivery::Mailbox> listen() {
    auto mailbox = std::make_shared<delivery::Mailbox>([] {});
    live->subscribers.add(mailbox);
    mailbox->subscribe(live->description(), live->shape(), live->metrics);
    return mailbox;
  }
  void read(delivery::Mailbox& mailbox, std::vector<v1::NoticeKind>& kinds) const {
    while (const auto bytes = mailbox.next(now)) {
      v1::ServerMessage message;
      ASSERT_TRUE(message.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())));
      if (message.has_notice()) kinds.push_back(message.notice().kind());
    }
  }
  std::string pathOf(const std::string& file) const { return (directory.path() / file).string(); }
  Resimulation again(const std::string& file) const {
    auto result = resimulate({.path = pathOf(file),
                              .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                              .interrupted = [] { return false; },
                              .progress = {}});
    EXPECT_TRUE(result.has_value()) << result.error();
    return result ? *result : Resimulation{};
  }

  e2e::TemporaryDirectory directory;
  std::shared_ptr<SceneJournal> journal;
  std::unique_ptr<scene::LiveScene> live;
  std::unique_ptr<delivery::FramePublisher> publisher;
  std::unique_ptr<scene::SceneHost> host;
  schedule::Clock::time_point now = schedule::Clock::now();
};

TEST_F(SceneJournalTest, ResimulatesARecordingThatStartsInTheMiddle) {
  grab(true);
  ticks(30);
  model::ParameterChange change = tests::wind(2);
  change.cloths.push_back({.numbers = {{parameters::ClothNumber::damping, 1.5f}}});
  ASSERT_TRUE(live->inbox.postChange({.participant = 3, .change = change}));
  ticks(5);
  const auto file = journal->start("mid");
  ASSERT_TRUE(file) << file.error().text;
  EXPECT_EQ(*file, "mid.mcap");
  EXPECT_FALSE(journal->active());
  ticks(20);
  EXPECT_TRUE(journal->active());
  grab(false);
  ticks(20);
  live->resetRequested = true;
  ticks(20);
  publisher->drain();
  const auto stopped = journal->stop();
  ASSERT_TRUE(stopped) << stopped.error().text;
  EXPECT_EQ(stopped->file(), "mid.mcap");
  EXPECT_EQ(stopped->bytes(), std::filesystem::file_size(pathOf("mid.mcap")));
  EXPECT_FALSE(journal->active());
  ticks(3);
  const Resimulation result = again("mid.mcap");
  EXPECT_EQ(result.ticks, 60u);
  EXPECT_EQ(result.different, 0u) << toText(result);
  EXPECT_TRUE(result.missing.empty());

  auto reader = RecordingReader::open(pathOf("mid.mcap"));
  ASSERT_TRUE(reader);
  for (auto message = reader->next(); *message; message = reader->next()) {
    if ((*message)->topic != Topic::frames) continue;
    EXPECT_TRUE(isKeyFrame((*message)->bytes));  // the first frame
    break;
  }

  // A second recording.
  EXPECT_TRUE(journal->start(""));
  ticks(5);
  const auto next = journal->stop();
  ASSERT_TRUE(next);
  EXPECT_EQ(again(next->file()).ticks, 5u);
  EXPECT_EQ(journal->counts().complete, 2u);
}

TEST_F(SceneJournalTest, OmitsFramesOfAPausedScene) {
  ticks(1);
  ASSERT_TRUE(journal->start("paused"));
  ticks(10);
  const std::uint64_t frames = live->metrics.frames.value();
  const auto late = listen();
  while (late->next(now)) {
  }
  now += std::chrono::seconds(1);
  host->encodePausedFrame(now);
  publisher->drain();
  EXPECT_EQ(live->metrics.frames.value(), frames + 1);
  EXPECT_TRUE(late->next(now));
  ticks(10);
  ASSERT_TRUE(journal->stop());
  live->subscribers.remove(*late);
  EXPECT_EQ(again("paused.mcap").ticks, 20u);
  EXPECT_EQ(again("paused.mcap").different, 0u);
  auto reader = RecordingReader::open(pathOf("paused.mcap"));
  ASSERT_TRUE(reader);
  EXPECT_TRUE(reader->check());
  std::size_t recorded = 0;
  for (auto message = reader->next(); *message; message = reader->next())
    recorded += (*message)->topic == Topic::frames ? 1 : 0;
  EXPECT_EQ(recorded, 20u);
}

TEST_F(SceneJournalTest, RefusesImpossibleRequests) {
  for (const char* name : {"../up", "a/b", ".", "a.mcap", "a b", "\n"}) {
    const auto refused = journal->start(name);
    ASSERT_FALSE(refused) << name;
    EXPECT_THAT(refused.error().text, HasSubstr("must be 1 to 64 characters out of"));
  }
  EXPECT_FALSE(journal->start(std::string(65, 'a')));
  EXPECT_THAT(journal->stop().error().text, HasSubstr("'small' is not being recorded"));
  ASSERT_TRUE(journal->start("one"));
  EXPECT_THAT(journal->start("two").error().text, HasSubstr("is already being recorded to one.mcap"));
  // The scene did not run in between.
  EXPECT_THAT(journal->stop().error().text, HasSubstr("has not run since"));
  EXPECT_FALSE(std::filesystem::exists(pathOf("one.mcap")));

  ASSERT_TRUE(journal->start("one"));
  ticks(2);
  ASSERT_TRUE(journal->stop());
  const auto size = std::filesystem::file_size(pathOf("one.mcap"));
  EXPECT_THAT(journal->start("one").error().text, HasSubstr("a recording one.mcap already exists"));
  EXPECT_EQ(std::filesystem::file_size(pathOf("one.mcap")), size);

  make({}, true);
  EXPECT_THAT(journal->start("two").error().text, HasSubstr("is recorded by the server all the time"));
  EXPECT_THAT(journal->stop().error().text, HasSubstr("is recorded by the server all the time"));
}

TEST_F(SceneJournalTest, NotifiesParticipantsOfStartAndEnd) {
  std::vector<v1::NoticeKind> kinds;
  const auto mailbox = listen();
  ticks(2);
  ASSERT_TRUE(journal->start(""));
  ticks(2);
  read(*mailbox, kinds);
  EXPECT_THAT(kinds, ::testing::ElementsAre(v1::NOTICE_KIND_RECORDING_STARTED));
  ASSERT_TRUE(journal->stop());
  ticks(2);
  read(*mailbox, kinds);
  EXPECT_THAT(kinds,
              ::testing::ElementsAre(v1::NOTICE_KIND_RECORDING_STARTED, v1::NOTICE_KIND_RECORDING_STOPPED));
  live->subscribers.remove(*mailbox);
}

TEST_F(SceneJournalTest, ContinuesInAnotherFileAtTheLimit) {
  RecorderOptions limited;
  limited.maxBytes = 260'000;
  make(limited, true);
  std::vector<v1::NoticeKind> kinds;
  const auto mailbox = listen();
  int run = 0;
  while (journal->counts().complete < 2) {
    ticks(1);
    ++run;
    EXPECT_TRUE(journal->active());
    read(*mailbox, kinds);
    ASSERT_LT(run, 20'000);
  }
  // Participants are not notified of the files in between.
  EXPECT_THAT(kinds, ::testing::ElementsAre(v1::NOTICE_KIND_RECORDING_STARTED));
  live->subscribers.remove(*mailbox);
  publisher->drain();
  host.reset();
  while (journal->counts().running > 0) std::this_thread::yield();
  std::uint64_t all = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
    const Resimulation result = again(entry.path().filename().string());
    EXPECT_EQ(result.different, 0u) << toText(result);
    EXPECT_TRUE(result.missing.empty());
    all += result.ticks;
  }
  EXPECT_EQ(all, static_cast<std::uint64_t>(run));
}

// The switch to another file changes no state, although a grab holds cloth.
TEST_F(SceneJournalTest, SplitsTheFileWhileAGrabHolds) {
  const auto simulate = [&](std::uint64_t maxBytes, const auto& isEnough) {
    RecorderOptions limited;
    limited.maxBytes = maxBytes;
    make(limited, true);
    grab(true);
    std::vector<std::uint64_t> states;
    while (!isEnough(states.size()) && states.size() < 20'000) {
      ticks(1);
      states.push_back(host->status().stateHash);
    }
    return states;
  };
  std::size_t end = 0;
  const std::vector<std::uint64_t> split = simulate(240'000, [&](std::size_t ticks) {
    if (end == 0 && journal->counts().complete > 0) end = ticks + 40;
    return end > 0 && ticks >= end;
  });
  ASSERT_GT(end, 40u);
  publisher->drain();
  host.reset();
  const std::uint64_t files = journal->counts().running + journal->counts().complete;
  EXPECT_GE(files, 2u);
  while (journal->counts().running > 0) std::this_thread::yield();
  for (const auto& file : std::filesystem::directory_iterator(directory.path())) {
    const Resimulation result = again(file.path().filename().string());
    EXPECT_EQ(result.different, 0u) << file.path() << ": " << toText(result);
    EXPECT_TRUE(result.missing.empty());
  }
  EXPECT_EQ(split, simulate(0, [&](std::size_t ticks) { return ticks == split.size(); }));
}

// The device's thread gives up a scene whose ticks fail. A later participant gets another host.
TEST_F(SceneJournalTest, RecordsTheNextHostOfAScene) {
  const auto another = [&] {
    publisher->drain();
    host.reset();
    EXPECT_FALSE(journal->active());
    host = std::make_unique<scene::SceneHost>(tests::device(), *live, *publisher);
  };
  ticks(1);
  ASSERT_TRUE(journal->start("before"));
  ticks(3);
  another();
  const auto stopped = journal->stop();
  ASSERT_FALSE(stopped);
  EXPECT_THAT(stopped.error().text, HasSubstr("'small' is not being recorded"));
  ticks(1);
  ASSERT_TRUE(journal->start("after"));
  ticks(4);
  ASSERT_TRUE(journal->stop());
  // A request that has not started waits for the other recording.
  ASSERT_TRUE(journal->start("waits"));
  another();
  ticks(5);
  ASSERT_TRUE(journal->stop());
  while (journal->counts().running > 0) std::this_thread::yield();
  EXPECT_EQ(again("before.mcap").ticks, 3u);
  EXPECT_EQ(again("after.mcap").ticks, 4u);
  EXPECT_EQ(again("waits.mcap").ticks, 5u);

  make({}, true);
  ticks(6);
  another();
  ticks(7);
  EXPECT_TRUE(journal->active());
  publisher->drain();
  host.reset();
  while (journal->counts().running > 0) std::this_thread::yield();
  EXPECT_EQ(journal->counts().complete, 2u);
}

TEST_F(SceneJournalTest, GivesOneRecordingForSimultaneousRequests) {
  ticks(1);
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> got{0};
    std::vector<std::thread> askers;
    for (int i = 0; i < 4; ++i)
      askers.emplace_back([&, i] { got += journal->start(fmt::format("{}_{}", round, i)) ? 1 : 0; });
    for (std::thread& asker : askers) asker.join();
    EXPECT_EQ(got, 1);
    ticks(1);
    ASSERT_TRUE(journal->stop());
  }
  const auto files = std::filesystem::directory_iterator(directory.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 20);
}

TEST_F(SceneJournalTest, CountsRecordingsOfRemovedScenesWithoutKeepingThem) {
  Recordings recordings({.directory = directory.path(), .serverName = "test"}, true);
  std::weak_ptr<scene::Journal> gone;
  for (int scene = 1; scene <= 3; ++scene) {
    publisher->drain();
    host.reset();
    live.reset();
    auto added = recordings.add("small");
    EXPECT_TRUE(gone.expired());
    gone = added;
    live = std::make_unique<scene::LiveScene>(tests::smallScene(), scene::SceneTerms{.created = true},
                                              std::move(added));
    host = std::make_unique<scene::SceneHost>(tests::device(), *live, *publisher);
    ticks(3);
    publisher->drain();
    host.reset();
    const auto complete = fmt::format("running 0  complete {}  failed 0", scene);
    while (recordings.report().find(complete) == std::string::npos) std::this_thread::yield();
  }
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory.path())) bytes += entry.file_size();
  EXPECT_THAT(recordings.report(), HasSubstr(fmt::format("complete 3  failed 0  bytes {}\n", bytes)));
}

TEST_F(SceneJournalTest, ResimulatesHeldWinds) {
  const auto hold = [&](float x, float speed) {
    model::HeldWind fan{{.pose = {.position = {x, -1.2f, 0.1f}}, .speed = speed}, 1};
    live->inbox.postPoses(3, {.winds = {fan}}, now);
    ticks(1);
  };
  ticks(1);
  const auto file = journal->start("winds");
  ASSERT_TRUE(file) << file.error().text;
  for (int i = 0; i < 20; ++i) hold(0.01f * static_cast<float>(i), 5);
  live->inbox.postPoses(3, {}, now);
  ticks(10);
  for (int i = 0; i < 5; ++i) hold(0, 100);
  publisher->drain();
  ASSERT_TRUE(journal->stop());
  EXPECT_EQ(live->metrics.rollbacks.value(), 0u);
  const Resimulation result = again(*file);
  EXPECT_EQ(result.ticks, 35u);
  EXPECT_EQ(result.different, 0u) << toText(result);

  auto reader = RecordingReader::open(pathOf(*file));
  ASSERT_TRUE(reader);
  std::vector<float> speeds;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    if ((*message)->topic != Topic::ticks) continue;
    v1::RecordedTick tick;
    ASSERT_TRUE(tick.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size())));
    const float speed = tick.winds().empty() ? 0 : tick.winds(0).speed();
    if (speeds.empty() || speeds.back() != speed) speeds.push_back(speed);
  }
  const float room = std::min(100.0f, live->roomForWind(live->start(), live->start().substeps));
  EXPECT_THAT(speeds, ::testing::ElementsAre(5, 0, ::testing::FloatEq(room)));
}

// Changes of the substeps: in the middle of a recording, before it starts, around a rollback, and after the
// device was lost.
TEST_F(SceneJournalTest, ResimulatesTicksWithFewerSubsteps) {
  ticks(5);
  host->setWork({.frameDivisor = 2, .substeps = 9});
  ticks(3);
  const auto file = journal->start("substeps");
  ASSERT_TRUE(file) << file.error().text;
  ticks(20);
  host->setWork({.frameDivisor = 4, .substeps = 6});
  ticks(20);
  model::ParameterChange change;
  change.cloths.push_back({.numbers = {{parameters::ClothNumber::damping, 1.5f}}});
  ASSERT_TRUE(live->inbox.postChange({.participant = 3, .change = change}));
  ticks(20);
  publisher->drain();
  host->release();
  host->rebuild(std::make_unique<scene::SceneOnDevice>(tests::device(), live->start(), publisher->workers()),
                "the device was lost");
  ticks(20);
  host->setWork(live->allWork());
  ticks(5);
  ASSERT_TRUE(journal->stop());
  const Resimulation result = again(*file);
  EXPECT_EQ(result.ticks, 85u);
  EXPECT_EQ(result.different, 0u) << toText(result);
  EXPECT_TRUE(result.missing.empty());

  auto reader = RecordingReader::open(pathOf(*file));
  ASSERT_TRUE(reader);
  std::vector<std::uint32_t> substeps;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    if ((*message)->topic != Topic::ticks) continue;
    v1::RecordedTick tick;
    ASSERT_TRUE(tick.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size())));
    if (substeps.empty() || substeps.back() != tick.substeps()) substeps.push_back(tick.substeps());
  }
  EXPECT_THAT(substeps, ::testing::ElementsAre(9u, 6u, 0u));
}

}  // namespace
}  // namespace clothstream::recording

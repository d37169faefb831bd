// SPDX-License-Identifier: MIT
// Recordings that begin and end while the scene runs.
#include "server/recording/scene_journal.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/resimulate.h"
#include "server/stream/scene_host.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/stream/small_scene.h"
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
    if (packer) packer->drain();
    host.reset();
  }
  void make(RecorderOptions options, bool always = false) {
    if (packer) packer->drain();
    host.reset();
    options.directory = directory.path();
    options.serverName = "test";
    journal = std::make_shared<SceneJournal>("small", options, always);
    live = std::make_unique<stream::LiveScene>(tests::smallScene(), false, journal);
    packer = std::make_unique<stream::FramePacker>(encode::FrameEncoder::kSlots, [] {});
    host = std::make_unique<stream::SceneHost>(tests::device(), *live, *packer);
  }
  void ticks(int count) {
    for (int i = 0; i < count; ++i) {
      now += std::chrono::seconds(1);
      host->begin(now);
      host->finish();
      packer->drain();
    }
  }
  void grab(bool holds) {
    scene::ParticipantPoses poses;
    if (holds)
      poses.grabs.push_back({.id = 1, .pose = {.position = {0, -0.5f, 0}}, .radius = 0.2f, .reach = 0.5f});
    live->inbox.postPoses(3, poses, now);
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
  std::unique_ptr<stream::LiveScene> live;
  std::unique_ptr<stream::FramePacker> packer;
  std::unique_ptr<stream::SceneHost> host;
  stream::Clock::time_point now = stream::Clock::now();
};

TEST_F(SceneJournalTest, WhatBeginsInTheMiddleIsSimulatedAgainToTheBit) {
  grab(true);
  ticks(30);
  scene::ParameterChange change = tests::wind(2);
  change.cloths.push_back({.damping = 1.5f});
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
  live->resetWanted = true;
  ticks(20);
  packer->drain();
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
    EXPECT_TRUE(isKeyFrame((*message)->bytes));  // the first
    break;
  }

  // And another one.
  EXPECT_TRUE(journal->start(""));
  ticks(5);
  const auto next = journal->stop();
  ASSERT_TRUE(next);
  EXPECT_EQ(again(next->file()).ticks, 5u);
  EXPECT_EQ(journal->counts().complete, 2u);
}

TEST_F(SceneJournalTest, WhatCannotBeIsRefused) {
  for (const char* name : {"../up", "a/b", ".", "a.mcap", "a b", "\n"}) {
    const auto refused = journal->start(name);
    ASSERT_FALSE(refused) << name;
    EXPECT_THAT(refused.error().text, HasSubstr("must be 1 to 64 characters out of"));
  }
  EXPECT_FALSE(journal->start(std::string(65, 'a')));
  EXPECT_THAT(journal->stop().error().text, HasSubstr("'small' is not recorded"));
  ASSERT_TRUE(journal->start("one"));
  EXPECT_THAT(journal->start("two").error().text, HasSubstr("is recorded already, to one.mcap"));
  // The scene did not run meanwhile.
  EXPECT_THAT(journal->stop().error().text, HasSubstr("did not run"));
  EXPECT_FALSE(std::filesystem::exists(pathOf("one.mcap")));

  ASSERT_TRUE(journal->start("one"));
  ticks(2);
  ASSERT_TRUE(journal->stop());
  const auto size = std::filesystem::file_size(pathOf("one.mcap"));
  EXPECT_THAT(journal->start("one").error().text, HasSubstr("there is a recording one.mcap already"));
  EXPECT_EQ(std::filesystem::file_size(pathOf("one.mcap")), size);

  make({}, true);
  EXPECT_THAT(journal->start("two").error().text, HasSubstr("is recorded by the server all the time"));
  EXPECT_THAT(journal->stop().error().text, HasSubstr("is recorded by the server all the time"));
}

TEST_F(SceneJournalTest, EverybodyIsToldWhenItBeginsAndEnds) {
  std::vector<v1::NoticeKind> kinds;
  const auto mailbox = std::make_shared<stream::Mailbox>([] {});
  ASSERT_EQ(live->audience.join(mailbox, 5), stream::Audience::Joining::joined);
  mailbox->subscribe(live->description(), live->shape(), live->metrics);
  const auto read = [&] {
    while (const auto bytes = mailbox->next(now)) {
      v1::ServerMessage message;
      ASSERT_TRUE(message.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())));
      if (message.has_notice()) kinds.push_back(message.notice().kind());
    }
  };
  ticks(2);
  ASSERT_TRUE(journal->start(""));
  ticks(2);
  read();
  EXPECT_THAT(kinds, ::testing::ElementsAre(v1::NOTICE_KIND_RECORDING_STARTED));
  ASSERT_TRUE(journal->stop());
  ticks(2);
  read();
  EXPECT_THAT(kinds,
              ::testing::ElementsAre(v1::NOTICE_KIND_RECORDING_STARTED, v1::NOTICE_KIND_RECORDING_STOPPED));
  live->audience.leave(*mailbox);
}

TEST_F(SceneJournalTest, AtTheLimitItGoesOnInAnotherFile) {
  RecorderOptions limited;
  limited.maxBytes = 260'000;
  make(limited, true);
  int run = 0;
  while (journal->counts().complete < 2) {
    ticks(20);
    run += 20;
    ASSERT_LT(run, 20'000);
  }
  packer->drain();
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

}  // namespace
}  // namespace clothstream::recording

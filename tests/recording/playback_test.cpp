// SPDX-License-Identifier: MIT
// Playback of recordings: frames in order and on time, from any time on, and from damaged files.
#include "server/recording/playback.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_writer.h"
#include "server/scene/live_scene.h"
#include "tests/codec/motion.h"
#include "tests/recording/sample.h"
#include "tests/recording/viewer.h"

namespace clothstream::recording {
namespace {

using ::testing::HasSubstr;

constexpr double kLength = (kSampleFrames - 1) / double{kSampleRate};

class PlaybackTest : public ::testing::Test {
 protected:
  void play(std::string bytes, const PlaybackOptions& options = {}) {
    playback = std::make_shared<Playback>(streamOf(std::move(bytes)), options);
    scene = std::make_unique<scene::LiveScene>("sample", playback);
  }
  void play(const PlaybackOptions& options = {}) { play(sampleRecording(kSampleFrames), options); }
  void join() {
    viewer = std::make_unique<Viewer>(*scene);
    step(0);
  }
  // Advances the clock in steps of a millisecond.
  void pass(double time) {
    for (const Clock::time_point end = now + seconds(time); now < end;) step(0.001);
  }
  void step(double time) {
    now += seconds(time);
    playback->step(*scene, now);
    if (viewer) viewer->read(now);
  }
  messages::Result<void> control(const std::function<void(v1::ControlSceneRequest&)>& fill) {
    v1::ControlSceneRequest request;
    fill(request);
    auto controlled = playback->control(request);
    step(0);
    return controlled;
  }
  void seek(double to) {
    ASSERT_TRUE(control([&](auto& request) { request.set_seek(to); }));
  }
  void pause(bool paused) {
    scene->paused = paused;
    step(0);
  }
  // Frame of the recording that equals the decoded one.
  static std::size_t frameOf(const Seen& seen) {
    static const std::vector<std::uint64_t> hashes = [] {
      std::vector<std::uint64_t> all;
      auto reader = readerOf(sampleRecording(kSampleFrames));
      for (auto message = reader.next(); *message; message = reader.next()) {
        if ((*message)->topic != Topic::frames) continue;
        v1::Frame frame;
        frame.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size()));
        all.push_back(frame.reconstruction_hash());
      }
      return all;
    }();
    return static_cast<std::size_t>(std::ranges::find(hashes, seen.hash) - hashes.begin());
  }

  std::shared_ptr<Playback> playback;
  std::unique_ptr<scene::LiveScene> scene;
  std::unique_ptr<Viewer> viewer;
  Clock::time_point now = Clock::now();
};

TEST_F(PlaybackTest, SendsEveryFrameWhenItIsDue) {
  play();
  pass(1);
  join();
  ASSERT_EQ(viewer->frames.size(), 1u);
  const Clock::time_point start = now;
  for (std::size_t i = 1; i < kSampleFrames; ++i) {
    while (now < start + seconds(static_cast<double>(i) / kSampleRate)) step(0.001);
    // Rounded to steps of a millisecond.
    ASSERT_NEAR(static_cast<double>(viewer->frames.size()), static_cast<double>(i + 1), 1) << i;
  }
  pass(0.01);
  ASSERT_EQ(viewer->frames.size(), kSampleFrames);
  for (std::size_t i = 0; i < kSampleFrames; ++i) {
    EXPECT_EQ(frameOf(viewer->frames[i]), i);
    EXPECT_EQ(viewer->frames[i].tick, i + 1);
    EXPECT_EQ(viewer->frames[i].key, i % kMaxKeyFrameDistance == 0);
  }
  EXPECT_EQ(scene->metrics.framesDropped.value(), 0u);
}

TEST_F(PlaybackTest, PausesAtTheEndAndResumesFromTheStart) {
  play();
  join();
  pass(kLength + 0.1);
  EXPECT_TRUE(scene->paused);
  ASSERT_FALSE(viewer->notices.empty());
  EXPECT_EQ(viewer->notices.back().kind(), v1::NOTICE_KIND_SCENE_PAUSED);
  EXPECT_TRUE(viewer->playbacks.back().paused());
  EXPECT_NEAR(viewer->playbacks.back().position(), kLength, 1e-6);
  pass(0.1);
  EXPECT_EQ(viewer->frames.size(), kSampleFrames);
  pause(false);
  pass(0.1);
  EXPECT_EQ(frameOf(viewer->frames[kSampleFrames]), 0u);
  EXPECT_TRUE(viewer->frames[kSampleFrames].key);
}

TEST_F(PlaybackTest, LoopContinuesWithAKeyFrameAndLaterTicks) {
  play({.loop = true});
  join();
  pass(2.5 * (kLength + 1.0 / kSampleRate));
  ASSERT_GT(viewer->frames.size(), 2 * kSampleFrames);
  for (std::size_t i = 0; i < viewer->frames.size(); ++i) {
    ASSERT_EQ(frameOf(viewer->frames[i]), i % kSampleFrames);
    ASSERT_EQ(viewer->frames[i].tick, i + 1);  // ticks have no gaps
  }
  EXPECT_TRUE(viewer->frames[kSampleFrames].key);
  EXPECT_EQ(scene->metrics.framesDropped.value(), 0u);
}

TEST_F(PlaybackTest, SeekContinuesFromThePreviousKeyFrame) {
  play();
  join();
  pass(0.5);
  for (const double to : {1.3, 0.0, 2.0, 0.41, playback->playback()->length()}) {
    const std::size_t before = viewer->frames.size();
    const std::uint64_t tick = viewer->frames.back().tick;
    seek(to);
    ASSERT_GT(viewer->frames.size(), before) << to;
    const Seen& first = viewer->frames[before];
    const auto sought = static_cast<std::size_t>(std::floor(to * kSampleRate + 1e-6));
    EXPECT_EQ(frameOf(first), sought / kMaxKeyFrameDistance * kMaxKeyFrameDistance) << to;
    EXPECT_TRUE(first.key);
    EXPECT_EQ(first.tick, tick + 1);
    EXPECT_NEAR(playback->playback()->position(), static_cast<double>(frameOf(first)) / kSampleRate, 1e-6);
    pass(0.1);
    EXPECT_GT(viewer->frames.size(), before + 3);
  }
}

// The sample with changes: after half a second the wind and the structural springs, after a second and a half
// the wind, the mass and the material.
std::string sampleWithChanges() {
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "sample", {{"scene", "sample"}, {"device", "none"}});
  v1::StreamDescription description = sampleDescription();
  v1::Environment& environment = *description.mutable_definition()->mutable_environment();
  environment.mutable_gravity()->set_y(-9.81f);
  environment.mutable_wind()->set_z(3);
  v1::Cloth& cloth = *description.mutable_definition()->add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_grid()->set_width(2);
  cloth.mutable_grid()->set_height(0.5f);
  cloth.set_mass(0.25f);
  cloth.mutable_structural()->set_stiffness(20);
  cloth.mutable_self_collision()->set_radius(0.01f);
  cloth.mutable_self_collision()->set_friction(0.3f);
  EXPECT_TRUE(writer->write(Topic::description, sampleTime(0), description.SerializeAsString()));

  v1::ParameterChanged early, late;
  early.mutable_change()->mutable_wind()->mutable_value()->set_x(1);
  v1::ClothChange& everyCloth = *early.mutable_change()->add_cloths();
  everyCloth.mutable_structural()->set_stiffness(40);
  everyCloth.mutable_self_collision()->set_friction(0.5f);
  late.mutable_change()->mutable_wind()->mutable_value();  // no value: the wind is cleared
  v1::ClothChange& sheet = *late.mutable_change()->add_cloths();
  sheet.set_name("sheet");
  sheet.set_areal_mass(0.5f);
  sheet.set_material("denim");
  late.mutable_change()->add_cloths()->set_name("none such");

  auto sample = readerOf(sampleRecording(kSampleFrames));
  std::uint32_t frame = 0;
  for (auto message = sample.next(); *message; message = sample.next()) {
    if ((*message)->topic != Topic::frames) continue;
    EXPECT_TRUE(writer->write(Topic::frames, (*message)->time, (*message)->bytes));
    ++frame;
    if (frame != 30 && frame != 90) continue;
    const v1::ParameterChanged& sent = frame == 30 ? early : late;
    EXPECT_TRUE(writer->write(Topic::parameters, sampleTime(frame), sent.SerializeAsString()));
  }
  EXPECT_TRUE(writer->finish());
  return bytes;
}

TEST_F(PlaybackTest, SeekSendsTheParametersOfThatTime) {
  for (const bool cut : {false, true}) {
    // Also without its index, when the places of the changes are unknown.
    std::string bytes = sampleWithChanges();
    if (cut) bytes.resize(bytes.size() - 100);
    play(std::move(bytes));
    join();
    const auto last = [&]() -> const v1::ParameterChange& { return viewer->changes.back().change(); };
    const auto expect = [&](float windX, float windZ, float stiffness, float friction, float arealMass,
                            const char* material) {
      EXPECT_EQ(last().gravity().value().y(), -9.81f);
      EXPECT_EQ(last().wind().value().x(), windX);
      EXPECT_EQ(last().wind().value().z(), windZ);
      ASSERT_EQ(last().cloths_size(), 1);
      EXPECT_EQ(last().cloths(0).name(), "sheet");
      EXPECT_EQ(last().cloths(0).structural().stiffness(), stiffness);
      EXPECT_EQ(last().cloths(0).self_collision().radius(), 0.01f);
      EXPECT_EQ(last().cloths(0).self_collision().friction(), friction);
      EXPECT_EQ(last().cloths(0).areal_mass(), arealMass);
      // A missing value is sent too, so that clients forget an earlier one.
      EXPECT_TRUE(last().cloths(0).has_material());
      EXPECT_EQ(last().cloths(0).material(), material);
      // The change arrives with the next frame.
      EXPECT_EQ(viewer->changes.back().tick(), viewer->frames.back().tick);
    };
    ASSERT_EQ(viewer->changes.size(), 1u);
    expect(0, 3, 20, 0.3f, 0.25f, "");
    // A later participant gets the values that hold by then.
    EXPECT_EQ(playback->parameters().SerializeAsString(), last().SerializeAsString());
    pass(1);
    ASSERT_EQ(viewer->changes.size(), 2u);
    EXPECT_EQ(playback->parameters().wind().value().x(), 1);
    EXPECT_EQ(playback->parameters().gravity().value().y(), -9.81f);
    pause(true);
    seek(2.2);
    expect(0, 0, 40, 0.5f, 0.5f, "denim");
    seek(0.1);
    expect(0, 3, 20, 0.3f, 0.25f, "");
    seek(1.0);
    expect(1, 0, 40, 0.5f, 0.25f, "");
    viewer.reset();
  }
}

std::string sampleWithSliders() {
  std::string bytes;
  writeSampleWithSliders(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      kSampleFrames);
  return bytes;
}

TEST_F(PlaybackTest, SeekGivesTheParametersOfPlayingThrough) {
  for (const bool cut : {false, true}) {
    std::string bytes = sampleWithSliders();
    const std::size_t lastChunk = readerOf(bytes).mcap().chunks().back().offset;
    if (cut) bytes.resize(lastChunk + 100);
    play(std::move(bytes));
    join();
    std::vector<std::string> played;  // hashes with each frame
    while (!scene->paused) {
      played.resize(viewer->frames.size(), playback->parameters().SerializeAsString());
      step(0.001);
    }
    ASSERT_EQ(played.size(), viewer->frames.size());
    ASSERT_GT(played.size(), kSampleFrames - 13);
    pause(true);
    std::mt19937 random(5);
    for (int i = 0; i < 100; ++i) {
      seek(playback->playback()->length() * static_cast<double>(random() % 1001) / 1000);
      const std::size_t frame = frameOf(viewer->frames.back());
      ASSERT_LT(frame, played.size());
      EXPECT_EQ(playback->parameters().SerializeAsString(), played[frame]) << frame;
      const v1::ParameterChange& sent = viewer->changes.back().change();
      EXPECT_EQ(sent.SerializeAsString(), played[frame]) << frame;
      const SampleSliders sliders = sampleSliders(static_cast<std::uint32_t>(frame));
      EXPECT_EQ(sent.wind().value().x(), sliders.wind) << frame;
      EXPECT_EQ(sent.cloths(0).structural().stiffness(), sliders.stiffness) << frame;
    }
    viewer.reset();
  }
}

TEST(ParameterHistory, GivesTheSameWithFewerEntries) {
  RecordingReader reader = readerOf(sampleWithSliders());
  const v1::StreamDescription description = readDescription(reader).value();
  const ParameterHistory all(reader, description);
  EXPECT_EQ(all.stride(), 1u);
  const std::size_t one = ParametersInForce(description).now().ByteSizeLong();
  for (const std::size_t most : {std::size_t{0}, 3 * one, 6 * one}) {
    const ParameterHistory few(reader, description, most);
    EXPECT_GT(few.stride(), 1u);
    for (std::uint32_t frame = 0; frame < kSampleFrames; ++frame) {
      const v1::ParameterChange there = few.at(sampleTime(frame), reader).now();
      EXPECT_EQ(there.SerializeAsString(), all.at(sampleTime(frame), reader).now().SerializeAsString());
      EXPECT_EQ(there.wind().value().x(), sampleSliders(frame).wind) << frame;
      EXPECT_EQ(there.cloths(0).structural().stiffness(), sampleSliders(frame).stiffness) << frame;
    }
    EXPECT_EQ(few.at(0, reader).now().SerializeAsString(), all.at(0, reader).now().SerializeAsString());
  }
}

TEST_F(PlaybackTest, ShowsASeekWhilePaused) {
  play({.from = 1});
  join();
  pass(0.2);
  pause(true);
  const std::size_t before = viewer->frames.size();
  pass(1);
  EXPECT_EQ(viewer->frames.size(), before);
  seek(2);
  pass(1);
  ASSERT_EQ(viewer->frames.size(), before + 1);
  EXPECT_EQ(frameOf(viewer->frames.back()), 120u);

  // A participant that joins now gets the present frame.
  Viewer late(*scene);
  step(0.1);
  late.read(now);
  ASSERT_EQ(late.frames.size(), 1u);
  EXPECT_EQ(frameOf(late.frames.back()), 120u);
  pass(0.5);
  EXPECT_EQ(viewer->frames.size(), before + 2);

  pause(false);
  pass(0.1);
  EXPECT_EQ(frameOf(viewer->frames[before + 2]), 121u);
}

TEST_F(PlaybackTest, SpeedStretchesTime) {
  play({.speed = 2});
  join();
  pass(0.5);
  EXPECT_NEAR(static_cast<double>(viewer->frames.size()), 61, 1.1);
  ASSERT_TRUE(control([](auto& request) { request.set_speed(0.25); }));
  const auto before = static_cast<double>(viewer->frames.size());
  pass(1);
  EXPECT_NEAR(static_cast<double>(viewer->frames.size()) - before, 15, 1.1);
  EXPECT_EQ(viewer->playbacks.back().speed(), 0.25);
}

TEST_F(PlaybackTest, StandsStillWithoutViewers) {
  play();
  join();
  pass(0.5);
  viewer.reset();
  pass(5);
  const double position = playback->playback()->position();
  EXPECT_NEAR(position, 0.5, 0.02);
  join();
  ASSERT_EQ(viewer->frames.size(), 1u);
  EXPECT_EQ(frameOf(viewer->frames.front()), 24u);
}

TEST_F(PlaybackTest, LaterViewerStartsAtTheNextKeyFrame) {
  play();
  join();
  pass(0.2);
  Viewer late(*scene);
  for (int i = 0; i < 500; ++i) {
    step(0.001);
    late.read(now);
  }
  ASSERT_FALSE(late.frames.empty());
  EXPECT_EQ(frameOf(late.frames.front()), 24u);
  EXPECT_EQ(late.frames.front().tick, 25u);
  for (std::size_t i = 1; i < viewer->frames.size(); ++i) ASSERT_EQ(frameOf(viewer->frames[i]), i);
}

TEST_F(PlaybackTest, RefusesImpossibleRequests) {
  play();
  for (const double wrong : {-0.1, kLength + 0.1, std::nan("")}) {
    const auto refused = control([&](auto& request) { request.set_seek(wrong); });
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().code, v1::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_THAT(refused.error().text, HasSubstr("must be 0 to 2.483, the recording's length"));
  }
  for (const double wrong : {0.0, 9.0, -1.0, std::nan("")})
    EXPECT_FALSE(control([&](auto& request) { request.set_speed(wrong); })) << wrong;
  v1::ParameterChange change;
  change.set_air_density(1);
  const auto refused = scene->change(1, change, scene::Role::owner);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("a recording that is played"));
}

TEST_F(PlaybackTest, PlaysTheRestOfADamagedFileAndReportsTheLoss) {
  std::string bytes = sampleRecording(kSampleFrames);
  const auto place = readerOf(bytes).mcap().chunks()[4];
  bytes[place.offset + place.length / 2] ^= 0x10;
  play(bytes);
  join();
  pass(kLength + 0.1);
  ASSERT_EQ(viewer->notices.size(), 2u);
  EXPECT_EQ(viewer->notices[0].kind(), v1::NOTICE_KIND_RECORDING_DAMAGED);
  EXPECT_EQ(viewer->notices[1].kind(), v1::NOTICE_KIND_SCENE_PAUSED);
  std::vector<std::size_t> missing;
  for (std::size_t i = 0, next = 0; i < viewer->frames.size(); ++i, ++next)
    for (const std::size_t at = frameOf(viewer->frames[i]); next < at; ++next) missing.push_back(next);
  // The gap reaches from the first frame of the chunk to the next key frame.
  ASSERT_FALSE(missing.empty());
  const auto first = static_cast<std::size_t>(
      std::llround(1e-9 * static_cast<double>(place.start - kSampleStart) * kSampleRate));
  EXPECT_EQ(missing.front(), first);
  EXPECT_EQ((missing.back() + 1) % kMaxKeyFrameDistance, 0u);
  EXPECT_EQ(missing.back() - missing.front() + 1, missing.size());
  EXPECT_EQ(viewer->frames.size() + missing.size(), kSampleFrames);
  EXPECT_EQ(viewer->notices[0].text(),
            fmt::format("the recording is damaged: {:.2f} s to {:.2f} s of it cannot be shown",
                        static_cast<double>(missing.front()) / kSampleRate,
                        static_cast<double>(missing.back() + 1) / kSampleRate));

  // A seek into the gap shows the frame before it.
  pause(false);
  seek(static_cast<double>(first + 1) / kSampleRate);
  EXPECT_LE(frameOf(viewer->frames.back()), first);
}

TEST_F(PlaybackTest, LeavesOutFramesThatCannotBeDecodedAndReportsThem) {
  const std::string bytes =
      withFrames(sampleRecording(kSampleFrames), [](std::size_t frame, v1::Frame& changed) {
        if (frame == 30) changed.mutable_packet()->back() ^= 1;
        if (frame == 72) changed.set_packet("garbage");
      });
  play(bytes);
  join();
  pass(kLength + 0.1);
  ASSERT_EQ(viewer->notices.size(), 3u);
  EXPECT_EQ(viewer->notices[0].text(), "the recording is damaged: 0.50 s to 0.80 s of it cannot be shown");
  EXPECT_EQ(viewer->notices[1].text(), "the recording is damaged: 1.20 s to 1.60 s of it cannot be shown");
  ASSERT_EQ(viewer->frames.size(), kSampleFrames - 18u - 24u);
  for (const Seen& seen : viewer->frames) EXPECT_LT(frameOf(seen), kSampleFrames);
  EXPECT_THAT(playback->damage(), HasSubstr("the first is that of tick 31 at 0.500 s"));

  RecordedStream stream = streamOf(bytes);
  const auto checked = stream.check();
  ASSERT_FALSE(checked.has_value());
  EXPECT_THAT(checked.error(), HasSubstr("of 150 frames"));
  RecordedStream whole = streamOf(sampleRecording(kSampleFrames));
  EXPECT_TRUE(whole.check().has_value());
  EXPECT_TRUE(std::holds_alternative<RecordedStream::TimedMessage>(whole.next()))
      << "it plays from the start";
}

TEST_F(PlaybackTest, RefusesADescriptionBeyondTheLimits) {
  const std::string bytes =
      withMessages(sampleRecording(3), Topic::description, [](std::size_t, std::string& message) {
        v1::StreamDescription description = sampleDescription();
        description.mutable_cloths(0)->set_vertex_count(1u << 26);
        description.mutable_cloths(0)->set_rows(1u << 13);
        description.mutable_cloths(0)->set_columns(1u << 13);
        message = description.SerializeAsString();
      });
  const auto refused = RecordedStream::of(readerOf(bytes));
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error(), HasSubstr("67108864 vertices; at most 1048576 are read"));
}

TEST_F(PlaybackTest, PlaysATruncatedFileToItsEnd) {
  std::string bytes = sampleRecording(kSampleFrames);
  const auto place = readerOf(bytes).mcap().chunks()[8];
  bytes.resize(place.offset + place.length / 2);
  EXPECT_TRUE(streamOf(bytes).truncated());
  play(bytes);
  join();
  pass(kLength);
  EXPECT_TRUE(scene->paused);
  ASSERT_GT(viewer->frames.size(), 50u);
  for (std::size_t i = 0; i < viewer->frames.size(); ++i) ASSERT_EQ(frameOf(viewer->frames[i]), i);
}

TEST_F(PlaybackTest, PlaysAnyFileToItsEndOrRefusesIt) {
  const std::string whole = sampleRecording(kSampleFrames);
  const std::size_t data = readerOf(whole).mcap().chunks().front().offset;
  std::mt19937 random(7);
  for (int round = 0; round < 60; ++round) {
    std::string bytes = whole;
    for (int i = 0; i < 3; ++i)
      bytes[data + random() % (bytes.size() - data)] ^= static_cast<char>(1 << random() % 8);
    auto reader = RecordingReader::open(std::make_unique<MemorySource>(bytes), "damaged", CutFiles::read);
    if (!reader) continue;
    auto stream = RecordedStream::of(std::move(*reader));
    if (!stream) continue;
    stream->seek(1);
    std::size_t frames = 0;
    for (;;) {
      const RecordedStream::Next next = stream->next();
      if (std::holds_alternative<RecordedStream::End>(next)) break;
      ASSERT_LT(++frames, 10 * kSampleFrames);
    }
  }
}

// A file from another program: a key frame with the largest possible tick, then one with a smaller tick.
TEST_F(PlaybackTest, TicksGrowForAnyRecordedTicks) {
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "test", {{"scene", "sample"}});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(Topic::description, sampleTime(0), sampleDescription().SerializeAsString()));
  std::uint64_t time = 0;
  for (const std::uint64_t tick : {~std::uint64_t{0} - 1, ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
    const auto encoder = codec::Encoder::make(sampleLayout());
    std::vector<std::byte> packet(encoder->packetBound());
    const codec::MotionFrame motion = codec::sampleMotion(sampleLayout(), 3, 0.05f);
    const std::size_t size = encoder->encode(tick, codec::PacketKind::key, motion.positions, {}, packet);
    v1::ServerMessage message;
    message.mutable_frame()->set_packet(packet.data(), size);
    message.mutable_frame()->set_reconstruction_hash(encoder->reconstructionHash());
    ASSERT_TRUE(writer->write(sampleTime(++time), message));
  }
  ASSERT_TRUE(writer->finish());
  play(bytes, {.loop = true});
  join();
  pass(0.2);
  ASSERT_GT(viewer->frames.size(), 6u);
  for (std::size_t i = 0; i < viewer->frames.size(); ++i) EXPECT_EQ(viewer->frames[i].tick, i + 1);
}

}  // namespace
}  // namespace clothstream::recording

// SPDX-License-Identifier: MIT
// Frames of a scene host: receivers, key frames, content.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::scene {
namespace {

using namespace schedule;
using namespace delivery;

using tests::HostedScene;
using tests::smallScene;

class SceneFramesTest : public tests::GpuTest {};

TEST_F(SceneFramesTest, StreamsOneFramePerTickStartingWithAKeyFrame) {
  HostedScene hosted;
  hosted.ticks(20);
  ASSERT_EQ(hosted.frames.size(), 20u);
  EXPECT_TRUE(hosted.keys.front());
  EXPECT_EQ(std::count(hosted.keys.begin(), hosted.keys.end(), true), 1);
  EXPECT_EQ(hosted.decoder->tick(), 20u);
  EXPECT_EQ(hosted.live.metrics.frames.value(), 20u);
  EXPECT_EQ(hosted.live.metrics.keyFrames.value(), 1u);
  EXPECT_EQ(hosted.live.metrics.ticks.value(), 20u);
}

// When a subscriber takes its messages: in read() only, or as soon as the mailbox wakes it.
enum class Endpoint : std::uint8_t { asked, quick };

// A further subscriber of a hosted scene, with its own quality.
class QualitySubscriber {
 public:
  QualitySubscriber(HostedScene& hosted, std::uint8_t quality, Endpoint endpoint = Endpoint::asked)
      : hosted_(hosted),
        mailbox_(std::make_shared<Mailbox>([this, endpoint] {
          if (endpoint == Endpoint::quick) take();
        })),
        decoder_(codec::Decoder::make(encode::streamLayout(hosted.live.start(), kEpoch))) {
    hosted.live.subscribers.add(mailbox_);
    mailbox_->subscribe(nullptr, hosted.live.shape(), hosted.live.metrics, quality);
    take();
  }
  ~QualitySubscriber() { hosted_.live.subscribers.remove(*mailbox_); }

  // Takes and acknowledges all waiting messages.
  void read() {
    std::size_t before = 0;
    do {
      before = qualities.size();
      take();
      acknowledge();
    } while (qualities.size() > before);
  }
  void acknowledge() {
    if (decoder_->hasFrame()) {
      ASSERT_TRUE(mailbox_->acknowledge(decoder_->tick(), hosted_.now));
    }
  }

  std::uint64_t tick() const { return decoder_->tick(); }

  std::vector<std::uint8_t> qualities;  // of the received frames
  std::vector<std::uint64_t> stateHashes;

 private:
  // Decodes each frame, and compares it with the server's reconstruction.
  void take() {
    while (const auto message = mailbox_->next(hosted_.now)) {
      v1::ServerMessage parsed;
      ASSERT_TRUE(parsed.ParseFromArray((*message)->data(), static_cast<int>((*message)->size())));
      if (!parsed.has_frame()) continue;
      const auto packet = std::as_bytes(std::span(parsed.frame().packet()));
      ASSERT_EQ(decoder_->decode(packet), codec::DecodeResult::ok);
      EXPECT_EQ(decoder_->reconstructionHash(), parsed.frame().reconstruction_hash());
      qualities.push_back(codec::parsePacket(packet)->header.quality);
      stateHashes.push_back(parsed.frame().state_hash());
    }
  }

  HostedScene& hosted_;
  std::shared_ptr<Mailbox> mailbox_;
  std::unique_ptr<codec::Decoder> decoder_;
};

TEST_F(SceneFramesTest, EncodesEachRequestedQualityOnce) {
  model::Scene scene = smallScene();
  scene.stream.qualities = 3;
  HostedScene hosted(std::move(scene));
  const auto packets = [&] { return hosted.live.metrics.frames.value(); };
  hosted.ticks(5);
  EXPECT_EQ(packets(), 5u);
  {
    QualitySubscriber first(hosted, 1), second(hosted, 1);
    // The encoder of quality 1 is made meanwhile.
    for (const auto end = Clock::now() + std::chrono::seconds(60);
         first.qualities.empty() && Clock::now() < end;) {
      hosted.tick();
      first.read();
      second.read();
    }
    const std::uint64_t before = packets();
    const std::size_t seen = first.qualities.size();
    for (int i = 0; i < 10; ++i) {
      hosted.tick();
      first.read();
      second.read();
    }
    EXPECT_EQ(packets() - before, 20u);
    EXPECT_EQ(first.qualities.size() - seen, 10u);
    EXPECT_EQ(second.qualities, first.qualities);
    EXPECT_EQ(std::ranges::count(first.qualities, 1), static_cast<std::ptrdiff_t>(first.qualities.size()));
  }
  const std::uint64_t before = packets();
  hosted.ticks(5);
  EXPECT_EQ(packets() - before, 5u);
  EXPECT_EQ(std::count(hosted.keys.begin(), hosted.keys.end(), true), 1);
}

TEST_F(SceneFramesTest, DoesNotEncodeTheFinestQualityIfUnused) {
  model::Scene scene = smallScene();
  scene.stream.qualities = 2;
  HostedScene hosted(std::move(scene), 0);
  QualitySubscriber only(hosted, 1);
  for (const auto end = Clock::now() + std::chrono::seconds(60);
       only.qualities.size() < 10 && Clock::now() < end;) {
    hosted.tick();
    only.read();
  }
  EXPECT_EQ(hosted.live.metrics.frames.value(), only.qualities.size());
  EXPECT_EQ(only.qualities, std::vector<std::uint8_t>(10, 1));
}

TEST_F(SceneFramesTest, FastReaderGetsEachTickInOneQualityAcrossAChange) {
  model::Scene scene = smallScene();
  scene.stream.qualities = 2;
  HostedScene hosted(std::move(scene), 0);
  QualitySubscriber coarse(hosted, 1);  // makes the server create the encoder of quality 1
  for (const auto end = Clock::now() + std::chrono::seconds(60);
       coarse.qualities.empty() && Clock::now() < end;) {
    hosted.tick();
    coarse.read();
  }
  QualitySubscriber quick(hosted, 0, Endpoint::quick);
  hosted.ticks(3);
  EXPECT_EQ(quick.qualities, (std::vector<std::uint8_t>{0, 0}));  // the third waits
  EXPECT_NE(hosted.live.subscribers.requested(hosted.now + LinkAdaptation::kPatience).keyFrames & 0b10, 0);
  quick.acknowledge();
  quick.acknowledge();
  hosted.tick();
  EXPECT_EQ(quick.qualities, (std::vector<std::uint8_t>{0, 0, 0, 1}));
}

TEST_F(SceneFramesTest, LateJoinerOfAPausedSceneGetsTheNewestTick) {
  model::Scene scene = smallScene();
  scene.stream.qualities = 2;
  HostedScene through(scene), hosted(scene);
  through.ticks(30);
  hosted.ticks(20);
  const auto show = [&] {
    hosted.now += std::chrono::seconds(1);
    hosted.host.encodePausedFrame(hosted.now);
    hosted.publisher.drain();
  };
  hosted.mailboxes[0]->requestKeyFrame();  // can decode without one, so the request waits
  show();
  EXPECT_EQ(hosted.live.metrics.frames.value(), 20u);
  {
    QualitySubscriber late(hosted, 0), coarse(hosted, 1);
    for (const auto end = Clock::now() + std::chrono::seconds(60);
         coarse.qualities.empty() && Clock::now() < end;) {
      show();  // the coarser quality's encoder is made meanwhile
      late.read();
      coarse.read();
    }
    for (const QualitySubscriber* one : {&late, &coarse}) {
      EXPECT_EQ(one->tick(), 20u);
      EXPECT_EQ(one->stateHashes, std::vector{through.frames[19].state_hash()});
    }
    EXPECT_EQ(coarse.qualities, std::vector<std::uint8_t>{1});
    show();
    EXPECT_EQ(hosted.live.metrics.frames.value(), 22u);
    EXPECT_EQ(hosted.live.metrics.ticks.value(), 20u);
    EXPECT_EQ(hosted.mailboxes[0]->next(hosted.now), std::nullopt);
    for (int i = 0; i < 10; ++i) {
      hosted.tick();
      late.read();
      coarse.read();
    }
    EXPECT_EQ(late.tick(), 30u);
    EXPECT_EQ(late.stateHashes.size(), 11u);
    EXPECT_EQ(coarse.stateHashes, late.stateHashes);
  }
  EXPECT_EQ(hosted.stateHashes(), through.stateHashes());
}

TEST_F(SceneFramesTest, ScenePausedBeforeItsFirstTickShowsItsStart) {
  HostedScene hosted(smallScene());
  hosted.host.encodePausedFrame(hosted.now);
  hosted.publisher.drain();
  const auto message = hosted.mailboxes[0]->next(hosted.now);
  ASSERT_TRUE(message);
  v1::ServerMessage parsed;
  ASSERT_TRUE(parsed.ParseFromArray((*message)->data(), static_cast<int>((*message)->size())));
  ASSERT_EQ(hosted.decoder->decode(std::as_bytes(std::span(parsed.frame().packet()))),
            codec::DecodeResult::ok);
  EXPECT_EQ(hosted.decoder->tick(), 0u);
  EXPECT_EQ(hosted.decoder->reconstructionHash(), parsed.frame().reconstruction_hash());
  ASSERT_TRUE(hosted.mailboxes[0]->acknowledge(0, hosted.now));
  hosted.ticks(3);
  EXPECT_EQ(hosted.decoder->tick(), 3u);
}

TEST_F(SceneFramesTest, StreamsAtTheStreamRate) {
  model::Scene scene = smallScene();
  scene.streamRate = 10;
  HostedScene hosted(scene);
  hosted.ticks(12);
  EXPECT_EQ(hosted.frames.size(), 3u);
  EXPECT_EQ(hosted.decoder->tick(), 12u);
}

TEST_F(SceneFramesTest, DecodedFrameIsWithinMaxErrorOfTheState) {
  HostedScene hosted;
  hosted.ticks(10);
  vulkan::Recorder recorder(tests::device());
  // The same ticks of the same scene, simulated without a host.
  simulation::ClothSimulation simulation(tests::device(), hosted.live.start());
  ColliderSet colliders(hosted.live.start());
  simulation::TickInputs inputs{.environment = hosted.live.start().environment, .colliders = {}};
  for (int tick = 1; tick <= 10; ++tick) {
    colliders.advance(hosted.live.start(), tick * hosted.live.start().tickSeconds(), inputs.colliders);
    recorder.begin();
    simulation.recordTick(recorder, inputs);
    simulation.recordSaveState(recorder);
    tests::submitAndWait(tests::device(), recorder);
  }
  EXPECT_EQ(simulation.status().stateHash, hosted.frames.back().state_hash());
  const simulation::NodeState state = simulation::unpack(simulation.collectState(10));
  const std::span<const float> decoded = hosted.decoder->positions();
  ASSERT_EQ(decoded.size(), 3 * state.positions.size());
  for (std::size_t node = 0; node < state.positions.size(); ++node) {
    const model::Vec3 position(decoded[3 * node], decoded[3 * node + 1], decoded[3 * node + 2]);
    EXPECT_LE((position - state.positions[node]).norm(),
              std::sqrt(3.0f) * hosted.live.start().stream.maxError)
        << node;
  }
}

TEST_F(SceneFramesTest, OneKeyFrameServesAllRequestsAndRespectsTheInterval) {
  HostedScene hosted(smallScene(), 5);
  hosted.ticks(3);
  for (const auto& mailbox : hosted.mailboxes) mailbox->restart();
  hosted.tick();
  EXPECT_TRUE(hosted.keys.back());
  EXPECT_EQ(hosted.live.metrics.keyFrames.value(), 2u);

  // A second request within the interval waits: the frames until the end of the interval are predicted.
  hosted.mailboxes.back()->restart();
  for (int millisecondsLater = 25; millisecondsLater < 100; millisecondsLater += 25) {
    hosted.host.begin(hosted.now + std::chrono::milliseconds(millisecondsLater));
    hosted.host.finish();
  }
  hosted.publisher.drain();
  EXPECT_EQ(hosted.live.metrics.keyFrames.value(), 2u);
  hosted.tick();
  EXPECT_EQ(hosted.live.metrics.keyFrames.value(), 3u);
}

// The strain in the report agrees with the decoded frame. Tolerance: both ends of a spring of 0.1 m have the
// codec's error along three axes.
TEST_F(SceneFramesTest, SendsFourReportsPerSecond) {
  HostedScene hosted;
  hosted.ticks(21);
  ASSERT_EQ(hosted.frames.size(), 21u);
  for (std::size_t i = 0; i < 21; ++i) EXPECT_EQ(hosted.frames[i].has_report(), i % 10 == 0) << "frame " << i;
  const auto positions = hosted.decoder->positions();
  double largest = -1;
  for (std::size_t row = 0; row < 12; ++row)
    for (std::size_t column = 0; column < 10; ++column)
      for (const std::size_t next : {1, 10}) {
        if ((next == 1 && column == 9) || (next == 10 && row == 11)) continue;
        const float* a = positions.data() + 3 * (10 * row + column);
        const float* b = a + 3 * next;
        largest = std::max(
            largest, std::hypot(double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]) / 0.1 - 1);
      }
  const v1::SimulationReport& report = hosted.frames.back().report();
  ASSERT_EQ(report.cloths_size(), 1);
  EXPECT_NEAR(report.cloths(0).strain_max(), largest, 2 * std::sqrt(3.0) * 0.0005 / 0.1 + 1e-5);
  EXPECT_GT(report.cloths(0).kinetic_energy(), 0);
  EXPECT_GE(report.device_seconds(), 0);
}

TEST_F(SceneFramesTest, ReportsNameConstraintsWhileAParticipantAsks) {
  model::Scene scene = smallScene();
  scene.cloths.front().solver.kind = model::SolverKind::acad;
  scene.cloths.front().solver.activation = 0.001f;
  HostedScene hosted(std::move(scene));
  const auto ask = [&](std::uint64_t participant, bool asks) {
    hosted.live.inbox.postPoses(participant, {.wantsConstraints = asks}, hosted.now);
  };
  const auto newest = [&]() -> const v1::ClothReport& { return hosted.frames.back().report().cloths(0); };
  hosted.ticks(21);
  EXPECT_GT(newest().active_constraints(), 0u);
  EXPECT_EQ(newest().constraint_ends_size(), 0);
  ask(7, true);
  ask(8, true);
  hosted.ticks(10);
  EXPECT_GT(newest().constraint_ends_size(), 0);
  EXPECT_EQ(newest().constraint_ends_size(), 2 * static_cast<int>(newest().active_constraints()));
  ask(7, false);
  hosted.ticks(10);
  EXPECT_GT(newest().constraint_ends_size(), 0);
  ask(8, false);
  hosted.ticks(10);
  EXPECT_GT(newest().active_constraints(), 0u);
  EXPECT_EQ(newest().constraint_ends_size(), 0);
}

}  // namespace
}  // namespace clothstream::scene

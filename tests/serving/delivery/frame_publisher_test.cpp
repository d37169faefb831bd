// SPDX-License-Identifier: MIT
// Frames of several scenes on the publisher's threads: order, turns, drains, and the end.
#include "server/delivery/frame_publisher.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/tick_inputs.h"
#include "tests/serving/small_scene.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

class FramePublisherTest : public tests::GpuTest {
 protected:
  void SetUp() override {
    tests::GpuTest::SetUp();
    if (IsSkipped()) return;
    simulation = std::make_unique<simulation::ClothSimulation>(tests::device(), scene);
    tests::run([&](vulkan::Recorder& recorder) {
      simulation->recordTick(recorder, simulation::inputsAt(scene, 0));
    });
  }

  const model::Scene scene = tests::smallScene();
  std::unique_ptr<simulation::ClothSimulation> simulation;
};

// Frames of one scene, with the numbers 1, 2, 3, ...
class Stream {
 public:
  // `published` is called with each number on the thread that publishes the frame.
  Stream(FramePublisher& publisher, const simulation::ClothSimulation& simulation, const model::Scene& scene,
         std::function<void(std::uint64_t)> published)
      : encoder_(tests::device(), simulation, encode::streamLayout(scene, 1)),
        subscribers_([published = std::move(published)](const SharedBytes& message) {
          v1::ServerMessage parsed;
          EXPECT_TRUE(parsed.ParseFromArray(message->data(), static_cast<int>(message->size())));
          published(parsed.frame().state_hash());
        }),
        queue_(publisher) {}

  // Makes the next frame and pushes it.
  void push() {
    while (!encoder_.canRecord()) std::this_thread::yield();
    frame_.subscribers = &subscribers_;
    frame_.metrics = &metrics_;
    frame_.fields->set_state_hash(++number_);
    frame_.recorded.assign(1, {.encoder = &encoder_});
    tests::run([&](vulkan::Recorder& recorder) {
      frame_.recorded.front().frame = encoder_.record(recorder, number_, false);
    });
    queue_.push(frame_);
  }
  void push(int count) {
    for (int i = 0; i < count; ++i) push();
  }
  void drain() { queue_.drain(); }

 private:
  encode::FrameEncoder encoder_;
  telemetry::SceneMetrics metrics_;
  Subscribers subscribers_;
  CompleteFrame frame_;
  std::uint64_t number_ = 0;
  FramePublisher::Queue queue_;
};

using Numbers = std::vector<std::uint64_t>;

Numbers upTo(std::uint64_t last) {
  Numbers numbers(last);
  std::iota(numbers.begin(), numbers.end(), 1);
  return numbers;
}

TEST_F(FramePublisherTest, KeepsTheOrderOfEachScene) {
  struct Scene {
    std::mt19937 random;
    std::atomic<bool> busy{false};
    Numbers published;
  };
  std::vector<Scene> scenes(8);
  FramePublisher publisher(4);
  std::vector<std::unique_ptr<Stream>> streams;
  for (Scene& of : scenes) {
    of.random.seed(static_cast<std::uint32_t>(streams.size()));
    streams.push_back(std::make_unique<Stream>(publisher, *simulation, scene, [&](std::uint64_t number) {
      EXPECT_FALSE(of.busy.exchange(true)) << "two frames of a scene at a time";
      const auto end = Clock::now() + std::chrono::microseconds(of.random() % 400);
      while (Clock::now() < end) std::this_thread::yield();
      of.published.push_back(number);
      of.busy = false;
    }));
  }
  for (int frame = 0; frame < 20; ++frame)
    for (const auto& stream : streams) stream->push();
  publisher.drain();
  EXPECT_EQ(publisher.waiting(), 0u);
  for (const Scene& of : scenes) EXPECT_EQ(of.published, upTo(20));
}

TEST_F(FramePublisherTest, PublishesScenesAtTheSameTime) {
  FramePublisher publisher(2);
  std::promise<void> firstIsHere, secondIsHere;
  const auto meet = [](std::promise<void>& here, std::promise<void>& there) {
    here.set_value();
    EXPECT_EQ(there.get_future().wait_for(60s), std::future_status::ready);
  };
  Stream first(publisher, *simulation, scene, [&](std::uint64_t) { meet(firstIsHere, secondIsHere); });
  Stream second(publisher, *simulation, scene, [&](std::uint64_t) { meet(secondIsHere, firstIsHere); });
  first.push();
  second.push();
}

TEST_F(FramePublisherTest, DrainsOneSceneAlone) {
  FramePublisher publisher(2);
  std::promise<void> begun, goesOn;
  Numbers ofSlow, ofQuick;
  Stream slow(publisher, *simulation, scene, [&](std::uint64_t number) {
    if (number == 1) {
      begun.set_value();
      EXPECT_EQ(goesOn.get_future().wait_for(60s), std::future_status::ready);
    }
    ofSlow.push_back(number);
  });
  Stream quick(publisher, *simulation, scene, [&](std::uint64_t number) { ofQuick.push_back(number); });
  slow.push();
  begun.get_future().wait();
  slow.push(2);
  quick.push(3);
  quick.drain();
  EXPECT_EQ(ofQuick, upTo(3));
  EXPECT_EQ(publisher.waiting(), 2u);
  goesOn.set_value();
  publisher.drain();
  EXPECT_EQ(ofSlow, upTo(3));
}

TEST_F(FramePublisherTest, ScenesTakeTurns) {
  FramePublisher publisher(1);
  std::promise<void> begun, goesOn;
  std::vector<char> order;
  Stream first(publisher, *simulation, scene, [&](std::uint64_t number) {
    if (number == 1) {
      begun.set_value();
      EXPECT_EQ(goesOn.get_future().wait_for(60s), std::future_status::ready);
    }
    order.push_back('a');
  });
  Stream second(publisher, *simulation, scene, [&](std::uint64_t) { order.push_back('b'); });
  Stream third(publisher, *simulation, scene, [&](std::uint64_t) { order.push_back('c'); });
  first.push();
  begun.get_future().wait();
  first.push(2);
  second.push(2);
  third.push(1);
  goesOn.set_value();
  publisher.drain();
  EXPECT_EQ(order, (std::vector<char>{'a', 'b', 'c', 'a', 'b', 'a'}));
}

TEST_F(FramePublisherTest, QueueEndsAfterItsFrames) {
  FramePublisher publisher;
  Numbers published;
  {
    Stream stream(publisher, *simulation, scene, [&](std::uint64_t number) { published.push_back(number); });
    stream.push(3);
  }
  EXPECT_EQ(published, upTo(3));
}

TEST_F(FramePublisherTest, ExceptionEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto publish = [&] {
    FramePublisher publisher(2);
    Stream stream(publisher, *simulation, scene,
                  [](std::uint64_t) { throw std::runtime_error("no subscriber gets it"); });
    stream.push();
  };
  EXPECT_DEATH(publish(), "no subscriber gets it");
}

TEST(FramePublisher, SuitsTheProcessors) {
  EXPECT_EQ(FramePublisher::suitedTo(0), 1u);
  EXPECT_EQ(FramePublisher::suitedTo(2), 1u);
  EXPECT_EQ(FramePublisher::suitedTo(16), 12u);
  EXPECT_EQ(FramePublisher::suitedTo(128), 16u);
}

}  // namespace
}  // namespace clothstream::delivery

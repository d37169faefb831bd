// SPDX-License-Identifier: MIT
// Counts what the threads of a scene allocate while it runs. This program replaces operator new.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <new>
#include <string>
#include <thread>

#include <execinfo.h>
#include <gtest/gtest.h>

#include "server/delivery/frame_publisher.h"
#include "server/delivery/mailbox.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_host.h"
#include "tests/serving/small_scene.h"

namespace {

// Return addresses of an allocation, innermost first.
struct Place {
  std::array<void*, 24> frames;
  int count;
};

// Blocks that this thread has allocated, and where it allocated the first of them since findsPlaces was set.
thread_local std::uint64_t blocks = 0;
thread_local bool findsPlaces = false;
thread_local std::array<Place, 8> places;
thread_local std::size_t placeCount = 0;

void countBlock() {
  ++blocks;
  if (!findsPlaces || placeCount == places.size()) return;
  findsPlaces = false;  // finding a place may allocate
  Place& place = places[placeCount++];
  place.count = backtrace(place.frames.data(), static_cast<int>(place.frames.size()));
  findsPlaces = true;
}

}  // namespace

// Inlined, the compiler would see a mismatch of new and free.
[[gnu::noinline]] void* operator new(std::size_t size) {
  countBlock();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace clothstream::scene {
namespace {

using delivery::Mailbox;
using model::SolverKind;

// Ticks until every buffer has its size: more than two checkpoints of the state.
constexpr int kWarmUp = 100;
// Ticks that are measured: a checkpoint on the device, but no snapshot on the CPU.
constexpr int kMeasured = 50;
static_assert((kWarmUp + kMeasured) < 5 * 40, "the fifth second has a snapshot");

// A frame's message, which its subscribers share until the slowest has sent it: the vector with its reference
// counts, and the bytes.
constexpr std::uint64_t kBlocksOfMessage = 2;

// A scene without reports and without a server. A participant moves a collider, and holds the cloth.
class Scene {
 public:
  explicit Scene(const model::Scene& scene)
      : device_(vulkan::DeviceOptions{}), live_(scene), host_(device_, live_, publisher_, 0) {
    live_.subscribers.add(viewer_);
    viewer_->subscribe(live_.description(), live_.shape(), live_.metrics);
    while (viewer_->next(now_)) {
    }
  }

  // Runs a tick. Returns the blocks that it allocated on this thread.
  std::uint64_t tick() {
    now_ += std::chrono::milliseconds(25);
    move();
    const std::uint64_t before = blocks;
    findsPlaces = measures;
    int slices = 0;
    for (host_.begin(now_); host_.hasSlices(); ++slices) {
      host_.submitSlice();
      host_.waitForSlice();
    }
    host_.finish();
    findsPlaces = false;
    const std::uint64_t made = blocks - before;
    isLonger = slices > mostSlices_;
    mostSlices_ = std::max(slices, mostSlices_);
    publisher_.drain();
    messages = 0;
    while (viewer_->next(now_)) ++messages;
    EXPECT_TRUE(viewer_->acknowledge(host_.tick(), now_));
    return made;
  }
  // Blocks of the publisher's thread when it gave the newest frame to the viewer.
  std::uint64_t blocksOfPublisher() const { return blocksOfPublisher_; }

  bool measures = false;
  int messages = 0;       // of the newest tick, to the viewer
  bool isLonger = false;  // the newest tick had more slices than all before: it needs more command buffers

 private:
  // Posts what an endpoint would post.
  void move() {
    const float way = 0.02f * std::sin(static_cast<float>(host_.tick()) / 7);
    const auto at = [](float x, float y, float z) {
      return model::Pose{model::Vec3(x, y, z), model::Quaternion::Identity()};
    };
    live_.inbox.postPoses(
        7,
        {.colliders = {tests::handAt(1, way, -0.6f, 0.15f)},
         .grabs = {{.id = 1, .pose = at(way, -0.9f, 0), .radius = 0.2f, .slipDistance = 1}}},
        now_, {.trueAt = now_, .clientTimeUs = schedule::microseconds(now_)});
  }

  const std::thread::id self_ = std::this_thread::get_id();
  std::atomic<std::uint64_t> blocksOfPublisher_{0};
  int mostSlices_ = 0;
  vulkan::Device device_;
  LiveScene live_;
  delivery::FramePublisher publisher_;
  SceneHost host_;
  schedule::Clock::time_point now_ = schedule::Clock::now();
  std::shared_ptr<Mailbox> viewer_ = std::make_shared<Mailbox>([this] {
    if (std::this_thread::get_id() != self_) blocksOfPublisher_ = blocks;
  });
};

class TickAllocationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    unsetenv("CLOTHSTREAM_VALIDATION");  // the validation layer allocates
    try {
      const vulkan::Device device{vulkan::DeviceOptions{}};
    } catch (const vulkan::DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  // Runs the scene, and expects that a tick allocates the message of its frame and nothing else.
  static void expectNone(const model::Scene& scene) {
    Scene running(scene);
    for (int tick = 0; tick < kWarmUp; ++tick) running.tick();
    std::array<void*, 1> unused;
    backtrace(unused.data(), 1);  // its first call allocates
    placeCount = 0;
    running.measures = true;
    for (int tick = 0; tick < kMeasured; ++tick) {
      const std::uint64_t before = running.blocksOfPublisher();
      const std::uint64_t made = running.tick();
      EXPECT_EQ(running.isLonger ? 0 : made, 0u) << "tick " << tick;
      EXPECT_EQ(running.messages, 1) << "tick " << tick << " has events, which are messages";
      EXPECT_EQ(running.blocksOfPublisher() - before, kBlocksOfMessage) << "tick " << tick;
    }
    if (!HasFailure()) return;
    for (std::size_t i = 0; i < placeCount; ++i) {
      std::cerr << "allocated here (addr2line names the places):\n";
      backtrace_symbols_fd(places[i].frames.data(), places[i].count, 2);
    }
  }
};

TEST_F(TickAllocationTest, CountsBlocks) {
  const std::uint64_t before = blocks;
  const auto block = std::make_unique<std::uint64_t>(before);
  EXPECT_EQ(blocks, *block + 1);
}

TEST_F(TickAllocationTest, TickAllocatesOnlyItsMessage) {
  expectNone(tests::smallScene());
}

TEST_F(TickAllocationTest, SoDoTicksOfEverySolver) {
  for (const SolverKind kind :
       {SolverKind::constraint, SolverKind::implicitEuler, SolverKind::acad, SolverKind::xpbd}) {
    SCOPED_TRACE(static_cast<int>(kind));
    model::Scene scene = tests::smallScene();
    scene.cloths.front().solver.kind = kind;
    expectNone(scene);
  }
  model::Scene rungeKutta = tests::smallScene();
  rungeKutta.integrator = model::Integrator::rungeKutta4;
  expectNone(rungeKutta);
}

TEST_F(TickAllocationTest, SoDoTicksWithEveryStage) {
  model::Scene scene = tests::smallScene();
  model::Cloth& cloth = scene.cloths.front();
  cloth.dihedralBending = 0.01f;
  cloth.selfCollision = model::SelfCollision{.radius = 0.02f, .nothingPasses = true};
  model::Attachment& rod = cloth.attachments.emplace_back();
  rod.name = "rod";
  rod.ranges = {{.firstRow = 3, .lastRow = 5}};
  scene.stream.normals = model::Normals::octahedral;
  scene.environment.wind = model::Vec3(1, 0, 0.5f);
  scene.environment.gust = {.strength = 2, .seconds = 0.4f};
  expectNone(scene);
}

}  // namespace
}  // namespace clothstream::scene

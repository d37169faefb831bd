// SPDX-License-Identifier: MIT
// Suite curtain: the named scene in real time, as clothstream-server runs it. One client in this process
// decodes every frame and moves a hand.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "clients/core/core.h"
#include "server/hosting/scene_server.h"
#include "server/messages/scene_file.h"
#include "server/session/session.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

using Clock = std::chrono::steady_clock;

// The p99 of a tick needs some hundreds of ticks.
constexpr double kLeastSeconds = 10;
// Interval of poses, like those of a headset's tracking. It is no multiple of the scene's rate, so that poses
// arrive at every phase of a tick.
constexpr std::chrono::microseconds kPoseInterval{1'000'000 / 90};

cs_client* createCore() {
  cs_client_options options{};
  options.client_name = "bench";
  return cs_create(&options);
}

class Viewer {
 public:
  explicit Viewer(hosting::SceneServer& server)
      : session_(session::Session::open(server, {.peer = "bench", .address = {}, .token = {}}, [this] {
          const std::lock_guard lock(mutex_);
          awake_ = true;
          woken_.notify_one();
        })) {}

  void watchUntil(Clock::time_point end) {
    for (Clock::time_point now = Clock::now(); now < end; now = Clock::now()) {
      if (now >= nextPose_) {
        moveHand(now);
        nextPose_ = std::max(nextPose_ + kPoseInterval, now);
      }
      cs_update(core_.get(), microseconds(now));
      while (const auto message = session_->next()) receive(**message);
      std::size_t size = 0;
      while (const std::uint8_t* message = cs_next_outgoing(core_.get(), &size))
        session_->receive(std::as_bytes(std::span(message, size)));
      std::unique_lock lock(mutex_);
      woken_.wait_until(lock, std::min(nextPose_, end), [this] { return awake_; });
      awake_ = false;
    }
  }

  cs_statistics statistics() const {
    cs_statistics statistics;
    cs_get_statistics(core_.get(), microseconds(Clock::now()), &statistics);
    return statistics;
  }

 private:
  static std::uint64_t microseconds(Clock::time_point time) {
    return static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count());
  }

  void receive(const std::vector<std::byte>& message) {
    cs_receive(core_.get(), reinterpret_cast<const std::uint8_t*>(message.data()), message.size(),
               microseconds(Clock::now()));
    if (cs_get_state(core_.get()) == CS_STATE_FAILED) throw std::runtime_error(cs_error_text(core_.get()));
  }

  // Moves the hand back and forth through the curtain.
  void moveHand(Clock::time_point now) {
    const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
    const cs_own_collider hand{.shape = CS_SHAPE_SPHERE,
                               .position = {0.6f, 1.2f, static_cast<float>(0.3 * std::sin(2 * seconds))},
                               .orientation = {},
                               .radius = 0.1f,
                               .length = 0,
                               .size = {},
                               .top_radius = 0};
    if (cs_get_state(core_.get()) == CS_STATE_JOINED)
      cs_set_colliders(core_.get(), &hand, 1, microseconds(now));
  }

  std::mutex mutex_;
  std::condition_variable woken_;
  bool awake_ = false;
  Clock::time_point nextPose_{};
  std::unique_ptr<cs_client, void (*)(cs_client*)> core_{createCore(), &cs_destroy};
  std::shared_ptr<session::Session> session_;
};

void checkFrames(const cs_statistics& seen) {
  if (seen.frames == 0 || seen.decode_errors + seen.hash_mismatches > 0)
    throw std::runtime_error(fmt::format("of {} frames {} were refused and {} decoded to a different state",
                                         seen.frames, seen.decode_errors, seen.hash_mismatches));
}

}  // namespace

void runCurtain(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  if (settings.size) throw std::runtime_error("--size: not allowed, because the scene has a fixed size");
  const model::Scene scene = *messages::loadScene("curtain");
  Simulated(device, scene, {}).check({scene.environment, {}});
  hosting::ServerOptions options;
  options.device = settings.device;
  options.defaultScene = scene.name;
  hosting::SceneServer server({scene}, std::move(options));
  const telemetry::SceneMetrics& metrics = server.scenes.all().front()->metrics;
  const double seconds = std::max(settings.seconds, kLeastSeconds);
  cs_statistics seen;
  {
    Viewer viewer(server);
    viewer.watchUntil(Clock::now() +
                      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
    seen = viewer.statistics();
  }
  checkFrames(seen);

  const telemetry::Summary tick = metrics.tick.summary(), onDevice = metrics.deviceTotal.summary(),
                           encode = metrics.encode.summary(), pose = metrics.inputToPacket.summary();
  if (pose.count == 0) throw std::runtime_error("no pose reached the scene");
  add({{"suite", "curtain"},
       {"nodes", scene.nodeCount()},
       {"substeps", scene.substeps},
       {"rate", scene.simulationRate},
       {"budgetMs", scene.tickSeconds() * 1e3},
       {"tickMsMedian", tick.p50 * 1e3},
       {"tickMsP99", tick.p99 * 1e3},
       {"deviceMsMedian", onDevice.p50 * 1e3},
       {"encodeMsMedian", encode.p50 * 1e3},
       {"poseToPacketMsMedian", pose.p50 * 1e3},
       {"poseToPacketMsP99", pose.p99 * 1e3},
       {"poses", pose.count},
       {"ticks", metrics.ticks.value()},
       {"lateTicks", metrics.lateTicks.value()},
       {"slippedTicks", metrics.slippedTicks.value()},
       {"frames", seen.frames},
       {"dropped", seen.dropped},
       {"bitsPerVertex", seen.bits_per_vertex},
       {"device", device.info().name}});
}

}  // namespace clothstream::bench

// SPDX-License-Identifier: MIT
// Runs and records a named scene with a participant for some ticks.
#include "tests/replay/recorded_scene.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include <zlib.h>

#include "server/messages/scene_file.h"
#include "server/recording/recorder.h"
#include "server/scene/scene_host.h"
#include "server/simulation/state_snapshot.h"

namespace clothstream::replay {
namespace {

using schedule::Clock;

constexpr std::uint64_t kParticipant = 7;

// Poses of the participant at `tick`, counted from 0. `centre` is the centre of the first cloth at the start.
model::ParticipantPoses posesAt(std::uint32_t tick, std::uint32_t ticks, const model::Vec3& centre) {
  model::ParticipantPoses poses;
  const float part = static_cast<float>(tick) / static_cast<float>(ticks);
  model::ParticipantCollider ball;
  ball.id = 1;
  ball.shape = model::Sphere{0.1f};
  ball.pose.position = centre + model::Vec3(0.1f, 0.05f, 0.4f - 0.6f * part);
  poses.colliders.push_back(ball);
  if (part < 0.3f || part > 0.8f) return poses;
  model::Grab grab;
  grab.id = 1;
  grab.radius = 0.1f;
  grab.reach = 0.5f;
  grab.pose.position = centre + model::Vec3(-0.2f, 0, 0.3f * (part - 0.3f));
  poses.grabs.push_back(grab);
  return poses;
}

}  // namespace

std::vector<std::string> keptScenes() {
  std::vector<std::string> names = messages::namedScenes();
  std::erase(names, "gown");
  return names;
}

std::uint32_t ticksFor(const model::Scene& scene) {
  constexpr std::uint32_t kNodeFrames = 60'000, kMinFrames = 12, kMaxFrames = 40;
  // The geometry of a mesh takes as much space as its frames.
  const bool mesh = scene.cloths.front().mesh != nullptr;
  const std::uint32_t frames =
      mesh ? kMinFrames : std::clamp(kNodeFrames / scene.nodeCount(), kMinFrames, kMaxFrames);
  return frames * scene.simulationRate / scene.streamRate;
}

std::string recordScene(vulkan::Device& device, const std::string& name,
                        const std::filesystem::path& directory) {
  auto scene = messages::loadScene(name);
  if (!scene) throw std::runtime_error(scene.error().text);
  const std::uint32_t ticks = ticksFor(*scene);
  const std::uint32_t rate = scene->simulationRate;
  const model::Vec3 wind = scene->environment.wind;
  const auto recorder = std::make_shared<recording::Recorder>(
      recording::RecorderOptions{.directory = directory, .serverName = "clothstream replay"});
  delivery::FramePublisher publisher;
  scene::LiveScene live(std::move(*scene), {}, recorder);
  auto host = std::make_unique<scene::SceneHost>(device, live, publisher);
  model::Vec3 centre = model::Vec3::Zero();
  const std::vector<model::Vec3> rest = model::restPositions(live.start().cloths.front());
  for (const model::Vec3& node : rest) centre += node / static_cast<float>(rest.size());
  Clock::time_point now = Clock::now();
  for (std::uint32_t tick = 0; tick < ticks; ++tick) {
    live.inbox.postPoses(kParticipant, posesAt(tick, ticks, centre), now);
    if (tick == ticks / 2) {
      model::ParameterChange change;
      change.environment[parameters::kWind] = {wind.x() + 1, wind.y(), wind.z() - 2};
      change.environment[parameters::kGust] = {1, 0.2f};
      if (!live.inbox.postChange({.participant = kParticipant, .change = change}))
        throw std::runtime_error(name + ": the scene takes no change");
    }
    now += std::chrono::nanoseconds(1'000'000'000 / rate);
    host->begin(now);
    host->finish();
    publisher.drain();
  }
  host.reset();
  while (recorder->state() == recording::Recorder::State::running) std::this_thread::yield();
  if (recorder->state() != recording::Recorder::State::complete)
    throw std::runtime_error(name + ": the recording failed");
  return recorder->path();
}

void compress(const std::string& recording, const std::string& to) {
  std::ifstream file(recording, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  gzFile out = gzopen(to.c_str(), "wb9");
  const bool written = out != nullptr && gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size())) ==
                                             static_cast<int>(bytes.size());
  if (out == nullptr || gzclose(out) != Z_OK || !written || !file)
    throw std::runtime_error(to + " cannot be written");
}

void decompress(const std::string& from, const std::string& recording) {
  gzFile in = gzopen(from.c_str(), "rb");
  if (in == nullptr) throw std::runtime_error(from + " cannot be opened");
  std::ofstream out(recording, std::ios::binary);
  char bytes[65536];
  int count = 0;
  while ((count = gzread(in, bytes, sizeof bytes)) > 0) out.write(bytes, count);
  if (gzclose(in) != Z_OK || count < 0 || !out.flush()) throw std::runtime_error(from + " cannot be read");
}

}  // namespace clothstream::replay

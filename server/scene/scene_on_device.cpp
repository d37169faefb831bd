// SPDX-License-Identifier: MIT
#include "server/scene/scene_on_device.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "server/scene/scene_definition.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {
namespace {

// Pause after a slice of loading, as a multiple of its time.
constexpr int kPause = 2;

}  // namespace

SceneOnDevice::SceneOnDevice(vulkan::Device& device_, const model::Scene& scene, codec::Workers& workers,
                             const std::stop_token& stop)
    : device(device_),
      simulation(device_, scene),
      encoders(device_, simulation, encode::streamLayout(scene, kEpoch), &workers),
      recorder(device_),
      slices(device_, recorder) {
  const std::uint32_t most = device.limits().maxAllocations;
  if (device.allocations() + kSpareAllocations > most)
    throw std::runtime_error(
        fmt::format("its buffers would leave fewer than {} of the {} allocations of memory that {} allows: "
                    "delete a scene first",
                    kSpareAllocations, most, device.info().name));
  recorder.begin();
  simulation.recordSaveState(recorder);
  submitAndWait(stop);
  start = simulation.collectState(0);
  warmUp(scene, stop);
}

void SceneOnDevice::submitAndWait(const std::stop_token& stop) {
  for (std::uint32_t slice = 0; slice < recorder.sliceCount(); ++slice) {
    if (stop.stop_requested()) throw std::runtime_error("loading was stopped");
    const schedule::Clock::time_point before = schedule::Clock::now();
    device.wait(device.submitSlice(recorder, slice));
    const schedule::Clock::duration used = schedule::Clock::now() - before;
    if (slice + 1 < recorder.sliceCount()) std::this_thread::sleep_for(kPause * used);
  }
}

void SceneOnDevice::warmUp(const model::Scene& scene, const std::stop_token& stop) {
  simulation::TickInputs inputs{scene.environment, {}};
  inputs.winds.assign(scene.winds.begin(), scene.winds.end());
  recorder.beginRehearsal();
  for (int tick = 0; tick < 2; ++tick) {
    simulation.recordTick(recorder, inputs);
    simulation.recordReport(recorder, inputs);
    if (scene.stream.normals == model::Normals::octahedral) simulation.recordNormals(recorder);
    inputs.colliders.emplace_back();
    inputs.grabs.emplace_back();
  }
  submitAndWait(stop);
  // One submission for each kernel that no scene has used yet, so that other scenes can use the device
  // between two of them.
  for (const vulkan::RehearsedKernel& kernel : recorder.rehearsed()) {
    if (kernel.bindings->kernel().isReady()) continue;
    recorder.begin();
    recorder.touch(*kernel.bindings);
    submitAndWait(stop);
    kernel.bindings->kernel().setReady();
  }

  encode::FrameEncoder& encoder = encoders.finest();
  std::vector<std::byte> packet(encoder.packetBound());
  for (std::uint64_t tick = 1; tick <= 2; ++tick) {
    recorder.begin();
    const encode::RecordedFrame frame = encoder.record(recorder, tick, false);
    submitAndWait(stop);
    encoder.entropyCode(frame, packet);
  }
  encoder.forgetHistory();
  recorder.begin();
  simulation.recordRestoreState(recorder, start);
  submitAndWait(stop);
}

}  // namespace clothstream::scene

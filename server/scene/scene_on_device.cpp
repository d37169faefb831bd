// SPDX-License-Identifier: MIT
#include "server/scene/scene_on_device.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/scene/live_scene.h"

namespace clothstream::scene {
namespace {

// Kernel invocations of a slice: first value (10 to 20 ns each on two processors), minimum, and maximum.
constexpr double kFirstSlice = 1 << 19, kMinSlice = 1 << 12, kMaxSlice = 1e15;
// A GPU is faster by at least this factor.
constexpr double kGpuFactor = 64;
// Most work of a slice, in slices: work that depends on the state, such as the pairs of a heap, can be that
// much more than in the ticks before. It is limited by the first slice, because slices of calm ticks grow.
constexpr double kMostFactor = 16;

}  // namespace

SceneOnDevice::SceneOnDevice(vulkan::Device& device_, const model::Scene& scene, codec::Workers& workers,
                             const std::stop_token& stop)
    : device(device_),
      simulation(device_, scene),
      encoders(device_, simulation, encode::streamLayout(scene, LiveScene::kEpoch), &workers),
      recorder(device_),
      sliceInvocations_(device_.isSoftware() ? kFirstSlice : kGpuFactor * kFirstSlice) {
  const std::uint32_t most = device.limits().maxAllocations;
  if (device.allocations() + kSpareAllocations > most)
    throw std::runtime_error(
        fmt::format("its buffers would leave fewer than {} of the {} allocations of memory that {} allows: "
                    "delete a scene first",
                    kSpareAllocations, most, device.info().name));
  sliceRecordings();
  recorder.begin();
  simulation.recordSaveState(recorder);
  submitAndWait();
  start = simulation.collectState(0);
  warmUp(scene, stop);
}

void SceneOnDevice::scaleSlices(double factor) {
  sliceInvocations_ = std::clamp(sliceInvocations_ * std::clamp(factor, 0.25, 1.25), kMinSlice, kMaxSlice);
  sliceRecordings();
}

void SceneOnDevice::sliceRecordings() {
  const double first = device.isSoftware() ? kFirstSlice : kGpuFactor * kFirstSlice;
  recorder.sliceAfter(static_cast<std::uint64_t>(sliceInvocations_),
                      static_cast<std::uint64_t>(kMostFactor * std::min(sliceInvocations_, first)));
}

void SceneOnDevice::submitAndWait() {
  device.wait(device.submit(recorder));
}

void SceneOnDevice::warmUp(const model::Scene& scene, const std::stop_token& stop) {
  simulation::TickInputs inputs{scene.environment, {}};
  recorder.beginRehearsal();
  for (int tick = 0; tick < 2; ++tick) {
    simulation.recordTick(recorder, inputs);
    simulation.recordReport(recorder, inputs);
    if (scene.stream.normals == model::Normals::octahedral) simulation.recordNormals(recorder);
    inputs.colliders.emplace_back();
    inputs.grabs.emplace_back();
  }
  submitAndWait();
  // One submission for each kernel, so that other scenes can use the device between two of them.
  for (const vulkan::RehearsedKernel& kernel : recorder.rehearsed()) {
    if (stop.stop_requested()) throw std::runtime_error("loading was stopped");
    recorder.begin();
    recorder.touch(*kernel.bindings);
    submitAndWait();
  }

  encode::FrameEncoder& encoder = encoders.finest();
  std::vector<std::byte> packet(encoder.packetBound());
  for (std::uint64_t tick = 1; tick <= 2; ++tick) {
    recorder.begin();
    const encode::RecordedFrame frame = encoder.record(recorder, tick, false);
    submitAndWait();
    encoder.entropyCode(frame, packet);
  }
  encoder.forgetHistory();
  recorder.begin();
  simulation.recordRestoreState(recorder, start);
  submitAndWait();
}

}  // namespace clothstream::scene

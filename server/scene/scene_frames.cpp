// SPDX-License-Identifier: MIT
#include "server/scene/scene_frames.h"

#include <algorithm>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

using Recorded = delivery::CompleteFrame::Recorded;

SceneFrames::SceneFrames(LiveScene& live, delivery::FramePublisher& publisher, double reportRate)
    : live_(live),
      queue_(publisher),
      schedule_(live.start().simulationRate, live.start().streamRate, reportRate) {}

void SceneFrames::chooseEncoders(SceneOnDevice& on, Clock::time_point now) {
  frame_.recorded.clear();
  delivery::RequestedFrames requested = live_.subscribers.requested(now);
  const bool isRecorded = live_.journal && live_.journal->active();
  if (isRecorded) requested.qualities |= 1;
  for (std::uint8_t quality = 0; quality < on.encoders.count(); ++quality) {
    if ((requested.qualities >> quality & 1) == 0) {
      on.encoders.unwanted(quality, now);
      continue;
    }
    encode::FrameEncoder* const encoder = on.encoders.wanted(quality, now);
    if (encoder == nullptr) continue;
    if (!encoder->canRecord()) {
      live_.metrics.skippedFrames.add();
      continue;
    }
    const bool key = schedule_.needsKey(quality, (requested.keyFrames >> quality & 1) != 0, isRecorded, now);
    frame_.recorded.push_back({.encoder = encoder, .quality = quality, .key = key});
  }
}

void SceneFrames::record(SceneOnDevice& on, std::uint64_t tick, const model::Scene& scene,
                         Interaction& interaction, Clock::time_point now) {
  hasFrame_ = schedule_.takeFrame(tick, live_.work.load().frameDivisor);
  if (!hasFrame_) return;
  chooseEncoders(on, now);
  hasFrame_ = !frame_.recorded.empty();
  if (!hasFrame_) return;
  if (scene.stream.normals == model::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  hasReport_ = schedule_.takeReport(tick);
  if (hasReport_) on.simulation.recordReport(on.recorder, interaction.inputs());
  std::uint8_t keys = 0;
  for (Recorded& recorded : frame_.recorded) {
    recorded.frame = recorded.encoder->record(on.recorder, tick, recorded.key);
    if (recorded.frame.kind == codec::PacketKind::key)
      keys = static_cast<std::uint8_t>(keys | 1u << recorded.quality);
  }
  schedule_.made(keys, now);
  // Key frames first: a subscriber that changes its quality must get the new quality's key frame before the
  // former quality's frame of the same tick.
  std::partition(frame_.recorded.begin(), frame_.recorded.end(),
                 [](const Recorded& recorded) { return recorded.frame.kind == codec::PacketKind::key; });
  describe(scene, interaction, now);
  interaction.takeArrivals(frame_.poseArrivals);
}

void SceneFrames::describe(const model::Scene& scene, const Interaction& interaction,
                           Clock::time_point start) {
  const std::uint32_t divisor = live_.work.load().frameDivisor;
  frame_.subscribers = &live_.subscribers;
  frame_.metrics = &live_.metrics;
  frame_.repeated = false;
  frame_.fields->set_frame_divisor(divisor > 1 ? divisor : 0);
  frame_.fields->set_tick_time_us(schedule::microseconds(start));
  interaction.colliders().write(scene, *frame_.fields);
}

void SceneFrames::publish(const SceneOnDevice& on, const simulation::TickStatus& status, double seconds,
                          Clock::time_point done) {
  if (!hasFrame_) return;
  if (hasReport_)
    writeReport(on, seconds);
  else
    frame_.fields->clear_report();
  frame_.discarded = !status.healthy;
  frame_.fields->set_state_hash(status.stateHash);
  frame_.deviceDone = done;
  queue_.push(frame_);
}

void SceneFrames::encodePaused(SceneOnDevice& on, std::uint64_t tick, const model::Scene& scene,
                               const Interaction& interaction, Clock::time_point now) {
  const std::uint8_t needed = live_.subscribers.needsKeyFrame();
  frame_.recorded.clear();
  std::uint8_t keys = 0;
  for (std::uint8_t quality = 0; quality < on.encoders.count(); ++quality) {
    if (!schedule_.needsKey(quality, (needed >> quality & 1) != 0, false, now)) continue;
    encode::FrameEncoder* const encoder = on.encoders.wanted(quality, now);
    if (encoder == nullptr || !encoder->canRecord()) continue;
    frame_.recorded.push_back({.encoder = encoder, .quality = quality, .key = true});
    keys = static_cast<std::uint8_t>(keys | 1u << quality);
  }
  if (frame_.recorded.empty()) return;
  on.recorder.begin();
  if (scene.stream.normals == model::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  for (Recorded& recorded : frame_.recorded) {
    // The subscribers now hold different newest frames. The next frame is therefore a key frame.
    recorded.encoder->forgetHistory();
    recorded.frame = recorded.encoder->record(on.recorder, tick, true);
    recorded.encoder->forgetHistory();
  }
  schedule_.madePaused(keys, now);
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  const simulation::TickStatus status =
      simulation::statusOf(on.simulation.collectState(tick), model::reachOf(scene.stream));
  describe(scene, interaction, now);
  frame_.repeated = true;
  frame_.fields->clear_report();
  frame_.poseArrivals.clear();
  frame_.discarded = !status.healthy;
  frame_.fields->set_state_hash(status.stateHash);
  frame_.deviceDone = Clock::now();
  queue_.push(frame_);
}

void SceneFrames::writeReport(const SceneOnDevice& on, double seconds) {
  v1::SimulationReport& message = *frame_.fields->mutable_report();
  message.Clear();
  message.set_device_seconds(seconds);
  const std::vector<simulation::ClothReport> reports = on.simulation.report();
  const std::vector<std::vector<std::uint32_t>> ends = on.simulation.constraintEnds();
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const simulation::ClothReport& report = reports[i];
    v1::ClothReport& cloth = *message.add_cloths();
    cloth.mutable_constraint_ends()->Add(ends[i].begin(), ends[i].end());
    cloth.set_strain_max(report.strainMax);
    cloth.set_strain_p99(report.strainP99);
    cloth.set_strain_mean(report.strainMean);
    cloth.set_kinetic_energy(report.kineticEnergy);
    cloth.set_elastic_energy(report.elasticEnergy);
    cloth.set_gravity_energy(report.gravityEnergy);
    cloth.set_active_constraints(report.activeConstraints);
    cloth.set_iterations(report.iterations);
    cloth.set_residual(report.residual);
    cloth.set_penetration(report.penetration);
  }
}

}  // namespace clothstream::scene

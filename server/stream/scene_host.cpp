// SPDX-License-Identifier: MIT
// One scene on the device.
#include "server/stream/scene_host.h"

#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace clothstream::stream {
namespace {

constexpr std::uint32_t kCheckpointSeconds = 1, kSnapshotSeconds = 5;
// Poses whose latency a frame reports: one a participant and tick, at most this many.
constexpr std::size_t kMaxPoseArrivals = 256;

}  // namespace

SceneHost::OnDevice::OnDevice(vulkan::Device& device_, const scene::Scene& scene)
    : device(device_),
      simulation(device_, scene),
      encoder(device_, simulation, encode::streamLayout(scene, LiveScene::kEpoch)),
      recorder(device_) {
  recorder.begin();
  simulation.recordSaveState(recorder);
  device.wait(device.submit(recorder));
  start = simulation.collectState(0);
  warmUp(scene);
}

void SceneHost::OnDevice::warmUp(const scene::Scene& scene) {
  simulation::TickInputs inputs{scene.environment, {}};
  std::vector<std::byte> packet(encoder.packetBound());
  for (std::uint64_t tick = 1; tick <= 2; ++tick) {
    recorder.begin();
    simulation.recordTick(recorder, inputs);
    if (scene.stream.normals == scene::Normals::octahedral) simulation.recordNormals(recorder);
    const encode::RecordedFrame frame = encoder.record(recorder, tick, false);
    device.wait(device.submit(recorder));
    encoder.entropyCode(frame, packet);
    inputs.colliders.emplace_back();
  }
  encoder.forgetHistory();
  recorder.begin();
  simulation.recordRestoreState(recorder, start);
  device.wait(device.submit(recorder));
}

SceneHost::SceneHost(vulkan::Device& device, LiveScene& scene, FramePacker& packer)
    : live_(scene),
      packer_(packer),
      rate_(scene.start().simulationRate),
      ticksAFrame_(rate_ / scene.start().streamRate),
      scene_(scene.start()),
      colliders_(scene_),
      onDevice_(std::make_unique<OnDevice>(device, scene_)) {
  newestState_ = onDevice_->start;
}

SceneHost::~SceneHost() = default;

void SceneHost::begin(Clock::time_point now) {
  tickStart_ = now;
  applyInputs();
  const double endSeconds = static_cast<double>(tick_ + 1) * scene_.tickSeconds();
  colliders_.advance(scene_, endSeconds, tickInputs_.colliders);
  tickInputs_.environment = scene_.environment;

  OnDevice& on = *onDevice_;
  on.recorder.begin();
  recordRecovery();
  if (sinceHealthy_ > 0 && every(kCheckpointSeconds)) on.simulation.recordCheckpoint(on.recorder);
  on.simulation.recordTick(on.recorder, tickInputs_);
  hasFrame_ = (tick_ + 1) % ticksAFrame_ == 0;
  if (hasFrame_) recordFrame(now);
  savesState_ = sinceHealthy_ > 0 && every(kSnapshotSeconds);
  if (savesState_) on.simulation.recordSaveState(on.recorder);
  submitted_ = on.device.submit(on.recorder);
}

void SceneHost::applyInputs() {
  live_.inbox.drain(inputs_);
  for (const AcceptedChange& accepted : inputs_.changes) {
    scene::applyChange(scene_, accepted.change);
    if (!accepted.change.cloths.empty()) onDevice_->simulation.setCloths(scene_.cloths);
    v1::ServerMessage message;
    *message.mutable_parameter_changed()->mutable_change() = accepted.message;
    message.mutable_parameter_changed()->set_participant_id(accepted.participant);
    message.mutable_parameter_changed()->set_tick(tick_ + 1);
    live_.audience.announce(serialise(message));
  }
  for (const Poses& poses : inputs_.poses) {
    colliders_.place(poses.participant, std::span(poses.colliders).first(poses.count));
    if (poses.count > 0 && poseArrivals_.size() < kMaxPoseArrivals) poseArrivals_.push_back(poses.arrival);
  }
}

void SceneHost::recordRecovery() {
  OnDevice& on = *onDevice_;
  if (recovery_ == Recovery::none) return;
  if (recovery_ == Recovery::rollback) on.simulation.recordRollback(on.recorder);
  if (recovery_ == Recovery::reset) on.simulation.recordRestoreState(on.recorder, on.start);
  on.encoder.forgetHistory();
  recovery_ = Recovery::none;
}

void SceneHost::recordFrame(Clock::time_point now) {
  OnDevice& on = *onDevice_;
  if (!on.encoder.canRecord()) {
    live_.metrics.skippedFrames.add();
    hasFrame_ = false;
    return;
  }
  if (scene_.stream.normals == scene::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  const bool key = now - lastKeyFrame_ >= kKeyFrameInterval && live_.audience.wantsKeyFrame();
  frame_.recorded = on.encoder.record(on.recorder, tick_ + 1, key);
  if (frame_.recorded.kind == codec::PacketKind::key) lastKeyFrame_ = now;
  frame_.scene = &live_;
  frame_.encoder = &on.encoder;
  frame_.tickStart = tickStart_;
  colliders_.write(scene_, frame_.colliders);
  std::swap(frame_.poseArrivals, poseArrivals_);
  poseArrivals_.clear();
}

void SceneHost::finish() {
  OnDevice& on = *onDevice_;
  on.device.wait(submitted_);
  const Clock::time_point done = Clock::now();
  status_ = on.simulation.status();
  ++tick_;
  if (status_.healthy) {
    ++sinceHealthy_;
    live_.tick = tick_;
    if (savesState_) newestState_ = on.simulation.collectState(tick_);
  }
  if (hasFrame_) {
    frame_.discarded = !status_.healthy;
    frame_.stateHash = status_.stateHash;
    frame_.deviceDone = done;
    packer_.push(frame_);
  }
  if (!status_.healthy) recover();

  telemetry::SceneMetrics& metrics = live_.metrics;
  metrics.ticks.add();
  metrics.tick.record(seconds(done - tickStart_));
  double total = 0;
  for (const vulkan::StageTime& stage : on.recorder.stageTimes()) {
    metrics.device.record(stage.stage, stage.seconds);
    total += stage.seconds;
  }
  metrics.deviceTotal.record(total);
}

void SceneHost::recover() {
  const bool again = lastRecovery_ && tick_ - *lastRecovery_ <= rate_;
  lastRecovery_ = tick_;
  sinceHealthy_ = 0;
  std::string text;
  if (again) {
    recovery_ = Recovery::reset;
    live_.metrics.resets.add();
    text =
        "the simulation left the range of numbers twice within a second: it goes on from its start, with the "
        "parameters it had then";
    v1::ServerMessage message;
    *message.mutable_parameter_changed()->mutable_change() = live_.resetParameters();
    message.mutable_parameter_changed()->set_tick(tick_ + 1);
    scene_.environment = live_.start().environment;
    scene_.cloths = live_.start().cloths;
    onDevice_->simulation.setCloths(scene_.cloths);
    live_.audience.announce(serialise(message));
  } else {
    recovery_ = Recovery::rollback;
    live_.metrics.rollbacks.add();
    text =
        "the simulation left the range of numbers: it goes on from its last good state, at most a second old";
  }
  if (!recoveryNotices_.take(Clock::now())) return;
  spdlog::warn("{}: tick {}: {}", live_.name(), tick_, text);
  live_.audience.announce(notice(v1::NOTICE_KIND_ROLLED_BACK, text, tick_));
}

void SceneHost::release() {
  onDevice_.reset();
}

void SceneHost::rebuild(vulkan::Device& device) {
  auto fresh = std::make_unique<OnDevice>(device, live_.start());
  fresh->simulation.setCloths(scene_.cloths);
  fresh->recorder.begin();
  fresh->simulation.recordRestoreState(fresh->recorder, newestState_);
  device.wait(device.submit(fresh->recorder));
  onDevice_ = std::move(fresh);
  recovery_ = Recovery::none;
  sinceHealthy_ = 0;
  live_.audience.announce(notice(v1::NOTICE_KIND_DEVICE_REBUILT,
                                 fmt::format("the device was lost; the scene goes on from {:.1f} s before",
                                             static_cast<double>(tick_ - newestState_.tick) / rate_),
                                 tick_));
}

}  // namespace clothstream::stream

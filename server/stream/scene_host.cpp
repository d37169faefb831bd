// SPDX-License-Identifier: MIT
// One scene on the device.
#include "server/stream/scene_host.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/messages/description.h"
#include "server/model/wind.h"
#include "server/stream/report_message.h"

namespace clothstream::stream {
namespace {

// After a change of solver what springs are too long is taken back as exp(-t / kGentleTime).
constexpr double kGentleSeconds = 0.5, kGentleTime = 0.1;
constexpr std::uint32_t kCheckpointSeconds = 1, kSnapshotSeconds = 5;
// Poses whose latency a frame reports: one a participant and tick, at most this many.
constexpr std::size_t kMaxPoseArrivals = 256;

}  // namespace

SceneHost::SceneHost(vulkan::Device& device, LiveScene& scene, FramePacker& packer, double reportRate)
    : SceneHost(std::make_unique<SceneOnDevice>(device, scene.start(), packer.workers()), scene, packer,
                reportRate) {}

SceneHost::SceneHost(std::unique_ptr<SceneOnDevice> ready, LiveScene& scene, FramePacker& packer,
                     double reportRate)
    : live_(scene),
      packer_(packer),
      rate_(scene.start().simulationRate),
      ticksAFrame_(rate_ / scene.start().streamRate),
      ticksAReport_(reportRate > 0 ? static_cast<std::uint64_t>(std::ceil(rate_ / reportRate)) : 0),
      scene_(scene.start()),
      colliders_(scene_),
      holds_(scene_),
      gentleUntil_(scene_.cloths.size(), 0),
      onDevice_(std::move(ready)) {
  newestState_ = onDevice_->start;
  if (live_.journal && live_.journal->due())
    live_.journal->begin(onDevice_->device.info(), scene_,
                         messages::toDescription(scene_, LiveScene::kEpoch, live_.codec(), 0),
                         onDevice_->start, onDevice_->start);
}

SceneHost::~SceneHost() {
  if (live_.journal) live_.journal->end();
}

void SceneHost::begin(Clock::time_point now) {
  tickStart_ = now;
  beginJournal();
  if (live_.resetWanted.exchange(false)) reset();
  endGentleness();
  applyInputs();
  const double endSeconds = static_cast<double>(tick_ + 1) * scene_.tickSeconds();
  colliders_.advance(scene_, endSeconds, tickInputs_.colliders);
  holds_.advance(scene_, endSeconds, tickInputs_);
  tickInputs_.reportsContacts = contacts_.wanted();
  tickInputs_.environment = model::environmentAt(scene_, tick_);

  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  recordRecovery();
  // A rollback goes back to no state from before a recording.
  keepsState_ = sinceHealthy_ > 0 && (journalBegan_ || every(kCheckpointSeconds));
  if (keepsState_) on.simulation.recordCheckpoint(on.recorder);
  on.simulation.recordTick(on.recorder, tickInputs_);
  hasFrame_ = (tick_ + 1) % ticksAFrame_ == 0;
  if (hasFrame_) {
    owesFrame_ = false;
    recordFrame(now);
  }
  savesState_ = sinceHealthy_ > 0 && every(kSnapshotSeconds);
  if (savesState_) on.simulation.recordSaveState(on.recorder);
  submitted_ = on.device.submit(on.recorder);
}

void SceneHost::beginJournal() {
  journalBegan_ = false;
  if (!live_.journal || !live_.journal->due() || recovery_ != Recovery::none || sinceHealthy_ == 0) return;
  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  // Frames of ticks before are none of it.
  packer_.drain();
  // Which nodes grabs hold is not part of a state.
  if (holds_.holds()) holds_.takeAnew();
  const double seconds = static_cast<double>(tick_) * scene_.tickSeconds();
  live_.journal->begin(on.device.info(), scene_,
                       messages::toDescription(scene_, LiveScene::kEpoch, live_.codec(), seconds),
                       on.simulation.collectState(tick_), on.start);
  journalBegan_ = true;
  sinceKeyFrame_ = kFramesAKeyFrame;
}

void SceneHost::watchJournal() {
  if (!live_.journal || live_.journal->active() == recorded_) return;
  recorded_ = !recorded_;
  live_.audience.announce(
      recorded_ ? recordedNotice(tick_)
                : notice(v1::NOTICE_KIND_RECORDING_STOPPED, "the scene is not recorded any more", tick_));
}

void SceneHost::reset() {
  recovery_ = Recovery::reset;
  owesFrame_ = true;
  sinceHealthy_ = 0;
  newestState_ = onDevice_->start;
  newestState_.tick = tick_;
}

void SceneHost::applyInputs() {
  live_.inbox.drain(inputs_);
  std::string problem;
  for (const AcceptedChange& accepted : inputs_.changes) {
    if (!apply(accepted.change, problem)) continue;
    live_.audience.announce(parametersChanged(accepted.message, tick_ + 1, accepted.participant));
  }
  if (!problem.empty()) takeBack(problem);
  for (Poses& poses : inputs_.poses) {
    const model::ParticipantPoses& now = poses.now.poses;
    const bool moves = !now.colliders.empty() || !now.grabs.empty() || !now.attachments.empty();
    if (moves && poseArrivals_.size() < kMaxPoseArrivals) poseArrivals_.push_back(poses.now.arrival);
    poses_.add(std::move(poses));
  }
  poses_.place(tickStart_, [this](std::uint64_t participant, const model::ParticipantPoses& poses) {
    colliders_.place(participant, poses.colliders);
    holds_.place(participant, poses.grabs, poses.attachments);
    contacts_.want(participant, poses.wantsContacts);
  });
}

bool SceneHost::apply(const model::ParameterChange& change, std::string& problem) {
  model::Scene changed = scene_;
  model::applyChange(changed, change);
  changeGently(changed);
  if (!change.cloths.empty()) {
    try {
      setCloths(changed.cloths);
    } catch (const vulkan::DeviceLost&) {
      throw;
    } catch (const std::runtime_error& noRoom) {
      problem = noRoom.what();
      return false;
    }
  }
  scene_ = std::move(changed);
  return true;
}

void SceneHost::changeGently(model::Scene& changed) {
  const auto part = static_cast<float>(changed.substepSeconds() / kGentleTime);
  for (std::size_t i = 0; i < changed.cloths.size(); ++i) {
    model::Solver& solver = changed.cloths[i].solver;
    if (solver.kind != scene_.cloths[i].solver.kind)
      gentleUntil_[i] = tick_ + static_cast<std::uint64_t>(std::ceil(kGentleSeconds * rate_));
    if (gentleUntil_[i] > tick_)
      solver.correctionFraction = std::min(part, model::correctionFraction(solver));
  }
}

void SceneHost::endGentleness() {
  bool ended = false;
  for (std::size_t i = 0; i < gentleUntil_.size(); ++i) {
    if (gentleUntil_[i] != tick_ || !scene_.cloths[i].solver.correctionFraction) continue;
    scene_.cloths[i].solver.correctionFraction.reset();
    ended = true;
  }
  if (ended) setCloths(scene_.cloths);
}

void SceneHost::setCloths(const std::vector<model::Cloth>& cloths) {
  onDevice_->simulation.setCloths(cloths);
  clothsChanged_ = true;
}

void SceneHost::takeBack(const std::string& reason) {
  const std::string text = fmt::format("a change of parameters was taken back: {}", reason);
  spdlog::warn("{}: tick {}: {}", live_.name(), tick_, text);
  live_.audience.announce(parametersChanged(live_.correct(scene_), tick_ + 1));
  live_.audience.announce(notice(v1::NOTICE_KIND_CHANGE_UNDONE, text, tick_));
}

void SceneHost::recordRecovery() {
  SceneOnDevice& on = *onDevice_;
  recovered_ = recovery_;
  if (recovery_ == Recovery::none) return;
  if (recovery_ == Recovery::rollback) on.simulation.recordRollback(on.recorder);
  if (recovery_ == Recovery::reset) on.simulation.recordRestoreState(on.recorder, on.start);
  on.encoders.forgetHistory();
  recovery_ = Recovery::none;
}

void SceneHost::chooseEncoders(Clock::time_point now) {
  frame_.recorded.clear();
  FrameWishes wishes = live_.audience.wishes(now);
  const bool isRecorded = live_.journal && live_.journal->active();
  if (isRecorded) wishes.qualities |= 1;
  encode::QualityEncoders& encoders = onDevice_->encoders;
  for (std::uint8_t quality = 0; quality < encoders.count(); ++quality) {
    if ((wishes.qualities >> quality & 1) == 0) {
      encoders.unwanted(quality, now);
      continue;
    }
    encode::FrameEncoder* const encoder = encoders.wanted(quality, now);
    if (encoder == nullptr) continue;
    if (!encoder->canRecord()) {
      live_.metrics.skippedFrames.add();
      continue;
    }
    const bool due = isRecorded && quality == 0 && sinceKeyFrame_ + 1 >= kFramesAKeyFrame;
    const bool asked = (wishes.keys >> quality & 1) != 0 && now - lastKeyFrame_[quality] >= kKeyFrameInterval;
    frame_.recorded.push_back({.encoder = encoder, .quality = quality, .key = due || asked});
  }
}

void SceneHost::recordFrame(Clock::time_point now) {
  chooseEncoders(now);
  hasFrame_ = !frame_.recorded.empty();
  if (!hasFrame_) return;
  SceneOnDevice& on = *onDevice_;
  if (scene_.stream.normals == model::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  frame_.hasReport = ticksAReport_ > 0 && tick_ + 1 >= nextReport_;
  if (frame_.hasReport) {
    on.simulation.recordReport(on.recorder, tickInputs_);
    nextReport_ = tick_ + 1 + ticksAReport_;
  }
  ++sinceKeyFrame_;
  for (CompleteFrame::Recorded& recorded : frame_.recorded) {
    recorded.frame = recorded.encoder->record(on.recorder, tick_ + 1, recorded.key);
    if (recorded.frame.kind != codec::PacketKind::key) continue;
    lastKeyFrame_[recorded.quality] = now;
    if (recorded.quality == 0) sinceKeyFrame_ = 0;
  }
  // Who changes to another quality is to have its key frame before the former quality's frame of this tick.
  std::ranges::partition(frame_.recorded, [](const CompleteFrame::Recorded& recorded) {
    return recorded.frame.kind == codec::PacketKind::key;
  });
  describeFrame(tickStart_);
  std::swap(frame_.poseArrivals, poseArrivals_);
  poseArrivals_.clear();
}

void SceneHost::describeFrame(Clock::time_point start) {
  frame_.scene = &live_;
  frame_.again = false;
  frame_.tickStart = start;
  colliders_.write(scene_, frame_.colliders);
}

void SceneHost::show(Clock::time_point now) {
  // The next tick goes back to another state.
  if (recovery_ != Recovery::none) return;
  SceneOnDevice& on = *onDevice_;
  const std::uint8_t lacks = live_.audience.lacks();
  frame_.recorded.clear();
  for (std::uint8_t quality = 0; quality < on.encoders.count(); ++quality) {
    if ((lacks >> quality & 1) == 0 || now - lastKeyFrame_[quality] < kKeyFrameInterval) continue;
    encode::FrameEncoder* const encoder = on.encoders.wanted(quality, now);
    if (encoder == nullptr || !encoder->canRecord()) continue;
    frame_.recorded.push_back({.encoder = encoder, .quality = quality, .key = true});
  }
  if (frame_.recorded.empty()) return;
  on.recorder.begin();
  if (scene_.stream.normals == model::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  for (CompleteFrame::Recorded& recorded : frame_.recorded) {
    // What others have refers to the frame before, what this one's receivers have to this one: the next is a
    // key frame.
    recorded.encoder->forgetHistory();
    recorded.frame = recorded.encoder->record(on.recorder, tick_, true);
    recorded.encoder->forgetHistory();
    lastKeyFrame_[recorded.quality] = now;
  }
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  const simulation::TickStatus status = simulation::statusOf(on.simulation.collectState(tick_));
  describeFrame(now);
  frame_.again = true;
  frame_.hasReport = false;
  frame_.poseArrivals.clear();
  frame_.discarded = !status.healthy;
  frame_.stateHash = status.stateHash;
  frame_.deviceDone = Clock::now();
  packer_.push(frame_);
}

void SceneHost::finish() {
  SceneOnDevice& on = *onDevice_;
  on.device.wait(submitted_);
  const Clock::time_point done = Clock::now();
  status_ = on.simulation.status();
  ++tick_;
  if (live_.journal)
    live_.journal->ticked({.tick = tick_,
                           .status = status_,
                           .recovery = recovered_,
                           .keepsState = keepsState_,
                           .clothsChanged = clothsChanged_,
                           .scene = scene_,
                           .inputs = tickInputs_,
                           .colliders = colliders_});
  clothsChanged_ = false;
  if (status_.healthy) {
    ++sinceHealthy_;
    live_.tick = tick_;
    if (savesState_) newestState_ = on.simulation.collectState(tick_);
    if (savesState_ && live_.journal) live_.journal->saved(newestState_, holds_.holds());
  }
  telemetry::SceneMetrics& metrics = live_.metrics;
  double total = 0, report = 0;
  for (const vulkan::StageTime& stage : on.recorder.stageTimes()) {
    metrics.device.record(stage.stage, stage.seconds);
    total += stage.seconds;
    if (stage.stage == "report") report = stage.seconds;
  }
  if (hasFrame_) {
    if (frame_.hasReport) write(on.simulation.report(), total - report, frame_.report);
    frame_.discarded = !status_.healthy;
    frame_.stateHash = status_.stateHash;
    frame_.deviceDone = done;
    packer_.push(frame_);
  }
  announceEvents();
  watchJournal();
  if (!status_.healthy) recover();

  metrics.ticks.add();
  metrics.crowdedBalls.add(status_.crowded);
  metrics.tick.record(seconds(done - tickStart_));
  metrics.deviceTotal.record(total);
}

void SceneHost::announceEvents() {
  v1::ServerMessage message;
  v1::TickEvents& events = *message.mutable_tick_events();
  holds_.addEvents(onDevice_->simulation.grabs(), *events.mutable_grabs());
  contacts_.addEvents(tick_, scene_, colliders_, onDevice_->simulation.contacts(),
                      *events.mutable_contacts());
  if (events.grabs().empty() && events.contacts().empty()) return;
  events.set_tick(tick_);
  live_.audience.announce(serialise(message));
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
    const v1::ParameterChange start = live_.resetParameters();
    scene_.environment = live_.start().environment;
    scene_.cloths = live_.start().cloths;
    setCloths(scene_.cloths);
    live_.audience.announce(parametersChanged(start, tick_ + 1));
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

void SceneHost::rest() {
  packer_.drain();
  onDevice_->encoders.drop();
}

void SceneHost::release() {
  onDevice_.reset();
}

void SceneHost::rebuild(std::unique_ptr<SceneOnDevice> ready, std::string_view why) {
  SceneOnDevice& fresh = *ready;
  fresh.simulation.setCloths(scene_.cloths);
  fresh.recorder.begin();
  fresh.simulation.recordRestoreState(fresh.recorder, newestState_);
  fresh.device.wait(fresh.device.submit(fresh.recorder));
  onDevice_ = std::move(ready);
  holds_.takeAnew();
  recovery_ = Recovery::none;
  sinceHealthy_ = 0;
  if (live_.journal) live_.journal->restored(tick_, newestState_);
  live_.audience.announce(notice(v1::NOTICE_KIND_DEVICE_REBUILT,
                                 fmt::format("{}; the scene goes on from {:.1f} s before", why,
                                             static_cast<double>(tick_ - newestState_.tick) / rate_),
                                 tick_));
}

}  // namespace clothstream::stream

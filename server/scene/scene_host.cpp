// SPDX-License-Identifier: MIT
#include "server/scene/scene_host.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/messages/description.h"
#include "server/messages/scene_message.h"
#include "server/model/wind.h"
#include "server/schedule/retry.h"
#include "server/telemetry/log.h"

namespace clothstream::scene {
namespace {

// After a change of solver, the excess length of springs shrinks as exp(-t / kEaseTime) for kEaseSeconds.
constexpr double kEaseSeconds = 0.5, kEaseTime = 0.1;
// Price of a second of a rehearsal, in seconds of schedule::MakingLimit: it takes a processor, and other
// scenes go on.
constexpr double kRehearsalCost = 0.2;
constexpr std::uint32_t kCheckpointSeconds = 1, kSnapshotSeconds = 5;
// Maximum number of poses whose latency one frame measures; one for each participant and tick.
constexpr std::size_t kMaxPoseArrivals = 256;

}  // namespace

SceneHost::SceneHost(vulkan::Device& device, LiveScene& scene, delivery::FramePublisher& publisher,
                     double reportRate, SceneLoader* loader)
    : SceneHost(std::make_unique<SceneOnDevice>(device, scene.start(), publisher.workers()), scene, publisher,
                reportRate, loader) {}

SceneHost::SceneHost(std::unique_ptr<SceneOnDevice> loaded, LiveScene& scene,
                     delivery::FramePublisher& publisher, double reportRate, SceneLoader* loader)
    : live_(scene),
      publisher_(publisher),
      rate_(scene.start().simulationRate),
      ticksPerFrame_(rate_ / scene.start().streamRate),
      ticksPerReport_(reportRate > 0 ? static_cast<std::uint64_t>(std::ceil(rate_ / reportRate)) : 0),
      scene_(scene.start()),
      colliders_(scene_),
      grabs_(scene_),
      easeUntil_(scene_.cloths.size(), 0),
      wantedWork_(scene.allWork()),
      work_(wantedWork_),
      leastSubsteps_(scene.leastSubsteps(scene_)),
      recoveries_(rate_),
      proven_(parametersOf(scene_)),
      onDevice_(std::move(loaded)),
      rehearsal_(loader) {
  live_.work = work_;
  newestState_ = onDevice_->start;
  const std::shared_ptr<const LiveScene::Restored> restored = live_.restored();
  if (restored) continueFrom(*restored);
  const bool atStart = tick_ == 0;
  const double seconds = static_cast<double>(tick_) * scene_.tickSeconds();
  if (live_.journal && live_.journal->due())
    live_.journal->begin(onDevice_->device.info(), scene_,
                         messages::toDescription(scene_, LiveScene::kEpoch, live_.codec(), seconds),
                         atStart ? onDevice_->start : newestState_, onDevice_->start);
  // Until here a failure leaves the restored state to the next host.
  if (restored) live_.forgetRestored();
}

void SceneHost::continueFrom(const LiveScene::Restored& restored) {
  SceneOnDevice& on = *onDevice_;
  if (restored.checkpoint) {
    const Checkpoint& from = *restored.checkpoint;
    tick_ = from.state.tick;
    scene_ = from.scene;
    easeUntil_ = from.easeUntil;
    colliders_.restore(from.colliders);
    grabs_.restore(from.grabs);
    recoveries_.restore(from.lastRecovery);
    newestState_ = from.state;
    grabsThen_ = grabs_.state().slots;
    wantedWork_ = work_ = from.work;
    live_.work = work_;
    on.simulation.setCloths(scene_.cloths);
    on.simulation.setSubsteps(work_.substeps, scene_.cloths);
    on.recorder.begin();
    on.simulation.recordRestoreState(on.recorder, newestState_);
    on.simulation.recordRestoreGrabs(on.recorder, newestState_.held);
    on.device.wait(on.device.submit(on.recorder));
    telemetry::log({live_.name()}, spdlog::level::info, "continues after tick {}", tick_);
  }
  if (restored.accepted) {
    model::Scene changed = *restored.accepted;
    easeSolverChanges(scene_, changed, easeUntil_);
    setCloths(changed.cloths);
    scene_ = std::move(changed);
  }
  noteChange();
}

Checkpoint SceneHost::checkpoint() const {
  return {.state = newestState_,
          .scene = scene_,
          .easeUntil = easeUntil_,
          .colliders = colliders_.state(),
          .grabs = grabs_.state(),
          .lastRecovery = recoveries_.newest(),
          .work = work_};
}

void SceneHost::saveLast() {
  // A state that a rollback or a reset will replace is not worth keeping; neither is the start.
  if (!live_.keeper || recovery_ != Recovery::none || tick_ == 0) return;
  readState();
  live_.keeper->save(checkpoint());
}

std::optional<Checkpoint> SceneHost::stateNow() {
  if (recovery_ != Recovery::none) throw std::runtime_error("its newest state is not valid; try again later");
  if (tick_ == 0) return std::nullopt;
  readState();
  return checkpoint();
}

void SceneHost::readState() {
  if (newestState_.tick == tick_) return;
  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  newestState_ = on.simulation.collectState(tick_);
}

SceneHost::~SceneHost() {
  if (!live_.journal) return;
  schedule::retryUntilDone([this] { live_.journal->end(); },
                           [this](const std::exception& failure) {
                             telemetry::log({live_.name()}, spdlog::level::err,
                                            "its recording does not end: {}; trying again", failure.what());
                           });
}

void SceneHost::begin(Clock::time_point now) {
  const Clock::time_point began = Clock::now();
  tickStart_ = now;
  makingTime_ = {};
  making_.beginTick();
  beginJournal();
  if (live_.resetRequested.exchange(false)) reset();
  endEasing();
  applyInputs();
  applyWork();
  const double endSeconds = static_cast<double>(tick_ + 1) * scene_.tickSeconds();
  colliders_.advance(scene_, endSeconds, tickInputs_.colliders);
  if (recovery_ != Recovery::none) grabs_.clothsWentBack(scene_, recovery_ == Recovery::reset);
  grabs_.advance(scene_, endSeconds, tickInputs_);
  tickInputs_.reportsContacts = contactRequests_.any();
  tickInputs_.namesConstraints = constraintRequests_.any();
  tickInputs_.environment = model::environmentAt(scene_, tick_);

  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  recordRecovery();
  // The first tick of a recording keeps a checkpoint, so that no rollback goes back to before it.
  keepsState_ = sinceHealthy_ > 0 && (journalBegan_ || every(kCheckpointSeconds));
  if (keepsState_) on.simulation.recordCheckpoint(on.recorder);
  on.simulation.recordTick(on.recorder, tickInputs_);
  rehearsal_.release();
  hasFrame_ = (tick_ + 1) % (std::uint64_t{ticksPerFrame_} * work_.frameDivisor) == 0;
  if (hasFrame_) {
    owesFrame_ = false;
    recordFrame(now);
  }
  recordsState_ = sinceHealthy_ > 0 && every(kSnapshotSeconds);
  const bool keeps = live_.keeper && live_.keeper->due(now);
  savesState_ = recordsState_ || keeps;
  if (savesState_) on.simulation.recordSaveState(on.recorder);
  nextSlice_ = 0;
  longestSlice_ = {};
  beginTime_ = Clock::now() - began;
  submitSlice();
}

void SceneHost::applyWork() {
  if (std::exchange(parametersChanged_, false)) leastSubsteps_ = live_.leastSubsteps(scene_);
  schedule::WorkLevel work = wantedWork_;
  work.substeps = std::clamp(leastSubsteps_, work.substeps, scene_.substeps);
  if (work == work_) return;
  if (work.substeps != work_.substeps) onDevice_->simulation.setSubsteps(work.substeps, scene_.cloths);
  const bool more = work.frameDivisor < work_.frameDivisor || work.substeps > work_.substeps;
  (more ? live_.metrics.overloadStepsUp : live_.metrics.overloadStepsDown).add();
  work_ = work;
  live_.work = work;
  telemetry::log({live_.name()}, spdlog::level::info, "tick {}: every {}. frame, {} of {} substeps",
                 tick_ + 1, work.frameDivisor, work.substeps, scene_.substeps);
  live_.subscribers.announce(workNotice(live_, tick_ + 1));
}

void SceneHost::submitSlice() {
  submittedAt_ = Clock::now();
  sliceInFlight_ = true;
  submitted_ = onDevice_->device.submitSlice(onDevice_->recorder, nextSlice_++);
}

void SceneHost::waitForSlice(Clock::time_point deviceFree) {
  if (!std::exchange(sliceInFlight_, false)) return;
  onDevice_->device.wait(submitted_);
  longestSlice_ = std::max(longestSlice_, Clock::now() - std::max(submittedAt_, deviceFree));
}

void SceneHost::adaptSlices() {
  SceneOnDevice& on = *onDevice_;
  const std::uint32_t slices = on.recorder.sliceCount();
  const double scale = schedule::seconds(kSliceTime) / schedule::seconds(longestSlice_);
  if (scale < 1 || slices > 1) on.scaleSlices(scale);
}

void SceneHost::beginJournal() {
  journalBegan_ = false;
  if (!live_.journal || !live_.journal->due() || recovery_ != Recovery::none || sinceHealthy_ == 0) return;
  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  // Frames of earlier ticks must not become part of the recording.
  publisher_.drain();
  const double seconds = static_cast<double>(tick_) * scene_.tickSeconds();
  live_.journal->begin(on.device.info(), scene_,
                       messages::toDescription(scene_, LiveScene::kEpoch, live_.codec(), seconds),
                       on.simulation.collectState(tick_), on.start);
  journalBegan_ = true;
  sinceKeyFrame_ = kMaxKeyFrameDistance;
}

void SceneHost::announceRecording() {
  if (!live_.journal || live_.journal->active() == recorded_) return;
  recorded_ = !recorded_;
  live_.subscribers.announce(recorded_ ? recordingNotice(tick_)
                                       : delivery::notice(v1::NOTICE_KIND_RECORDING_STOPPED,
                                                          "the recording of the scene has stopped", tick_));
}

void SceneHost::reset() {
  recovery_ = Recovery::reset;
  owesFrame_ = true;
  sinceHealthy_ = 0;
  newestState_ = onDevice_->start;
  newestState_.tick = tick_;
  grabsThen_.clear();
}

void SceneHost::applyInputs() {
  live_.inbox.drain(inputs_);
  applyChanges();
  for (Poses& poses : inputs_.poses) {
    const model::ParticipantPoses& now = poses.now.poses;
    const bool moves =
        !now.colliders.empty() || !now.grabs.empty() || !now.attachments.empty() || !now.joints.empty();
    if (moves && poseArrivals_.size() < kMaxPoseArrivals) poseArrivals_.push_back(poses.now.arrival);
    poses_.add(std::move(poses));
  }
  if (recoveries_.ignores(tick_)) return;
  poses_.place(tickStart_, [this](std::uint64_t participant, const model::ParticipantPoses& poses) {
    colliders_.place(participant, poses.colliders);
    colliders_.placeJoints(poses.joints);
    grabs_.place(participant, poses.grabs, poses.attachments);
    contactRequests_.set(participant, poses.wantsContacts);
    constraintRequests_.set(participant, poses.wantsConstraints);
  });
}

void SceneHost::applyChanges() {
  const std::span<AcceptedChange> changes = inputs_.changes;
  if (changes.empty()) return rehearsal_.dropFinished();
  std::string problem;
  std::size_t applied = 0;
  try {
    applied = applySome(changes, problem);
  } catch (...) {
    // The device was lost, or memory ran out. The scene is rebuilt before the next tick.
    live_.inbox.putBack(changes);
    throw;
  }
  if (applied == changes.size()) return;
  if (applied > 0 || problem.empty()) return live_.inbox.putBack(changes.subspan(applied));
  live_.inbox.putBack(changes.subspan(1));
  revertChanges(problem);
}

std::size_t SceneHost::applySome(std::span<const AcceptedChange> changes, std::string& problem) {
  model::Scene changed = scene_;
  for (const AcceptedChange& accepted : changes) model::applyChange(changed, accepted.change);
  if (onDevice_->simulation.makesStages(changed.cloths)) {
    if (!making_.allows(tickStart_)) return 0;
    changes = changes.first(rehearsal_.rehearsed(onDevice_, scene_, changes));
    if (const double seconds = rehearsal_.takeSeconds(); seconds > 0)
      making_.pay(tickStart_, kRehearsalCost * seconds);
    if (changes.empty()) return 0;
  } else {
    rehearsal_.dropFinished();
  }
  if (apply(changes, problem)) return changes.size();
  // One of them has room, or is the problem.
  return changes.size() > 1 && apply(changes.first(1), problem) ? 1 : 0;
}

bool SceneHost::apply(std::span<const AcceptedChange> changes, std::string& problem) {
  model::Scene next = scene_;
  std::vector<std::uint64_t> easeUntil = easeUntil_;
  const std::uint64_t made = onDevice_->simulation.stagesMade();
  const Clock::duration madeIn = makingTime_;
  bool hasRoom = true;
  for (const AcceptedChange& accepted : changes) {
    model::Scene changed = next;
    model::applyChange(changed, accepted.change);
    easeSolverChanges(next, changed, easeUntil);
    next = std::move(changed);
  }
  if (std::ranges::any_of(changes, [](const AcceptedChange& each) { return !each.change.cloths.empty(); })) {
    try {
      setCloths(next.cloths);
    } catch (const vulkan::DeviceLost&) {
      throw;
    } catch (const std::runtime_error& noRoom) {
      problem = noRoom.what();
      hasRoom = false;
    }
  }
  if (onDevice_->simulation.stagesMade() > made)
    making_.pay(tickStart_, schedule::seconds(makingTime_ - madeIn));
  if (!hasRoom) return false;
  scene_ = std::move(next);
  easeUntil_ = std::move(easeUntil);
  noteChange();
  for (const AcceptedChange& accepted : changes)
    live_.subscribers.announce(
        delivery::parametersChanged(accepted.message, tick_ + 1, accepted.participant));
  return true;
}

void SceneHost::noteChange() {
  parametersChanged_ = true;
  if (!recoveries_.hasCandidate()) candidate_ = parametersOf(scene_);
  recoveries_.changed(tick_);
}

SceneHost::Parameters SceneHost::parametersOf(const model::Scene& scene) {
  Parameters parameters{.environment = scene.environment, .cloths = scene.cloths};
  for (model::Cloth& cloth : parameters.cloths) cloth.solver.correctionFraction.reset();
  return parameters;
}

void SceneHost::easeSolverChanges(const model::Scene& before, model::Scene& changed,
                                  std::vector<std::uint64_t>& easeUntil) const {
  const auto part = static_cast<float>(changed.substepSeconds() / kEaseTime);
  for (std::size_t i = 0; i < changed.cloths.size(); ++i) {
    model::Solver& solver = changed.cloths[i].solver;
    if (solver.kind != before.cloths[i].solver.kind)
      easeUntil[i] = tick_ + static_cast<std::uint64_t>(std::ceil(kEaseSeconds * rate_));
    if (easeUntil[i] > tick_) solver.correctionFraction = std::min(part, model::correctionFraction(solver));
  }
}

void SceneHost::endEasing() {
  bool ended = false;
  for (std::size_t i = 0; i < easeUntil_.size(); ++i) {
    if (easeUntil_[i] != tick_ || !scene_.cloths[i].solver.correctionFraction) continue;
    scene_.cloths[i].solver.correctionFraction.reset();
    ended = true;
  }
  if (ended) setCloths(scene_.cloths);
}

void SceneHost::setCloths(const std::vector<model::Cloth>& cloths) {
  const struct Measure {
    Clock::duration& time;
    Clock::time_point began = Clock::now();
    ~Measure() { time += Clock::now() - began; }
  } measure{makingTime_};
  onDevice_->simulation.setCloths(cloths);
  clothsChanged_ = true;
}

void SceneHost::revertChanges(const std::string& reason) {
  const std::string text = fmt::format("a parameter change was undone: {}", reason);
  telemetry::log({live_.name()}, spdlog::level::warn, "tick {}: {}", tick_, text);
  live_.subscribers.announce(delivery::parametersChanged(live_.revertTo(scene_), tick_ + 1));
  live_.subscribers.announce(delivery::notice(v1::NOTICE_KIND_CHANGE_UNDONE, text, tick_));
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
  delivery::RequestedFrames requested = live_.subscribers.requested(now);
  const bool isRecorded = live_.journal && live_.journal->active();
  if (isRecorded) requested.qualities |= 1;
  encode::QualityEncoders& encoders = onDevice_->encoders;
  for (std::uint8_t quality = 0; quality < encoders.count(); ++quality) {
    if ((requested.qualities >> quality & 1) == 0) {
      encoders.unwanted(quality, now);
      continue;
    }
    encode::FrameEncoder* const encoder = encoders.wanted(quality, now);
    if (encoder == nullptr) continue;
    if (!encoder->canRecord()) {
      live_.metrics.skippedFrames.add();
      continue;
    }
    const bool due = isRecorded && quality == 0 && sinceKeyFrame_ + 1 >= kMaxKeyFrameDistance;
    const bool keyRequested =
        (requested.keyFrames >> quality & 1) != 0 && now - lastKeyFrame_[quality] >= kKeyFrameInterval;
    frame_.recorded.push_back({.encoder = encoder, .quality = quality, .key = due || keyRequested});
  }
}

void SceneHost::recordFrame(Clock::time_point now) {
  chooseEncoders(now);
  hasFrame_ = !frame_.recorded.empty();
  if (!hasFrame_) return;
  SceneOnDevice& on = *onDevice_;
  if (scene_.stream.normals == model::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  hasReport_ = ticksPerReport_ > 0 && tick_ + 1 >= nextReport_;
  if (hasReport_) {
    on.simulation.recordReport(on.recorder, tickInputs_);
    nextReport_ = tick_ + 1 + ticksPerReport_;
  }
  ++sinceKeyFrame_;
  for (delivery::CompleteFrame::Recorded& recorded : frame_.recorded) {
    recorded.frame = recorded.encoder->record(on.recorder, tick_ + 1, recorded.key);
    if (recorded.frame.kind != codec::PacketKind::key) continue;
    lastKeyFrame_[recorded.quality] = now;
    if (recorded.quality == 0) sinceKeyFrame_ = 0;
  }
  // Key frames first: a subscriber that changes its quality must get the new quality's key frame before the
  // former quality's frame of the same tick.
  std::partition(frame_.recorded.begin(), frame_.recorded.end(),
                 [](const delivery::CompleteFrame::Recorded& recorded) {
                   return recorded.frame.kind == codec::PacketKind::key;
                 });
  describeFrame(tickStart_);
  std::swap(frame_.poseArrivals, poseArrivals_);
  poseArrivals_.clear();
}

void SceneHost::describeFrame(Clock::time_point start) {
  frame_.subscribers = &live_.subscribers;
  frame_.metrics = &live_.metrics;
  frame_.repeated = false;
  frame_.fields->set_frame_divisor(work_.frameDivisor > 1 ? work_.frameDivisor : 0);
  frame_.fields->set_tick_time_us(schedule::microseconds(start));
  colliders_.write(scene_, *frame_.fields);
}

void SceneHost::encodePausedFrame(Clock::time_point now) {
  // The next tick replaces the present state.
  if (recovery_ != Recovery::none) return;
  SceneOnDevice& on = *onDevice_;
  const std::uint8_t needed = live_.subscribers.needsKeyFrame();
  frame_.recorded.clear();
  for (std::uint8_t quality = 0; quality < on.encoders.count(); ++quality) {
    if ((needed >> quality & 1) == 0 || now - lastKeyFrame_[quality] < kKeyFrameInterval) continue;
    encode::FrameEncoder* const encoder = on.encoders.wanted(quality, now);
    if (encoder == nullptr || !encoder->canRecord()) continue;
    frame_.recorded.push_back({.encoder = encoder, .quality = quality, .key = true});
  }
  if (frame_.recorded.empty()) return;
  on.recorder.begin();
  if (scene_.stream.normals == model::Normals::octahedral) on.simulation.recordNormals(on.recorder);
  for (delivery::CompleteFrame::Recorded& recorded : frame_.recorded) {
    // The subscribers now hold different newest frames. The next frame is therefore a key frame.
    recorded.encoder->forgetHistory();
    recorded.frame = recorded.encoder->record(on.recorder, tick_, true);
    recorded.encoder->forgetHistory();
    lastKeyFrame_[recorded.quality] = now;
  }
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  const simulation::TickStatus status =
      simulation::statusOf(on.simulation.collectState(tick_), model::reachOf(scene_.stream));
  describeFrame(now);
  frame_.repeated = true;
  frame_.fields->clear_report();
  frame_.poseArrivals.clear();
  frame_.discarded = !status.healthy;
  frame_.fields->set_state_hash(status.stateHash);
  frame_.deviceDone = Clock::now();
  publisher_.push(frame_);
}

void SceneHost::finish() {
  SceneOnDevice& on = *onDevice_;
  for (waitForSlice(); hasSlices(); waitForSlice()) submitSlice();
  adaptSlices();
  const Clock::time_point done = Clock::now();
  status_ = on.simulation.status();
  ++tick_;
  if (live_.journal)
    live_.journal->ticked({.tick = tick_,
                           .status = status_,
                           .recovery = recovered_,
                           .keepsState = keepsState_,
                           .clothsChanged = clothsChanged_,
                           .substeps = work_.substeps,
                           .scene = scene_,
                           .inputs = tickInputs_,
                           .colliders = colliders_});
  if (const std::vector<float> depths = on.simulation.depths(); !depths.empty()) colliders_.settle(depths);
  clothsChanged_ = false;
  if (status_.healthy) {
    ++sinceHealthy_;
    live_.tick = tick_;
    live_.setClothBounds({status_.low, status_.high});
    if (recoveries_.valid(tick_)) {
      Parameters next = recoveries_.hasCandidate() ? parametersOf(scene_) : Parameters();
      proven_ = std::exchange(candidate_, std::move(next));
    }
    if (savesState_) {
      newestState_ = on.simulation.collectState(tick_);
      if (recordsState_ && live_.journal) live_.journal->saved(newestState_);
    }
  }
  telemetry::SceneMetrics& metrics = live_.metrics;
  traceTick(done);
  double total = 0, report = 0;
  for (const vulkan::StageTime& stage : on.recorder.stageTimes()) {
    metrics.device.record(stage.stage, stage.seconds);
    total += stage.seconds;
    if (stage.stage == "report") report = stage.seconds;
  }
  if (hasFrame_) {
    if (hasReport_)
      writeReport(total - report);
    else
      frame_.fields->clear_report();
    frame_.discarded = !status_.healthy;
    frame_.fields->set_state_hash(status_.stateHash);
    frame_.deviceDone = done;
    publisher_.push(frame_);
  }
  announceEvents();
  if (status_.healthy && savesState_) {
    // The slots now know the events that were announced, so that none is announced again later.
    grabsThen_ = grabs_.state().slots;
    if (live_.keeper) live_.keeper->save(checkpoint());
  }
  announceRecording();
  if (!status_.healthy) recover();

  metrics.ticks.add();
  metrics.crowdedBalls.add(status_.crowded);
  metrics.tick.record(schedule::seconds(done - tickStart_));
  metrics.deviceTotal.record(total);
  // A device may compile new kernels when they first run.
  if (making_.made()) making_.pay(tickStart_, std::max(0.0, total - deviceSeconds_.value_or(total)));
  deviceSeconds_ = total > 0 ? std::optional(total) : std::nullopt;
  ownSeconds_ =
      total > 0 ? std::optional(total + schedule::seconds(beginTime_ + (Clock::now() - done))) : std::nullopt;
}

// The device tells how long its stages took, not when they began: they end together with the tick.
void SceneHost::traceTick(Clock::time_point done) {
  using telemetry::TraceTrack;
  telemetry::Trace& trace = live_.metrics.trace;
  trace.add({"record", TraceTrack::tick, tickStart_, beginTime_, tick_});
  trace.add({"wait for the device", TraceTrack::tick, tickStart_ + beginTime_, done - tickStart_ - beginTime_,
             tick_});
  const auto length = [](const vulkan::StageTime& stage) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(stage.seconds));
  };
  const std::span<const vulkan::StageTime> stages = onDevice_->recorder.stageTimes();
  Clock::time_point start = done;
  for (const vulkan::StageTime& stage : stages) start -= length(stage);
  for (const vulkan::StageTime& stage : stages) {
    trace.add({stage.stage, TraceTrack::device, start, length(stage), tick_});
    start += length(stage);
  }
}

void SceneHost::writeReport(double deviceSeconds) {
  v1::SimulationReport& message = *frame_.fields->mutable_report();
  message.Clear();
  message.set_device_seconds(deviceSeconds);
  const std::vector<simulation::ClothReport> reports = onDevice_->simulation.report();
  const std::vector<std::vector<std::uint32_t>> ends = onDevice_->simulation.constraintEnds();
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

void SceneHost::announceEvents() {
  v1::ServerMessage message;
  v1::TickEvents& events = *message.mutable_tick_events();
  events.set_tick(tick_);
  grabs_.addEvents(onDevice_->simulation.grabs(), events);
  contacts_.addEvents(tick_, scene_, colliders_, onDevice_->simulation.contacts(), events);
  if (events.grabs().empty() && events.contacts().empty()) return;
  live_.subscribers.announce(delivery::serialise(message));
}

void SceneHost::recover() {
  using Cure = RecoveryPolicy::Cure;
  const Cure cure = recoveries_.invalid(tick_, isTouched());
  sinceHealthy_ = 0;
  recovery_ = cure == Cure::rollback ? Recovery::rollback : Recovery::reset;
  (cure == Cure::rollback ? live_.metrics.rollbacks : live_.metrics.resets).add();
  std::string text = status_.outOfReach ? messages::outOfReach(scene_) : "the simulation became unstable";
  switch (cure) {
    case Cure::rollback:
      text += ": the scene continues from its newest healthy state, at most a second old";
      break;
    case Cure::reset:
      text += " twice within a second: its cloths continue from their start";
      break;
    case Cure::resetAndLetGo:
      text +=
          " twice within a second: its cloths continue from their start, and colliders and grabs of "
          "participants act again after a second";
      break;
    case Cure::resetAndUndo:
      text +=
          " twice within a second: its cloths continue from their start, without the newest changes of "
          "parameters";
      break;
  }
  if (cure == Cure::resetAndLetGo) letGo();
  if (cure == Cure::resetAndUndo) undoChanges();
  if (!recoveryNotices_.take(Clock::now())) return;
  telemetry::log({live_.name()}, spdlog::level::warn, "tick {}: {}", tick_, text);
  live_.subscribers.announce(delivery::notice(v1::NOTICE_KIND_ROLLED_BACK, text, tick_));
}

void SceneHost::letGo() {
  colliders_.letGo();
  grabs_.letGo();
  poses_.repeat();
}

void SceneHost::undoChanges() {
  scene_.environment = proven_.environment;
  scene_.cloths = proven_.cloths;
  parametersChanged_ = clothsChanged_ = true;
  live_.subscribers.announce(delivery::parametersChanged(live_.revertTo(scene_), tick_ + 1));
  // Last, because a device that is lost here gets them when it is rebuilt.
  setCloths(scene_.cloths);
}

void SceneHost::releaseCoarseEncoders() {
  publisher_.drain();
  onDevice_->encoders.drop();
}

void SceneHost::release() {
  rehearsal_.end();
  onDevice_.reset();
}

void SceneHost::rebuild(std::unique_ptr<SceneOnDevice> loaded, std::string_view why) {
  SceneOnDevice& fresh = *loaded;
  fresh.simulation.setCloths(scene_.cloths);
  fresh.simulation.setSubsteps(work_.substeps, scene_.cloths);
  grabs_.goBack(grabsThen_, newestState_.held);
  fresh.recorder.begin();
  fresh.simulation.recordRestoreState(fresh.recorder, newestState_);
  fresh.simulation.recordRestoreGrabs(fresh.recorder, newestState_.held);
  fresh.device.wait(fresh.device.submit(fresh.recorder));
  onDevice_ = std::move(loaded);
  recovery_ = Recovery::none;
  sinceHealthy_ = 0;
  if (live_.journal) live_.journal->restored(tick_, newestState_);
  live_.subscribers.announce(
      delivery::notice(v1::NOTICE_KIND_DEVICE_REBUILT,
                       fmt::format("{}; the scene goes on from its state {:.1f} s earlier", why,
                                   static_cast<double>(tick_ - newestState_.tick) / rate_),
                       tick_));
}

}  // namespace clothstream::scene

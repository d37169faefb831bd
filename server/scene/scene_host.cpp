// SPDX-License-Identifier: MIT
#include "server/scene/scene_host.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/messages/description.h"
#include "server/messages/scene_message.h"
#include "server/telemetry/log.h"

namespace clothstream::scene {

SceneHost::SceneHost(vulkan::Device& device, LiveScene& scene, delivery::FramePublisher& publisher,
                     double reportRate, SceneLoader* loader)
    : SceneHost(std::make_unique<SceneOnDevice>(device, scene.start(), publisher.workers()), scene, publisher,
                reportRate, loader) {}

SceneHost::SceneHost(std::unique_ptr<SceneOnDevice> loaded, LiveScene& scene,
                     delivery::FramePublisher& publisher, double reportRate, SceneLoader* loader)
    : live_(scene),
      onDevice_(std::move(loaded)),
      parameters_(scene.start(), loader),
      interaction_(scene.start()),
      surfacePreparation_(loader),
      frames_(scene, publisher, reportRate),
      recovery_(scene.start()),
      snapshot_{.state = onDevice_->start, .followed = interaction_.colliders().followedAtStart()},
      wantedWork_(scene.allWork()),
      work_(wantedWork_),
      leastSubsteps_(scene.leastSubsteps(scene.start())),
      windRoom_(scene.roomForWind(scene.start(), work_.substeps)) {
  live_.work = work_;
  const std::shared_ptr<const LiveScene::Restored> restored = live_.restored();
  if (restored) continueFrom(*restored);
  if (live_.journal && live_.journal->due()) beginJournal(tick_ == 0 ? onDevice_->start : snapshot_.state);
  // Until here a failure leaves the restored state to the next host.
  if (restored) live_.forgetRestored();
}

SceneHost::~SceneHost() {
  frames_.drain();  // the journal gets them
  if (live_.journal) live_.journal->end();
}

void SceneHost::continueFrom(const LiveScene::Restored& restored) {
  if (restored.checkpoint) {
    const Checkpoint& from = *restored.checkpoint;
    tick_ = from.state.tick;
    parameters_.restore(from.scene, from.easeUntil);
    interaction_.restore(from.colliders, from.grabs, from.winds);
    recovery_.restore(from.lastRecovery);
    snapshot_ = {.state = from.state,
                 .grabs = interaction_.grabs().slots,
                 .followed = interaction_.colliders().followed()};
    wantedWork_ = work_ = from.work;
    live_.work = work_;
    continueOn(*onDevice_);
    telemetry::log({live_.name()}, spdlog::level::info, "continues after tick {}", tick_);
  }
  if (restored.accepted) parameters_.replace(*onDevice_, *restored.accepted, tick_);
  recovery_.changed(tick_, parameters_.scene());
}

void SceneHost::continueOn(SceneOnDevice& on) {
  const std::vector<model::Cloth>& cloths = parameters_.scene().cloths;
  on.simulation.setCloths(cloths);
  on.simulation.setSubsteps(work_.substeps, cloths);
  on.recorder.begin();
  on.simulation.recordRestoreState(on.recorder, snapshot_.state);
  on.simulation.recordRestoreGrabs(on.recorder, snapshot_.state.held);
  on.device.wait(on.device.submit(on.recorder));
}

Checkpoint SceneHost::checkpoint() const {
  return {.state = snapshot_.state,
          .scene = parameters_.scene(),
          .easeUntil = parameters_.easeUntil(),
          .colliders = interaction_.colliders().state(),
          .grabs = interaction_.grabs(),
          .winds = interaction_.winds(),
          .lastRecovery = recovery_.newestFailure(),
          .work = work_};
}

void SceneHost::saveLast() {
  // A state that a rollback or a reset will replace is not worth keeping; neither is the start.
  if (!live_.keeper || recovery_.next() != Recovery::none || tick_ == 0) return;
  readState();
  live_.keeper->save(checkpoint());
}

std::optional<Checkpoint> SceneHost::stateNow() {
  if (recovery_.next() != Recovery::none)
    throw std::runtime_error("its newest state is not valid; try again later");
  if (tick_ == 0) return std::nullopt;
  readState();
  return checkpoint();
}

void SceneHost::readState() {
  if (snapshot_.state.tick == tick_) return;
  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  snapshot_ = {.state = on.simulation.collectState(tick_),
               .grabs = interaction_.grabs().slots,
               .followed = interaction_.colliders().followed()};
}

void SceneHost::begin(Clock::time_point now) {
  const Clock::time_point began = Clock::now();
  current_ = {.start = now};
  parameters_.beginTick();
  beginJournalIfDue();
  if (live_.resetRequested.exchange(false)) reset();
  parameters_.endEasing(*onDevice_, tick_);
  applyInputs();
  applyWork();
  // The first tick of a recording keeps a checkpoint, so that no rollback goes back to before it.
  current_.keepsState = recovery_.checkpointDue() || (current_.beginsJournal && recovery_.isHealthy());
  if (current_.keepsState) interaction_.keepState();
  interaction_.advance(parameters_.scene(), tick_, recovery_.next(), windRoom_, readyForSurfaces());
  record();
  current_.recording = Clock::now() - began;
  onDevice_->slices.begin();
}

void SceneHost::beginJournalIfDue() {
  if (!live_.journal || !live_.journal->due() || !recovery_.isHealthy()) return;
  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  on.simulation.recordSaveState(on.recorder);
  on.device.wait(on.device.submit(on.recorder));
  // Frames of earlier ticks must not become part of the recording.
  frames_.drain();
  beginJournal(on.simulation.collectState(tick_));
  current_.beginsJournal = true;
  frames_.beginRecording();
}

void SceneHost::beginJournal(const simulation::StateSnapshot& state) {
  const model::Scene& scene = parameters_.scene();
  const double seconds = static_cast<double>(tick_) * scene.tickSeconds();
  live_.journal->begin(onDevice_->device.info(), scene,
                       messages::toDescription(scene, kEpoch, live_.codec(), seconds), state,
                       onDevice_->start);
}

void SceneHost::reset() {
  recovery_.reset();
  frames_.owe();
  snapshot_ = {.state = onDevice_->start, .followed = interaction_.colliders().followedAtStart()};
  snapshot_.state.tick = tick_;
}

void SceneHost::applyInputs() {
  live_.inbox.drain(inputs_);
  applyChanges();
  for (Poses& poses : inputs_.poses) interaction_.add(std::move(poses));
  if (recovery_.ignoresParticipants(tick_)) return;
  interaction_.place(current_.start);
  takeSurfaces();
}

void SceneHost::takeSurfaces() {
  if (live_.surfaces.take(surfaceVersion_, roomSurfaces_)) interaction_.placeSurfaces(roomSurfaces_);
}

const simulation::ClothSimulation* SceneHost::readyForSurfaces() {
  if (!interaction_.hasSurfaces() && !onDevice_->simulation.hasSurfaces()) return nullptr;
  if (surfacePreparation_.isReady(onDevice_)) return &onDevice_->simulation;
  if (const std::string problem = surfacePreparation_.takeProblem(); !problem.empty()) {
    const std::string text = fmt::format("surfaces of the real room do not act in this scene: {}", problem);
    telemetry::log({live_.name()}, spdlog::level::warn, "tick {}: {}", tick_, text);
    live_.subscribers.announce(delivery::notice(v1::NOTICE_KIND_CHANGE_UNDONE, text, tick_));
  }
  return nullptr;
}

void SceneHost::applyChanges() {
  const std::span<AcceptedChange> changes = inputs_.changes;
  SceneParameters::Applied applied;
  try {
    applied = parameters_.apply(onDevice_, changes, tick_, current_.start);
  } catch (...) {
    // The device was lost. The scene is rebuilt before the next tick.
    live_.inbox.putBack(changes);
    throw;
  }
  if (applied.count > 0) recovery_.changed(tick_, parameters_.scene());
  for (const AcceptedChange& accepted : changes.first(applied.count))
    live_.subscribers.announce(
        delivery::parametersChanged(accepted.message, tick_ + 1, accepted.participant));
  const bool refused = !applied.problem.empty();
  const std::span<AcceptedChange> waiting = changes.subspan(applied.count + (refused ? 1 : 0));
  if (!waiting.empty()) live_.inbox.putBack(waiting);
  if (refused) announceRefusal(applied.problem);
}

void SceneHost::announceRefusal(const std::string& reason) {
  const std::string text = fmt::format("a parameter change was undone: {}", reason);
  telemetry::log({live_.name()}, spdlog::level::warn, "tick {}: {}", tick_, text);
  announceParameters();
  live_.subscribers.announce(delivery::notice(v1::NOTICE_KIND_CHANGE_UNDONE, text, tick_));
}

void SceneHost::announceParameters() {
  live_.subscribers.announce(delivery::parametersChanged(live_.revertTo(parameters_.scene()), tick_ + 1));
}

void SceneHost::applyWork() {
  const model::Scene& scene = parameters_.scene();
  const bool changed = parameters_.takeChanged();
  if (changed) leastSubsteps_ = live_.leastSubsteps(scene);
  schedule::WorkLevel work = wantedWork_;
  work.substeps = std::clamp(leastSubsteps_, work.substeps, scene.substeps);
  if (changed || work.substeps != work_.substeps) windRoom_ = live_.roomForWind(scene, work.substeps);
  if (work == work_) return;
  if (work.substeps != work_.substeps) onDevice_->simulation.setSubsteps(work.substeps, scene.cloths);
  const bool more = work.frameDivisor < work_.frameDivisor || work.substeps > work_.substeps;
  (more ? live_.metrics.overloadStepsUp : live_.metrics.overloadStepsDown).add();
  work_ = work;
  live_.work = work;
  telemetry::log({live_.name()}, spdlog::level::info, "tick {}: every {}. frame, {} of {} substeps",
                 tick_ + 1, work.frameDivisor, work.substeps, scene.substeps);
  live_.subscribers.announce(workNotice(live_, tick_ + 1));
}

void SceneHost::record() {
  SceneOnDevice& on = *onDevice_;
  on.recorder.begin();
  recordRecovery();
  if (current_.keepsState) on.simulation.recordCheckpoint(on.recorder);
  on.simulation.recordTick(on.recorder, interaction_.inputs());
  parameters_.tickRecorded();
  frames_.record(on, tick_ + 1, parameters_.scene(), interaction_, current_.start);
  current_.recordsState = recovery_.snapshotDue();
  const bool keeps = live_.keeper && live_.keeper->due(current_.start);
  current_.savesState = current_.recordsState || keeps;
  if (current_.savesState) on.simulation.recordSaveState(on.recorder);
}

void SceneHost::recordRecovery() {
  SceneOnDevice& on = *onDevice_;
  current_.recovery = recovery_.take();
  if (current_.recovery == Recovery::none) return;
  if (current_.recovery == Recovery::rollback) on.simulation.recordRollback(on.recorder);
  if (current_.recovery == Recovery::reset) on.simulation.recordRestoreState(on.recorder, on.start);
  on.encoders.forgetHistory();
}

void SceneHost::finish() {
  SceneOnDevice& on = *onDevice_;
  for (waitForSlice(); hasSlices(); waitForSlice()) submitSlice();
  on.slices.adapt();
  const Clock::time_point done = Clock::now();
  status_ = on.simulation.status();
  ++tick_;
  giveToJournal();
  interaction_.settle(on.simulation);
  if (status_.healthy) takeState();
  traceTick(done);
  telemetry::SceneMetrics& metrics = live_.metrics;
  double total = 0, report = 0;
  for (const vulkan::StageTime& stage : on.recorder.stageTimes()) {
    metrics.device.record(stage.stage, stage.seconds);
    total += stage.seconds;
    if (stage.stage == "report") report = stage.seconds;
  }
  frames_.publish(on, status_, total - report, done);
  announceEvents();
  if (status_.healthy && current_.savesState) keepSnapshot();
  announceRecording();
  if (!status_.healthy) recover();

  metrics.ticks.add();
  metrics.crowdedBalls.add(status_.crowded);
  metrics.tick.record(schedule::seconds(done - current_.start));
  metrics.deviceTotal.record(total);
  parameters_.payFirstRun(current_.start, std::max(0.0, total - deviceSeconds_.value_or(total)));
  deviceSeconds_ = total > 0 ? std::optional(total) : std::nullopt;
  const Clock::duration onThread = current_.recording + (Clock::now() - done);
  ownSeconds_ = total > 0 ? std::optional(total + schedule::seconds(onThread)) : std::nullopt;
}

void SceneHost::giveToJournal() {
  const bool clothsChanged = parameters_.takeClothsChanged();
  if (live_.journal)
    live_.journal->ticked({.tick = tick_,
                           .status = status_,
                           .recovery = current_.recovery,
                           .keepsState = current_.keepsState,
                           .clothsChanged = clothsChanged,
                           .substeps = work_.substeps,
                           .scene = parameters_.scene(),
                           .inputs = interaction_.inputs(),
                           .colliders = interaction_.colliders()});
}

void SceneHost::takeState() {
  live_.tick = tick_;
  live_.setClothBounds({status_.low, status_.high});
  recovery_.healthy(tick_, parameters_.scene());
  if (!current_.savesState) return;
  snapshot_.state = onDevice_->simulation.collectState(tick_);
  if (current_.recordsState && live_.journal) live_.journal->saved(snapshot_.state);
}

// The device tells how long its stages took, not when they began: they end together with the tick.
void SceneHost::traceTick(Clock::time_point done) {
  using telemetry::TraceTrack;
  telemetry::Trace& trace = live_.metrics.trace;
  const Clock::time_point submitted = current_.start + current_.recording;
  trace.add({"record", TraceTrack::tick, current_.start, current_.recording, tick_});
  trace.add({"wait for the device", TraceTrack::tick, submitted, done - submitted, tick_});
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

void SceneHost::announceEvents() {
  v1::TickEvents& events = *events_.mutable_tick_events();
  events.Clear();
  events.set_tick(tick_);
  interaction_.addEvents(parameters_.scene(), onDevice_->simulation, events);
  if (events.grabs().empty() && events.contacts().empty()) return;
  live_.subscribers.announce(delivery::serialise(events_));
}

void SceneHost::keepSnapshot() {
  // The slots now know the events that were announced, so that none is announced again later.
  snapshot_.grabs = interaction_.grabs().slots;
  snapshot_.followed = interaction_.colliders().followed();
  if (live_.keeper) live_.keeper->save(checkpoint());
}

void SceneHost::announceRecording() {
  if (!live_.journal || live_.journal->active() == recorded_) return;
  recorded_ = !recorded_;
  live_.subscribers.announce(recorded_ ? recordingNotice(tick_)
                                       : delivery::notice(v1::NOTICE_KIND_RECORDING_STOPPED,
                                                          "the recording of the scene has stopped", tick_));
}

void SceneHost::recover() {
  using Cure = SceneRecovery::Cure;
  const Cure cure = recovery_.unhealthy(tick_, interaction_.isTouched());
  (cure == Cure::rollback ? live_.metrics.rollbacks : live_.metrics.resets).add();
  if (cure == Cure::resetAndLetGo) {
    interaction_.letGo();
    surfaceVersion_ = 0;
  }
  if (cure == Cure::resetAndUndo) {
    parameters_.undo(recovery_.proven().environment, recovery_.proven().cloths);
    announceParameters();
    // Last, because a device that is lost here gets them when it is rebuilt.
    parameters_.upload(*onDevice_);
  }
  if (!recovery_.takeNotice(Clock::now())) return;
  const std::string text = fmt::format(
      "{}{}",
      status_.outOfReach ? messages::outOfReach(parameters_.scene()) : "the simulation became unstable",
      SceneRecovery::describe(cure));
  telemetry::log({live_.name()}, spdlog::level::warn, "tick {}: {}", tick_, text);
  live_.subscribers.announce(delivery::notice(v1::NOTICE_KIND_ROLLED_BACK, text, tick_));
}

void SceneHost::encodePausedFrame(Clock::time_point now) {
  // The next tick replaces the present state.
  if (recovery_.next() != Recovery::none) return;
  frames_.encodePaused(*onDevice_, tick_, parameters_.scene(), interaction_, now);
}

void SceneHost::releaseCoarseEncoders() {
  frames_.drain();
  onDevice_->encoders.drop();
}

void SceneHost::release() {
  frames_.drain();  // they use the encoders
  parameters_.endRehearsal();
  surfacePreparation_.end();
  onDevice_.reset();
}

void SceneHost::rebuild(std::unique_ptr<SceneOnDevice> loaded, std::string_view why) {
  interaction_.goBack(snapshot_.grabs, snapshot_.followed, snapshot_.state.held);
  continueOn(*loaded);
  surfacePreparation_.end();
  // Cloth would fall through the surfaces while another thread prepares them.
  if (interaction_.hasSurfaces()) surfacePreparation_.prepareNow(*loaded);
  onDevice_ = std::move(loaded);
  recovery_.rebuilt();
  if (live_.journal) live_.journal->restored(tick_, snapshot_.state);
  const double lost = static_cast<double>(tick_ - snapshot_.state.tick) / parameters_.scene().simulationRate;
  live_.subscribers.announce(delivery::notice(
      v1::NOTICE_KIND_DEVICE_REBUILT,
      fmt::format("{}; the scene goes on from its state {:.1f} s earlier", why, lost), tick_));
}

}  // namespace clothstream::scene

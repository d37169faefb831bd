// SPDX-License-Identifier: MIT
#include "server/hosting/device_thread.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::hosting {
namespace {

// Interval at which a paused scene looks for subscribers that need a key frame.
constexpr std::chrono::milliseconds kPausedFramePeriod{50};
// Pause after an error that belongs to no scene.
constexpr std::chrono::milliseconds kErrorPause{20};

// Scenes whose ticks one thread begins or finishes, one after the other. That takes about 15 us for each
// tick, and another thread needs about as long to wake up.
constexpr std::size_t kTogether = 4;

// Fails a promise of a task.
template <class Value>
void refuse(std::promise<Value>& promise, const char* why) {
  promise.set_exception(std::make_exception_ptr(std::runtime_error(why)));
}

}  // namespace

DeviceThread::DeviceThread(const vulkan::DeviceOptions& device,
                           const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
                           delivery::FramePublisher& publisher, telemetry::ServerMetrics& metrics,
                           scene::Budget& budget, bool runAlways, double reportRate, bool adaptsToLoad)
    : publisher_(publisher),
      metrics_(metrics),
      budget_(budget),
      runAlways_(runAlways),
      reportRate_(reportRate),
      adaptsToLoad_(adaptsToLoad),
      device_(device, publisher.workers(), [this] { wake(); }) {
  std::promise<void> ready;
  std::future<void> isReady = ready.get_future();
  thread_ = std::thread([this, &scenes, ready = std::move(ready)]() mutable { run(scenes, ready); });
  try {
    isReady.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

DeviceThread::~DeviceThread() {
  inbox_.stop();
  thread_.join();
}

void DeviceThread::wake(const scene::LiveScene& scene) {
  if (scene.source)
    scene.source->wake();
  else
    wake();
}

std::future<void> DeviceThread::add(std::shared_ptr<scene::LiveScene> scene) {
  return load(std::move(scene), false);
}

std::future<void> DeviceThread::prepare(std::shared_ptr<scene::LiveScene> scene) {
  return load(std::move(scene), true);
}

std::future<void> DeviceThread::load(std::shared_ptr<scene::LiveScene> scene, bool waits) {
  std::promise<void> ready;
  std::future<void> whenReady = ready.get_future();
  inbox_.post(
      std::packaged_task<void()>([this, scene = std::move(scene), ready = std::move(ready), waits]() mutable {
        if (!device_.isOpen()) return refuse(ready, "there is no device");
        runs_.push_back(std::make_unique<SceneRun>(std::move(scene)));
        runs_.back()->arrival.begin(std::move(ready), waits);
      }));
  return whenReady;
}

std::future<void> DeviceThread::start(std::shared_ptr<scene::LiveScene> scene) {
  std::promise<void> started;
  std::future<void> whenStarted = started.get_future();
  inbox_.post(
      std::packaged_task<void()>([this, scene = std::move(scene), started = std::move(started)]() mutable {
        SceneRun* const run = runOf(*scene);
        if (run == nullptr || !run->arrival.waits())
          return refuse(started, "the scene is not prepared any more");
        run->arrival.start(std::move(started));
      }));
  return whenStarted;
}

std::future<Departure::State> DeviceThread::hold(std::shared_ptr<scene::LiveScene> scene) {
  return read(std::move(scene), true);
}

std::future<Departure::State> DeviceThread::read(std::shared_ptr<scene::LiveScene> scene) {
  return read(std::move(scene), false);
}

std::future<Departure::State> DeviceThread::read(std::shared_ptr<scene::LiveScene> scene, bool holds) {
  std::promise<Departure::State> state;
  std::future<Departure::State> whenRead = state.get_future();
  inbox_.post(
      std::packaged_task<void()>([this, scene = std::move(scene), holds, state = std::move(state)]() mutable {
        SceneRun* const run = runOf(*scene);
        if (run == nullptr || run->arrival.waits() || run->departure.isBusy())
          return refuse(state, "it does not run here now");
        // A tick that has begun took its inputs before.
        const std::uint64_t more = run->begun ? 2 : 1;
        run->departure.request(std::move(state), holds, holds && run->host ? run->host->tick() + more : 0);
      }));
  return whenRead;
}

void DeviceThread::unhold(std::shared_ptr<scene::LiveScene> scene) {
  inbox_.post(std::packaged_task<void()>([this, scene = std::move(scene)] {
    if (SceneRun* const run = runOf(*scene)) run->departure.release();
  }));
}

void DeviceThread::adopt(std::shared_ptr<scene::LiveScene> scene) {
  inbox_.post(std::packaged_task<void()>([this, scene = std::move(scene)]() mutable {
    runs_.push_back(std::make_unique<SceneRun>(std::move(scene)));
  }));
}

std::future<void> DeviceThread::remove(std::shared_ptr<scene::LiveScene> scene) {
  return inbox_.post(std::packaged_task<void()>([this, scene = std::move(scene)] {
    std::erase_if(runs_, [&](const auto& run) { return run->scene == scene; });
  }));
}

SceneRun* DeviceThread::runOf(const scene::LiveScene& scene) const {
  for (const auto& run : runs_)
    if (run->scene.get() == &scene) return run.get();
  return nullptr;
}

std::span<schedule::TickSchedule* const> DeviceThread::schedules() {
  schedules_.clear();
  for (const auto& run : runs_) schedules_.push_back(run.get());
  return schedules_;
}

void DeviceThread::run(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
                       std::promise<void>& ready) {
  telemetry::nameThread("device");
  try {
    if (!scenes.empty()) {
      device_.open();
      budget_.setSpeed(device_.speed());
      for (const auto& scene : scenes) runs_.push_back(std::make_unique<SceneRun>(scene));
      SceneRun& first = *runs_.front();
      first.become(SceneState::loading);
      begin(first,
            std::make_unique<scene::SceneOnDevice>(*device_, first.scene->start(), publisher_.workers()));
    }
  } catch (...) {
    runs_.clear();
    device_.close();
    ready.set_exception(std::current_exception());
    return;
  }
  ready.set_value();

  for (;;) {
    try {
      if (!waitForWork()) break;
      inbox_.runTasks();
      takeLoadedScenes();
      startAndStopScenes();
      encodePausedFrames();
      runDueTicks();
      runSlice();
      readStates();
    } catch (const vulkan::DeviceLost& failure) {
      rebuildDevice(failure.what());
    } catch (const std::exception& failure) {
      spdlog::error("device thread: {}; trying again", failure.what());
      std::this_thread::sleep_for(kErrorPause);
    }
  }
  abandonLoading();
  saveLast();
  publisher_.drain();
  runs_.clear();
  batches_.clear();
  device_.close();
}

bool DeviceThread::waitForWork() {
  deviceMemory_ = device_.allocatedBytes();
  reservedDeviceMemory_ = device_.reservedBytes();
  lastAnswer_ = Clock::now();
  Clock::time_point due = Clock::time_point::max();
  scheduler_.observe(schedules(), lastAnswer_);
  for (const auto& run : runs_) due = std::min(due, std::max(run->due(), scheduler_.earliest(*run)));
  const bool goesOn = inbox_.waitForWork(due);
  idle_ += Clock::now() - lastAnswer_.load();
  return goesOn;
}

void DeviceThread::takeLoadedScenes() {
  for (const auto& run : runs_)
    if (run->isLoaded()) take(*run);
  std::erase_if(runs_, [](const auto& run) { return run->state() == SceneState::refused; });
}

void DeviceThread::take(SceneRun& run) {
  try {
    faults_.checkScene(run.scene->name());
    std::unique_ptr<scene::SceneOnDevice> loaded = run.takeLoaded();
    if (run.arrival.waits())
      run.keepPrepared(std::move(loaded));
    else
      begin(run, std::move(loaded));
    run.arrival.succeed();
  } catch (const vulkan::DeviceLost&) {
    countLoss(run);
    throw;
  } catch (const std::exception& failure) {
    if (run.arrival.fail(std::current_exception())) {
      run.become(SceneState::refused);
    } else if (run.host && run.rebuilds.rebuildFailed()) {
      run.become(SceneState::interrupted);
      telemetry::log({run.scene->name()}, spdlog::level::err, "cannot be rebuilt: {}; trying again",
                     failure.what());
    } else {
      run.giveUp(failure.what());
    }
  }
}

void DeviceThread::begin(SceneRun& run, std::unique_ptr<scene::SceneOnDevice> loaded) {
  if (run.host) {
    run.host->rebuild(std::move(loaded), run.rebuilds.reason());
  } else {
    run.host = std::make_unique<scene::SceneHost>(std::move(loaded), *run.scene, publisher_, reportRate_,
                                                  &device_.loader());
    // A host that continues from a checkpoint keeps the checkpoint's work.
    if (adaptsToLoad_ && run.host->tick() > 0) run.overload.beginAt(run.host->work());
  }
  run.host->setWork(run.overload.level());
  if (run.cost == Clock::duration::zero()) {
    const double seconds = run.scene->tickWork(run.host->colliders()).seconds(budget_.speed());
    run.cost = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }
  run.become(SceneState::idle);
}

void DeviceThread::startAndStopScenes() {
  const Clock::time_point now = Clock::now();
  SceneRun* const next = sceneToLoad(now);
  // While a scene is loaded, neither of the two may run: all others if it must be alone, and those that must.
  const auto mustWait = [&](const SceneRun& run) {
    return next != nullptr && (next->blame.isAlone(now) || run.blame.isAlone(now));
  };
  for (const auto& run : runs_) run->startOrStop(now, runAlways_, mustWait(*run));
  const bool busy = std::ranges::any_of(runs_, [&](const auto& run) { return run->begun && mustWait(*run); });
  if (next != nullptr && next->state() != SceneState::loading && !busy) next->load(device_);
}

SceneRun* DeviceThread::sceneToLoad(Clock::time_point now) const {
  const auto urgency = [&](const SceneRun& run) {
    return std::pair(&run == runs_.front().get(), run.scene->subscribers.receivers(now));
  };
  SceneRun* next = nullptr;
  for (const auto& run : runs_) {
    if (run->state() == SceneState::loading) return run.get();
    if (run->needsLoading(now) && (next == nullptr || urgency(*run) > urgency(*next))) next = run.get();
  }
  return next;
}

void DeviceThread::encodePausedFrames() {
  const Clock::time_point now = Clock::now();
  for (const auto& run : runs_) {
    if (run->state() != SceneState::paused || now < run->nextPausedFrame) continue;
    run->nextPausedFrame = now + kPausedFramePeriod;
    survives(*run, [&] {
      run->host->encodePausedFrame(now);
      faults_.checkScene(run->scene->name());
    });
  }
}

void DeviceThread::runDueTicks() {
  faults_.check();
  Clock::time_point before = Clock::now();
  // Ticks that an exception kept from being waited for.
  waitForTicks(before);
  scheduler_.choose(schedules(), before, chosen_);
  const bool oneByOne =
      std::ranges::any_of(runs_, [&](const auto& run) { return run->blame.isAlone(before); });
  const std::span<schedule::TickSchedule* const> due = chosen_;
  const std::size_t atOnce = oneByOne ? 1 : due.size();
  for (std::size_t begun = 0; begun < due.size(); begun += atOnce) {
    if (begun > 0) before = Clock::now();
    beginTicks(due.subspan(begun, atOnce), before);
    submitTicks(oneByOne);
    waitForTicks(before);
  }
}

void DeviceThread::beginTicks(std::span<schedule::TickSchedule* const> due, Clock::time_point& deviceFree) {
  const model::DeviceSpeed speed = budget_.speed();
  const auto begin = [&](std::size_t i) {
    SceneRun& run = static_cast<SceneRun&>(*due[i]);
    run.tick.used = {};
    run.beginTick(Clock::now(), speed);
  };
  runParts(due.size(), std::ref(begin));
  for (std::size_t i = 0; i < due.size(); ++i) {
    SceneRun& run = static_cast<SceneRun&>(*due[i]);
    if (!survives(run, [&] { checkPart(i); })) continue;
    run.become(SceneState::inFlight);
    chargeMaking(run, deviceFree);
  }
}

void DeviceThread::submitTicks(bool oneByOne) {
  together_.clear();
  for (schedule::TickSchedule* due : chosen_) {
    SceneRun& run = static_cast<SceneRun&>(*due);
    if (run.state() == SceneState::inFlight && run.host->fitsIntoBatch()) together_.push_back(&run);
  }
  if (oneByOne || together_.size() == 1) together_.clear();
  if (!together_.empty()) {
    try {
      faults_.checkBatch();
      batches_.submit(*device_, together_);
    } catch (const vulkan::DeviceLost&) {
      countLoss(*together_.front());
      throw;
    } catch (const std::exception& failure) {
      // Nothing shows which tick is to blame, and none can be submitted again.
      for (SceneRun* run : together_) rebuildScene(*run, failure.what());
      batches_.end();
    }
  }
  for (schedule::TickSchedule* due : chosen_) {
    SceneRun& run = static_cast<SceneRun&>(*due);
    if (run.state() == SceneState::inFlight && run.host->isUnsubmitted())
      survives(run, [&] { run.host->submitSlice(); });
  }
}

void DeviceThread::waitForTicks(Clock::time_point deviceFree) {
  noteDisturbances();
  for (const auto& batch : batches_.inFlight()) waitForBatch(*batch, deviceFree);
  batches_.end();
  for (const auto& run : runs_) waitForFirstSlice(*run, deviceFree);
}

void DeviceThread::waitForBatch(TickBatches::Members& batch, Clock::time_point& deviceFree) {
  try {
    device_->wait(batch.submitted);
  } catch (const vulkan::DeviceLost&) {
    countLoss(*batch.runs.front());
    throw;
  }
  // Each tick knows its part of the device's time before the first one is finished.
  batch.batch.shareTimes();
  const Clock::time_point done = Clock::now();
  batch.divide(done - std::exchange(deviceFree, done));
  const auto finish = [&](std::size_t i) {
    SceneRun& run = *batch.runs[i];
    faults_.checkScene(run.scene->name());
    run.host->finish();
  };
  runParts(batch.runs.size(), std::ref(finish));
  for (std::size_t i = 0; i < batch.runs.size(); ++i) {
    SceneRun& run = *batch.runs[i];
    if (!survives(run, [&] { checkPart(i); })) continue;
    run.become(SceneState::betweenSlices);
    noteSlice(run, batch.times[i]);
    endTick(run);
  }
}

void DeviceThread::runSlice() {
  const Clock::time_point before = Clock::now();
  scheduler_.observe(schedules(), before);
  // The scene whose previous slice ended first.
  SceneRun* next = nullptr;
  for (const auto& run : runs_)
    if (run->begun && scheduler_.earliest(*run) <= before &&
        (next == nullptr || run->tick.served < next->tick.served))
      next = run.get();
  if (next == nullptr) return;
  noteDisturbances();
  const bool survived = survives(*next, [&] {
    next->host->submitSlice();
    next->host->waitForSlice();
  });
  if (survived) endSlice(*next, Clock::now() - before);
}

void DeviceThread::readStates() {
  for (const auto& run : runs_) {
    Departure& departure = run->departure;
    if (!departure.isDue(run->state(), run->host ? run->host->tick() : 0)) continue;
    try {
      Departure::State state = run->stateNow();
      if (departure.holds()) run->stand();
      departure.give(std::move(state));
    } catch (const vulkan::DeviceLost&) {
      departure.fail(std::make_exception_ptr(std::runtime_error("the device was lost")));
      countLoss(*run);
      throw;
    } catch (const std::exception&) {
      departure.fail(std::current_exception());
    }
  }
}

bool DeviceThread::survives(SceneRun& run, const std::function<void()>& partOfTick) {
  try {
    partOfTick();
    return true;
  } catch (const vulkan::DeviceLost&) {
    countLoss(run);
    throw;
  } catch (const std::exception& failure) {
    rebuildScene(run, failure.what());
    return false;
  }
}

void DeviceThread::waitForFirstSlice(SceneRun& run, Clock::time_point& deviceFree) {
  if (run.state() != SceneState::inFlight) return;
  const bool survived = survives(run, [&] {
    run.host->waitForSlice(deviceFree);
    faults_.checkScene(run.scene->name());
  });
  if (!survived) return;
  run.become(SceneState::betweenSlices);
  const Clock::time_point done = Clock::now();
  endSlice(run, done - std::exchange(deviceFree, done));
}

void DeviceThread::runParts(std::size_t count, const std::function<void(std::size_t)>& part) {
  failures_.assign(count, nullptr);
  const auto runGroup = [&](std::uint32_t group) {
    const std::size_t first = group * kTogether;
    for (std::size_t i = first; i < std::min(first + kTogether, count); ++i) {
      try {
        part(i);
      } catch (...) {
        failures_[i] = std::current_exception();
      }
    }
  };
  publisher_.workers().run(static_cast<std::uint32_t>((count + kTogether - 1) / kTogether),
                           std::ref(runGroup));
}

void DeviceThread::checkPart(std::size_t part) const {
  if (failures_[part]) std::rethrow_exception(failures_[part]);
}

bool DeviceThread::noteSlice(SceneRun& run, Clock::duration time) {
  run.tick.served = Clock::now();
  run.tick.used += time;
  scheduler_.used(run, time);
  // While a scene is loaded, its kernels lengthen slices. The end of the tick shows what the device did.
  return run.price.addSlice(schedule::seconds(time)) && !isDisturbed_;
}

void DeviceThread::endSlice(SceneRun& run, Clock::duration time) {
  const bool isLate = noteSlice(run, time);
  if (run.host->hasSlices()) return checkPrice(run, isLate);
  if (survives(run, [&] { run.host->finish(); })) endTick(run);
}

void DeviceThread::endTick(SceneRun& run) {
  run.become(SceneState::running);
  const Clock::time_point ended = Clock::now();
  run.tickEnded(run.tick.used, ended);
  adaptToLoad(run, ended);
  checkPrice(run, run.price.end(run.host->deviceSeconds()));
}

// The scenes whose slices this thread waits for afterwards are not charged for it.
void DeviceThread::chargeMaking(SceneRun& run, Clock::time_point& deviceFree) {
  const Clock::duration making = run.host->makingTime();
  run.tick.used += making;
  scheduler_.used(run, making);
  deviceFree = std::min(deviceFree + making, Clock::now());
}

void DeviceThread::adaptToLoad(SceneRun& run, Clock::time_point now) {
  if (!adaptsToLoad_) return;
  const double own = run.host->ownSeconds().value_or(schedule::seconds(run.tick.used));
  const std::uint32_t leastSubsteps = run.host->leastSubsteps();
  const bool changed = run.overload.note(
      {.now = now,
       .slippedTicks = run.tick.slippedTicks,
       .own = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(own)),
       .share = scheduler_.shareOf(run),
       .idle = idle_,
       .disturbed = isDisturbed_ || isMaking_},
      leastSubsteps);
  if (changed) run.host->setWork(run.overload.level());
}

void DeviceThread::noteDisturbances() {
  isDisturbed_ = isMaking_ = false;
  for (const auto& run : runs_) {
    isDisturbed_ = isDisturbed_ || run->usesLoader();
    isMaking_ = isMaking_ || (run->host && run->host->makingTime() > Clock::duration::zero());
  }
}

void DeviceThread::checkPrice(SceneRun& run, bool isLate) {
  bool isExcessive = false;
  const auto measure = [&] { isExcessive = run.price.isExcessive(device_.slowdown()); };
  if (!isLate || !survives(run, measure) || !isExcessive) return;
  stop(run, run.harm.exceedsPrice(Clock::now()),
       fmt::format(
           "its ticks take far longer than their price of {:.3f} s; the newest one has taken {:.3f} s{}",
           run.tick.price, schedule::seconds(run.tick.used), run.begun ? " so far" : ""));
  wake();  // participants may have joined it again already
}

void DeviceThread::stop(SceneRun& run, std::optional<Clock::duration> pause, const std::string& why) {
  const std::string text =
      fmt::format("the scene '{}' is stopped because it harms other scenes: {}", run.scene->name(), why);
  if (!pause) {
    metrics_.quarantines.add();
    return run.quarantine(text);
  }
  run.price = {};
  if (*pause == Clock::duration::zero())
    return run.giveUp(
        fmt::format("it harms other scenes: {}; join again to start it with its own parameters", why));
  metrics_.quarantines.add();
  run.scene->refuseUntil(Clock::now() + *pause, text);
  run.giveUp(fmt::format("it harms other scenes: {}; join again in {} s", why,
                         std::chrono::ceil<std::chrono::seconds>(*pause).count()));
}

void DeviceThread::countLoss(const SceneRun& noticed) {
  const Clock::time_point now = Clock::now();
  std::vector<SceneRun*> suspects;
  for (const auto& run : runs_)
    if (run.get() == &noticed || run->state() == SceneState::inFlight || run->usesLoader())
      suspects.push_back(run.get());
  const auto why =
      std::make_exception_ptr(std::runtime_error("the device was lost while the scene was being loaded"));
  for (SceneRun* suspect : suspects) {
    suspect->blame.count(now, suspects.size() == 1);
    if (suspect->arrival.fail(why)) suspect->become(SceneState::refused);
  }
}

void DeviceThread::rebuildScene(SceneRun& run, const std::string& reason) {
  try {
    device_->drain();
  } catch (const vulkan::DeviceLost&) {
    throw;
  } catch (const std::exception& failure) {
    throw vulkan::DeviceLost(failure.what());  // the device may still use what would be released
  }
  const std::uint64_t ticks = run.host->tick();
  run.release();
  wake();
  telemetry::log({run.scene->name()}, spdlog::level::err, "a tick failed: {}", reason);
  if (!run.rebuilds.tickFailed(ticks, run.scene->start().simulationRate)) run.giveUp(reason);
}

void DeviceThread::rebuildDevice(const std::string& reason) {
  spdlog::error("device: {}; rebuilding it and every scene", reason);
  // Frames of the old device are published first, because they use its memory.
  publisher_.drain();
  abandonLoading();
  try {
    if (device_.isOpen()) device_->drain();  // it may still work, if the driver only lacked memory
  } catch (const std::exception&) {
  }
  for (const auto& run : runs_) {
    run->dropTick();
    if (run->blame.take()) stop(*run, run->harm.losesDevice(), "the device was lost twice while it ran");
  }
  do {
    inbox_.runTasks();
    if (!inbox_.pauseUntil(device_.nextAttempt())) return;
  } while (!tryRebuildDevice());
}

bool DeviceThread::tryRebuildDevice() {
  for (const auto& run : runs_) run->release();
  batches_.clear();
  if (!device_.reopen()) return false;
  budget_.setSpeed(device_.speed());
  metrics_.deviceRebuilds.add();
  for (const auto& run : runs_) {
    run->overload.restart();
    if (run->host) run->rebuilds.deviceLost();
  }
  spdlog::info("device: {} runs; its scenes are being loaded again", device_->info().name);
  wake();
  return true;
}

void DeviceThread::abandonLoading() {
  for (const auto& run : runs_) run->abandonLoading();
  device_.loader().wait();
}

void DeviceThread::saveLast() {
  // Ticks in slices get this time to end. Longer ones are dropped, and an earlier state stays saved.
  const Clock::time_point end = Clock::now() + std::chrono::seconds(1);
  // After a device loss, scenes whose newest state is already on the CPU are still saved.
  for (const auto& run : runs_) {
    if (!run->host || !run->host->isReady() || !run->scene->keeper) continue;
    scene::SceneHost& host = *run->host;
    try {
      while (run->begun && host.hasSlices() && Clock::now() < end) {
        host.submitSlice();
        host.waitForSlice();
      }
      if (run->begun && host.hasSlices()) continue;
      if (run->begun) {
        run->become(SceneState::running);
        host.finish();
      }
      host.saveLast();
    } catch (const std::exception& failure) {
      telemetry::log({run->scene->name()}, spdlog::level::warn,
                     "its last state is not saved, but an earlier one may be: {}", failure.what());
    }
  }
}

}  // namespace clothstream::hosting

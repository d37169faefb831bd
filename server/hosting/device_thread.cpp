// SPDX-License-Identifier: MIT
#include "server/hosting/device_thread.h"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"
#include "server/schedule/retry.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {
namespace {

// Interval at which a paused scene looks for subscribers that need a key frame.
constexpr std::chrono::milliseconds kPausedFramePeriod{50};

}  // namespace

DeviceThread::DeviceThread(const vulkan::DeviceOptions& device,
                           const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
                           delivery::FramePublisher& publisher, telemetry::ServerMetrics& metrics,
                           scene::Budget& budget, bool runAlways, double reportRate, bool adaptsToLoad)
    : options_(device),
      publisher_(publisher),
      metrics_(metrics),
      budget_(budget),
      runAlways_(runAlways),
      reportRate_(reportRate),
      adaptsToLoad_(adaptsToLoad),
      loader_(publisher.workers(), [this] { wake(); }) {
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
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void DeviceThread::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

void DeviceThread::simulateDeviceLoss() {
  {
    const std::lock_guard lock(mutex_);
    loseDevice_ = true;
  }
  changed_.notify_all();
}

void DeviceThread::simulateDeviceLossIn(std::string scene) {
  const std::lock_guard lock(mutex_);
  losesDeviceIn_ = std::move(scene);
}

void DeviceThread::simulateFailure() {
  {
    const std::lock_guard lock(mutex_);
    fail_ = true;
  }
  changed_.notify_all();
}

void DeviceThread::checkSimulatedLoss(const Run& run) const {
  const std::lock_guard lock(mutex_);
  if (!losesDeviceIn_.empty() && losesDeviceIn_ == run.scene->name())
    throw vulkan::DeviceLost("the loss of the device in a scene is simulated");
}

vulkan::DeviceInfo DeviceThread::info() const {
  const std::lock_guard lock(mutex_);
  return info_;
}

std::future<void> DeviceThread::post(std::packaged_task<void()> task) {
  std::future<void> done = task.get_future();
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  wake();
  return done;
}

std::future<void> DeviceThread::add(std::shared_ptr<scene::LiveScene> scene) {
  // Shared, because the destructor of a promise that a future waits for allocates memory, and post() may have
  // found none.
  const auto added = std::make_shared<std::promise<void>>();
  std::future<void> whenAdded = added->get_future();
  post(std::packaged_task<void()>([this, scene = std::move(scene), added]() mutable {
    try {
      if (!device_) throw std::runtime_error("there is no device");
      runs_.push_back(std::make_unique<Run>(std::move(scene)));
      runs_.back()->whenAdded = std::move(*added);
    } catch (...) {
      added->set_exception(std::current_exception());
    }
  }));
  return whenAdded;
}

std::future<void> DeviceThread::prepare(std::shared_ptr<scene::LiveScene> scene) {
  const auto prepared = std::make_shared<std::promise<void>>();
  std::future<void> whenPrepared = prepared->get_future();
  post(std::packaged_task<void()>([this, scene = std::move(scene), prepared]() mutable {
    try {
      if (!device_) throw std::runtime_error("there is no device");
      runs_.push_back(std::make_unique<Run>(std::move(scene)));
      runs_.back()->waits = true;
      runs_.back()->whenAdded = std::move(*prepared);
    } catch (...) {
      prepared->set_exception(std::current_exception());
    }
  }));
  return whenPrepared;
}

std::future<void> DeviceThread::start(std::shared_ptr<scene::LiveScene> scene) {
  const auto started = std::make_shared<std::promise<void>>();
  std::future<void> whenStarted = started->get_future();
  post(std::packaged_task<void()>([this, scene = std::move(scene), started] {
    Run* const run = runOf(*scene);
    if (run == nullptr || !run->waits)
      return started->set_exception(
          std::make_exception_ptr(std::runtime_error("the scene is not prepared any more")));
    run->waits = false;
    run->whenAdded = std::move(*started);
  }));
  return whenStarted;
}

std::future<std::optional<scene::Checkpoint>> DeviceThread::hold(std::shared_ptr<scene::LiveScene> scene) {
  return read(std::move(scene), true);
}

std::future<std::optional<scene::Checkpoint>> DeviceThread::read(std::shared_ptr<scene::LiveScene> scene) {
  return read(std::move(scene), false);
}

std::future<std::optional<scene::Checkpoint>> DeviceThread::read(std::shared_ptr<scene::LiveScene> scene,
                                                                 bool holds) {
  const auto state = std::make_shared<std::promise<std::optional<scene::Checkpoint>>>();
  std::future<std::optional<scene::Checkpoint>> whenRead = state->get_future();
  post(std::packaged_task<void()>([this, scene = std::move(scene), holds, state] {
    Run* const run = runOf(*scene);
    if (run == nullptr || run->waits || run->whenRead || run->held)
      return state->set_exception(std::make_exception_ptr(std::runtime_error("it does not run here now")));
    run->holds = holds;
    // A tick that has begun took its inputs before.
    run->readAt = holds && run->host ? run->host->tick() + (run->begun ? 2 : 1) : 0;
    run->whenRead = std::move(*state);
  }));
  return whenRead;
}

void DeviceThread::unhold(std::shared_ptr<scene::LiveScene> scene) {
  post(std::packaged_task<void()>([this, scene = std::move(scene)] {
    if (Run* const run = runOf(*scene)) run->held = false;
  }));
}

DeviceThread::Run* DeviceThread::runOf(const scene::LiveScene& scene) const {
  for (const auto& run : runs_)
    if (run->scene.get() == &scene) return run.get();
  return nullptr;
}

void DeviceThread::readStates() {
  for (const auto& run : runs_) {
    const bool isDue = run->whenRead && !run->begun && !run->loading.valid() &&
                       (!run->host || !run->running || run->host->tick() >= run->readAt);
    if (!isDue) continue;
    std::promise<std::optional<scene::Checkpoint>> state = std::move(*run->whenRead);
    run->whenRead.reset();
    try {
      if (run->quarantined || (run->host && !run->host->isReady()))
        throw std::runtime_error("it does not run now; try again later");
      std::optional<scene::Checkpoint> read;
      if (run->host)
        read = run->host->stateNow();
      else if (const auto restored = run->scene->restored())
        read = restored->checkpoint;
      if (run->holds) {
        run->held = true;
        run->running = run->paused = false;
        run->scene->running = false;
      }
      state.set_value(std::move(read));
    } catch (const vulkan::DeviceLost&) {
      state.set_exception(std::make_exception_ptr(std::runtime_error("the device was lost")));
      countLoss(*run);
      throw;
    } catch (...) {
      state.set_exception(std::current_exception());
    }
  }
}

void DeviceThread::adopt(std::shared_ptr<scene::LiveScene> scene) {
  post(std::packaged_task<void()>([this, scene = std::move(scene)] {
    schedule::retryUntilDone(
        [&] { runs_.push_back(std::make_unique<Run>(scene)); },
        [](const std::exception& failure) { spdlog::error("{}; trying again", failure.what()); });
  }));
}

std::future<void> DeviceThread::remove(std::shared_ptr<scene::LiveScene> scene) {
  return post(std::packaged_task<void()>([this, scene = std::move(scene)] {
    // Waiting frames refer to the scene.
    publisher_.drain();
    std::erase_if(runs_, [&](const auto& run) { return run->scene == scene; });
  }));
}

void DeviceThread::runTasks() {
  std::vector<std::packaged_task<void()>> tasks;
  {
    const std::lock_guard lock(mutex_);
    tasks.swap(tasks_);
  }
  for (std::packaged_task<void()>& task : tasks) task();
}

void DeviceThread::run(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
                       std::promise<void>& ready) {
  try {
    if (!scenes.empty()) {
      device_ = std::make_unique<vulkan::Device>(options_);
      measureSpeed();
      for (const auto& scene : scenes) runs_.push_back(std::make_unique<Run>(scene));
      scene::LiveScene& first = *runs_.front()->scene;
      runs_.front()->host =
          std::make_unique<scene::SceneHost>(*device_, first, publisher_, reportRate_, &loader_);
      continueOverload(*runs_.front());
      runs_.front()->host->setWork(runs_.front()->overload.level());
      info_ = device_->info();
    }
  } catch (...) {
    runs_.clear();
    meter_.reset();
    device_.reset();
    ready.set_exception(std::current_exception());
    return;
  }
  ready.set_value();

  for (;;) {
    try {
      if (!waitForWork()) break;
      runTasks();
      takeLoadedScenes();
      startAndStopScenes();
      encodePausedFrames();
      runDueTicks();
      runSlice();
      readStates();
    } catch (const vulkan::DeviceLost& failure) {
      // A lack of memory may end the attempt.
      schedule::retryUntilDone(
          [&] { rebuildDevice(failure.what()); },
          [](const std::exception& again) { spdlog::error("device: {}; trying again", again.what()); });
    } catch (const std::exception& failure) {
      endure(failure);
    }
  }
  abandonLoading();
  saveLast();
  publisher_.drain();
  runs_.clear();
  meter_.reset();
  device_.reset();
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
      if (std::exchange(run->begun, false)) host.finish();
      host.saveLast();
    } catch (const std::exception& failure) {
      telemetry::log({run->scene->name()}, spdlog::level::warn,
                     "its last state is not saved, but an earlier one may be: {}", failure.what());
    }
  }
}

void DeviceThread::endure(const std::exception& failure) {
  try {
    spdlog::error("device thread: {}; trying again", failure.what());
  } catch (const std::exception&) {  // memory may be missing for the text
  }
  std::this_thread::sleep_for(schedule::kRetryPause);
}

bool DeviceThread::waitForWork() {
  deviceMemory_ = device_ ? device_->allocatedBytes() : 0;
  lastAnswer_ = Clock::now();
  Clock::time_point due = Clock::time_point::max();
  const Clock::time_point guestsFrom = scheduler_.guestsFrom(schedules(), lastAnswer_);
  for (const auto& run : runs_)
    due = std::min(due, run->guest && run->running ? std::max(run->due(), guestsFrom) : run->due());
  const auto something = [&] { return stopping_ || woken_ || loseDevice_ || fail_; };

  std::unique_lock lock(mutex_);
  if (due != Clock::time_point::max())
    changed_.wait_until(lock, due, something);
  else
    changed_.wait(lock, something);
  idle_ += Clock::now() - lastAnswer_.load();
  woken_ = false;
  return !stopping_;
}

void DeviceThread::abandonLoading() {
  for (const auto& run : runs_) {
    run->stopLoading.request_stop();
    run->loading = {};
    run->prepared.reset();
    if (run->host) run->host->endRehearsal();
  }
  loader_.wait();
}

void DeviceThread::takeLoadedScenes() {
  for (const auto& run : runs_) {
    const bool isLoaded =
        run->loading.valid() && run->loading.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    if (isLoaded || (run->prepared && !run->waits)) take(*run);
  }
  std::erase_if(runs_, [](const auto& run) { return run->refused; });
}

void DeviceThread::take(Run& run) {
  try {
    checkSimulatedLoss(run);
    if (!run.prepared) run.prepared = run.loading.get();
    if (!run.waits) begin(run, std::move(run.prepared));
    if (run.whenAdded) run.whenAdded->set_value();
    run.whenAdded.reset();
  } catch (const vulkan::DeviceLost&) {
    countLoss(run);
    throw;
  } catch (const std::exception& failure) {
    run.refused = run.whenAdded.has_value();
    if (run.refused)
      run.whenAdded->set_exception(std::current_exception());
    else if (run.host && !std::exchange(run.rebuildFailed, true))
      telemetry::log({run.scene->name()}, spdlog::level::err, "cannot be rebuilt: {}; trying again",
                     failure.what());
    else
      dismiss(run, failure.what());
  }
}

void DeviceThread::begin(Run& run, std::unique_ptr<scene::SceneOnDevice> loaded) {
  if (run.host) {
    run.host->rebuild(std::move(loaded), run.rebuiltAfter);
  } else {
    run.host =
        std::make_unique<scene::SceneHost>(std::move(loaded), *run.scene, publisher_, reportRate_, &loader_);
    continueOverload(run);
  }
  run.host->setWork(run.overload.level());
}

void DeviceThread::continueOverload(Run& run) {
  if (adaptsToLoad_ && run.host->tick() > 0) run.overload.beginAt(run.host->work());
}

void DeviceThread::dismiss(Run& run, const std::string& why) {
  const std::string text = fmt::format("the device cannot run the scene '{}': {}", run.scene->name(), why);
  spdlog::error("{}", text);
  run.host.reset();
  run.begun = false;
  run.failed.reset();
  scene::LiveScene& scene = *run.scene;
  scene.roster.dismiss(delivery::error(v1::ERROR_CODE_RESOURCE_EXHAUSTED, text, true));
  // For participants that have joined again already.
  scene.subscribers.announce(delivery::parametersChanged(scene.restart(), 1));
}

void DeviceThread::measureSpeed() {
  meter_ = std::make_unique<simulation::SpeedMeter>(*device_);
  speed_ = meter_->measure();
  budget_.setSpeed(speed_);
}

void DeviceThread::adaptToLoad(Run& run, Clock::time_point now) {
  if (!adaptsToLoad_) return;
  const double own = run.host->ownSeconds().value_or(schedule::seconds(run.used));
  const std::uint32_t leastSubsteps = run.host->leastSubsteps();
  const bool changed = run.overload.note(
      {.now = now,
       .slippedTicks = run.slippedBefore,
       .own = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(own)),
       .share = schedule::shareOf(run, schedules()),
       .idle = idle_,
       .disturbed = isDisturbed() || isMaking()},
      leastSubsteps);
  if (changed) run.host->setWork(run.overload.level());
}

bool DeviceThread::isDisturbed() const {
  return std::ranges::any_of(runs_, [](const auto& run) { return run->loads(); });
}

bool DeviceThread::isMaking() const {
  return std::ranges::any_of(
      runs_, [](const auto& run) { return run->host && run->host->makingTime() > Clock::duration::zero(); });
}

void DeviceThread::checkPrice(Run& run, bool isLate) {
  if (!isLate) return;
  const model::DeviceSpeed now = meter_->measure();
  const double slowdown =
      std::max(now.nodeStepSeconds / speed_.nodeStepSeconds, now.dispatchSeconds / speed_.dispatchSeconds);
  if (run.price.isExcessive(slowdown))
    stop(run, fmt::format("its ticks take far longer than their price of {:.3f} s; the newest one has "
                          "taken {:.3f} s{}",
                          run.tickPrice, schedule::seconds(run.used), run.begun ? " so far" : ""));
}

void DeviceThread::stop(Run& run, const std::string& why) {
  if (run.scene->created) return quarantine(run, why);
  const Clock::time_point now = Clock::now();
  const Clock::duration pause = run.comeback.fail(now);
  publisher_.drain();
  run.price = {};
  if (pause == Clock::duration::zero())
    return dismiss(
        run, fmt::format("it harms other scenes: {}; join again to start it with its own parameters", why));
  metrics_.quarantines.add();
  run.scene->refuseUntil(
      now + pause,
      fmt::format("the scene '{}' is stopped because it harms other scenes: {}", run.scene->name(), why));
  dismiss(run, fmt::format("it harms other scenes: {}; join again in {} s", why,
                           std::chrono::ceil<std::chrono::seconds>(pause).count()));
}

void DeviceThread::quarantine(Run& run, const std::string& why) {
  if (!run.scene->created && !std::exchange(run.hasLostDevice, true)) {
    publisher_.drain();
    run.price = {};
    return dismiss(
        run, fmt::format("it harms other scenes: {}; join again to start it with its own parameters", why));
  }
  const std::string text =
      fmt::format("the scene '{}' is stopped because it harms other scenes: {}", run.scene->name(), why);
  spdlog::error("{}", text);
  metrics_.quarantines.add();
  publisher_.drain();
  run.host.reset();
  run.begun = false;
  run.running = run.paused = false;
  run.scene->running = false;
  run.quarantined = true;
  run.scene->quarantine(text);
}

DeviceThread::Run* DeviceThread::sceneToLoad() const {
  const auto urgency = [this](const Run& run) {
    return std::pair(&run == runs_.front().get(), run.scene->subscribers.receivers(Clock::now()));
  };
  Run* next = nullptr;
  for (const auto& run : runs_) {
    if (run->loading.valid()) return run.get();
    if (run->needsDevice() && (next == nullptr || urgency(*run) > urgency(*next))) next = run.get();
  }
  return next;
}

void DeviceThread::startAndStopScenes() {
  const Clock::time_point now = Clock::now();
  Run* const loads = sceneToLoad();
  // While a scene is loaded, neither of the two may run: all others if it must be alone, and those that must.
  const auto waits = [&](const Run& run) {
    return loads != nullptr && (loads->aloneUntil > now || run.aloneUntil > now);
  };
  for (const auto& run : runs_) {
    run->guest = run->scene->isGuest();
    if (run->begun || run->quarantined || run->held) continue;
    const scene::LiveScene& scene = *run->scene;
    const bool inUse = scene.subscribers.receivers(now) > 0;
    const bool ready = run->host && run->host->isReady();
    const bool stopped = scene.paused && !scene.resetRequested && !(ready && run->host->owesFrame());
    const bool wanted = ready && !stopped && (runAlways_ || inUse);
    if (wanted && !run->running) {
      run->pacer.start(now);
      run->slow.restart();
      run->overload.restart();
    }
    const bool paused = ready && inUse && !wanted;
    if (ready && !wanted && (run->running || (run->paused && !paused))) {
      run->host->releaseCoarseEncoders();
      run->host->endRehearsal();
    }
    run->running = wanted && !waits(*run);
    run->paused = paused && !waits(*run);
    run->scene->running = wanted;
  }
  const bool busy = std::ranges::any_of(runs_, [&](const auto& run) { return run->begun && waits(*run); });
  if (loads != nullptr && !loads->loading.valid() && !busy)
    loads->loading =
        loader_.load(*device_, loads->scene->start(), (loads->stopLoading = std::stop_source()).get_token());
}

void DeviceThread::encodePausedFrames() {
  const Clock::time_point now = Clock::now();
  for (const auto& run : runs_) {
    if (!run->paused || now < run->nextPausedFrame) continue;
    run->nextPausedFrame = now + kPausedFramePeriod;
    survives(*run, [&] { run->host->encodePausedFrame(now); });
  }
}

std::span<schedule::TickSchedule* const> DeviceThread::schedules() {
  schedules_.clear();
  for (const auto& run : runs_) schedules_.push_back(run.get());
  return schedules_;
}

void DeviceThread::runDueTicks() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(loseDevice_, false)) throw vulkan::DeviceLost("the loss of the device is simulated");
    if (std::exchange(fail_, false)) throw std::runtime_error("a failure is simulated");
  }
  Clock::time_point before = Clock::now();
  // Slices that an exception kept from being waited for.
  for (const auto& run : runs_) waitForFirstSlice(*run, before);
  scheduler_.choose(schedules(), before, chosen_);
  const bool oneByOne = std::ranges::any_of(runs_, [&](const auto& run) { return run->aloneUntil > before; });
  for (schedule::TickSchedule* due : chosen_) {
    Run& run = static_cast<Run&>(*due);
    run.used = {};
    run.begun = run.inFlight = survives(run, [&] { begin(run, Clock::now()); });
    if (run.begun) chargeMaking(run, before);
    if (oneByOne) waitForFirstSlice(run, before);
  }
  for (schedule::TickSchedule* due : chosen_) waitForFirstSlice(static_cast<Run&>(*due), before);
}

// The scenes whose slices this thread waits for afterwards are not charged for it.
void DeviceThread::chargeMaking(Run& run, Clock::time_point& deviceFree) {
  const Clock::duration making = run.host->makingTime();
  run.used += making;
  scheduler_.used(run, making);
  deviceFree = std::min(deviceFree + making, Clock::now());
}

void DeviceThread::waitForFirstSlice(Run& run, Clock::time_point& deviceFree) {
  if (!run.inFlight) return;
  const bool survived = survives(run, [&] {
    run.host->waitForSlice(deviceFree);
    checkSimulatedLoss(run);
  });
  run.inFlight = false;
  if (survived) endSlice(run, std::exchange(deviceFree, Clock::now()));
}

void DeviceThread::runSlice() {
  const Clock::time_point before = Clock::now();
  const bool guestsRun = scheduler_.guestsFrom(schedules(), before) <= before;
  // The scene whose previous slice ended first.
  Run* next = nullptr;
  for (const auto& run : runs_)
    if (run->begun && (guestsRun || !run->guest) && (next == nullptr || run->served < next->served))
      next = run.get();
  if (next == nullptr) return;
  const bool survived = survives(*next, [&] {
    next->host->submitSlice();
    next->host->waitForSlice();
  });
  if (survived) endSlice(*next, before);
}

void DeviceThread::endSlice(Run& run, Clock::time_point before) {
  run.served = Clock::now();
  const Clock::duration time = run.served - before;
  run.used += time;
  scheduler_.used(run, time);
  // While a scene is loaded, its kernels lengthen slices. The end of the tick shows what the device did.
  const bool isLate = run.price.addSlice(schedule::seconds(time)) && !isDisturbed();
  if (run.host->hasSlices()) return checkPrice(run, isLate);
  if (!survives(run, [&] { run.host->finish(); })) return;
  run.begun = false;
  const Clock::time_point ended = Clock::now();
  run.tickEnded(run.used, ended);
  adaptToLoad(run, ended);
  checkPrice(run, run.price.end(run.host->deviceSeconds()));
}

bool DeviceThread::survives(Run& run, const std::function<void()>& partOfTick) {
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

void DeviceThread::countLoss(const Run& noticed) {
  const Clock::time_point now = Clock::now();
  std::vector<Run*> suspects;
  for (const auto& run : runs_)
    if (run.get() == &noticed || run->inFlight || run->loads()) suspects.push_back(run.get());
  for (Run* suspect : suspects) {
    const bool again = suspect->lostDevice && now - *suspect->lostDevice < kLossWindow;
    if (again && suspects.size() == 1) suspect->lostDeviceTwice = true;
    if (again && suspects.size() > 1) suspect->aloneUntil = now + kLossWindow;
    suspect->lostDevice = now;
    if (!suspect->whenAdded) continue;
    suspect->whenAdded->set_exception(
        std::make_exception_ptr(std::runtime_error("the device was lost while the scene was being loaded")));
    suspect->whenAdded.reset();
    suspect->refused = true;
  }
}

void DeviceThread::rebuildScene(Run& run, const std::string& reason) {
  publisher_.drain();
  device_->drain();
  const std::uint64_t ticks = run.host->tick();
  // The scene is off the device before anything here can fail.
  run.host->release();
  run.begun = run.inFlight = false;
  run.rebuiltAfter = "a tick failed";
  run.rebuildFailed = false;
  const std::optional<std::uint64_t> before = std::exchange(run.failed, ticks);
  wake();
  telemetry::log({run.scene->name()}, spdlog::level::err, "a tick failed: {}", reason);
  if (before && ticks - *before < run.scene->start().simulationRate) dismiss(run, reason);
}

void DeviceThread::begin(Run& run, Clock::time_point now) {
  const schedule::Pacer::Start start = run.pacer.begin(now, run.catchUp);
  scene::LiveScene& scene = *run.scene;
  scene.metrics.lateness.record(schedule::seconds(start.lateness));
  if (start.late) scene.metrics.lateTicks.add();
  scene.metrics.slippedTicks.add(run.wholeSlippedTicks(start.slippedTicks));
  run.slippedBefore = start.slippedTicks;
  if (const std::optional<double> speed = run.slow.note(now, start.slippedTicks)) {
    const std::string text = fmt::format(
        "simulated time runs at {:.0f} % of real time: the device cannot keep {} ticks/s with {} substeps",
        *speed * 100, scene.start().simulationRate, scene.work.load().substeps);
    telemetry::log({scene.name()}, spdlog::level::warn, "{}", text);
    scene.subscribers.announce(delivery::notice(v1::NOTICE_KIND_RUNNING_SLOW, text, run.host->tick()));
  }
  run.host->begin(now);
  run.tickPrice = scene.tickWork(run.host->colliders()).seconds(budget_.speed());
  run.price.begin(run.tickPrice);
}

void DeviceThread::rebuildDevice(const std::string& reason) {
  spdlog::error("device: {}; rebuilding it and every scene", reason);
  // Frames of the old device are published first, because they use its memory.
  publisher_.drain();
  abandonLoading();
  try {
    if (device_) device_->drain();  // it may still work, if the failure was a lack of memory on the CPU
  } catch (const vulkan::DeviceLost&) {
  }
  for (const auto& run : runs_) {
    run->begun = run->inFlight = false;
    if (std::exchange(run->lostDeviceTwice, false))
      quarantine(*run, "the device was lost twice while it ran");
  }
  do {
    runTasks();
    std::unique_lock lock(mutex_);
    if (changed_.wait_until(lock, nextRebuild_, [&] { return stopping_; })) return;
    nextRebuild_ = Clock::now() + std::chrono::seconds(1);
  } while (!tryRebuildDevice());
}

bool DeviceThread::tryRebuildDevice() {
  for (const auto& run : runs_)
    if (run->host) run->host->release();
  meter_.reset();
  device_.reset();
  try {
    device_ = std::make_unique<vulkan::Device>(options_);
    measureSpeed();
  } catch (const std::exception& failure) {
    spdlog::error("device: {}; trying again", failure.what());
    return false;
  }
  metrics_.deviceRebuilds.add();
  reloadScenes();
  spdlog::info("device: {} runs; its scenes are being loaded again", device_->info().name);
  wake();
  const std::lock_guard lock(mutex_);
  info_ = device_->info();
  return true;
}

void DeviceThread::reloadScenes() {
  for (const auto& run : runs_) {
    run->overload.restart();
    if (!run->host) continue;
    run->rebuiltAfter = "the device was lost";
    run->rebuildFailed = false;
  }
}

}  // namespace clothstream::hosting

// SPDX-License-Identifier: MIT
#include "server/scene/budget.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace clothstream::scene {
namespace {

constexpr double kMegabyte = 1e6;
// Least room for the hands of a scene, as a sum of weights: about four pairs of hands at a cloth of one
// metre.
constexpr double kLeastHands = 16;
// Participants must not make a scene late: with their other colliders and with parameters that one of them
// changes, its price is at most kInTime, in seconds of the device's time a second. There is always room for
// kLeastOthers: a collider that is near all cloth, and a small one.
constexpr double kInTime = 0.7, kLeastOthers = 4;
// A scene that the server started with may cost this much of its first price instead, if that is more.
constexpr double kMostOfStart = 1.25;

// Largest number from 1 to `most` that fits, or 0. A larger number never fits if a smaller one does not.
std::uint32_t largest(std::uint32_t most, const std::function<bool(std::uint32_t)>& fits) {
  std::uint32_t low = 0, high = most;
  while (low < high) {
    const std::uint32_t middle = high - (high - low) / 2;
    if (fits(middle))
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

// The mildest reduction with which the load fits: iterations, then substeps, then nodes. Of a scene that is
// made already, only the iterations can change.
std::string whatFits(const model::Scene& scene, bool made, double load, double room,
                     const std::function<double(const model::Scene&)>& loadOf) {
  model::Scene smaller = scene;
  std::uint32_t iterations = 1;
  for (const model::Cloth& cloth : scene.cloths)
    if (cloth.solver.kind != model::SolverKind::massSpring)
      iterations = std::max(iterations, cloth.solver.iterations);
  const auto withIterations = [&](std::uint32_t most) {
    for (std::size_t i = 0; i < scene.cloths.size(); ++i)
      smaller.cloths[i].solver.iterations = std::min(scene.cloths[i].solver.iterations, most);
    return loadOf(smaller) <= room;
  };
  if (const std::uint32_t fit = largest(iterations - 1, withIterations); fit > 0)
    return fmt::format("at most {} iterations would fit", fit);
  if (made) return "nothing more would fit";
  smaller = scene;
  const auto withSubsteps = [&](std::uint32_t most) {
    smaller.substeps = most;
    return loadOf(smaller) <= room;
  };
  if (const std::uint32_t fit = largest(scene.substeps - 1, withSubsteps); fit > 0)
    return fmt::format("at most {} substeps would fit", fit);
  const auto nodes = static_cast<std::uint64_t>(scene.nodeCount() * room / load);
  return nodes > 0 ? fmt::format("about {} nodes would fit", nodes) : std::string("nothing would fit");
}

}  // namespace

void Budget::setSpeed(const model::DeviceSpeed& speed) {
  const std::lock_guard lock(mutex_);
  speed_ = speed;
}

model::DeviceSpeed Budget::speed() const {
  const std::lock_guard lock(mutex_);
  return speed_;
}

Charge::Charge(std::shared_ptr<Budget> budget, const model::Scene& scene, bool free)
    : budget_(std::move(budget)), model_(scene), made_(free) {
  if (!free) return;
  freeWork_ = model_.work(scene);
  freeMegabytes_ = model_.bytes(scene) / kMegabyte;
}

Budget::Usage Budget::usage() const {
  const std::lock_guard lock(mutex_);
  return {.load = load_,
          .freeLoad = std::max(0.0, limits_.load - load_),
          .megabytes = megabytes_,
          .freeMegabytes = std::max(0.0, limits_.megabytes - megabytes_)};
}

Charge::~Charge() {
  release();
}

double Charge::load(const model::Scene& scene) const {
  const double colliders = static_cast<double>(scene.colliders.size()) + colliders_.hands + colliders_.others;
  return workWith(scene, colliders).seconds(budget_->speed()) * scene.simulationRate;
}

void Charge::release() {
  const std::lock_guard lock(budget_->mutex_);
  replace({});
  released_ = true;
}

Charge::Amount Charge::priceOf(const model::Scene& scene) const {
  return {.load = std::max(0.0, loadWith(scene, colliders_.others)),
          .megabytes =
              std::max(0.0, (model_.bytes(scene) + model_.surfaceBytes(surfaces_.triangles)) / kMegabyte -
                                freeMegabytes_)};
}

double Charge::secondsOf(const model::Scene& scene, double colliders) const {
  const double all = static_cast<double>(scene.colliders.size()) + colliders;
  return workWith(scene, all).seconds(budget_->speed_) * scene.simulationRate;
}

double Charge::loadWith(const model::Scene& scene, double colliders) const {
  return secondsOf(scene, colliders) - startSeconds(scene);
}

double Charge::startSeconds(const model::Scene& scene) const {
  return freeWork_.seconds(budget_->speed_) * scene.simulationRate;
}

model::Work Charge::workWith(const model::Scene& scene, double colliders) const {
  model::Work work = model_.work(scene, colliders);
  if (movesJoints_) work += model_.movedJointsWork(scene);
  work += model_.heldWindWork(scene, heldWinds_);
  work += model_.surfacesWork(scene, surfaces_.searches);
  return work;
}

messages::Result<void> Charge::chargeJoints(const std::string& path, const model::Scene& scene) {
  if (movesJoints_) return {};
  movesJoints_ = true;
  messages::Result<void> charged = charge(path, scene);
  if (!charged) movesJoints_ = false;
  return charged;
}

messages::Result<void> Charge::chargeWinds(const std::string& path, const model::Scene& scene,
                                           std::size_t count) {
  const std::size_t before = std::exchange(heldWinds_, count);
  if (released_) return {};
  if (count <= before) {  // also on a device that is slower now
    const std::lock_guard lock(budget_->mutex_);
    replace(priceOf(scene));
    return {};
  }
  messages::Result<void> charged = charge(path, scene);
  if (!charged) heldWinds_ = before;
  return charged;
}

messages::Result<void> Charge::chargeSurfaces(const std::string& path, const model::Scene& scene,
                                              const SurfaceLoad& surfaces) {
  const SurfaceLoad before = std::exchange(surfaces_, surfaces);
  if (released_) return {};
  if (surfaces.searches <= before.searches && surfaces.triangles <= before.triangles) {
    const std::lock_guard lock(budget_->mutex_);
    replace(priceOf(scene));
    return {};
  }
  messages::Result<void> charged = charge(path, scene);
  if (!charged) surfaces_ = before;
  return charged;
}

double Charge::mostLoad(const model::Scene& scene) const {
  const BudgetLimits& limits = budget_->limits_;
  if (limits.tickSeconds <= 0) return limits.sceneLoad;
  return std::min(limits.sceneLoad, limits.tickSeconds * scene.simulationRate);
}

double Charge::roomForHands(const model::Scene& scene) const {
  const std::lock_guard lock(budget_->mutex_);
  // A load grows evenly with the colliders.
  const double none = loadWith(scene, 0), each = loadWith(scene, 1) - none;
  if (each <= 0) return std::numeric_limits<double>::infinity();
  return std::max(kLeastHands, (mostLoad(scene) - none) / each);
}

double Charge::roomForOthers(const model::Scene& scene, double hands) const {
  const std::lock_guard lock(budget_->mutex_);
  const double none = loadWith(scene, 0), each = loadWith(scene, 1) - none;
  if (each <= 0) return std::numeric_limits<double>::infinity();
  const double free = budget_->limits_.load - (budget_->load_ - charged_.load) - std::max(0.0, none);
  const double inTime = (kInTime - secondsOf(scene, 0)) / each;
  return std::max(0.0, std::min({(mostLoad(scene) - none) / each - hands, free / 2 / each,
                                 std::max(kLeastOthers, inTime - hands)}));
}

void Charge::chargeColliders(const model::Scene& scene, const ColliderLoad& colliders) {
  const std::lock_guard lock(budget_->mutex_);
  colliders_ = colliders;
  if (!released_) replace(priceOf(scene));
}

bool Charge::exceedsStart(const model::Scene& scene) const {
  const std::lock_guard lock(budget_->mutex_);
  return loadWith(scene, 0) > 0 || model_.bytes(scene) / kMegabyte > freeMegabytes_;
}

void Charge::replace(const Amount& next) {
  budget_->load_ += next.load - charged_.load;
  budget_->megabytes_ += next.megabytes - charged_.megabytes;
  charged_ = next;
  released_ = false;
}

Charge::Room Charge::roomFor(const model::Scene& scene) const {
  const BudgetLimits& limits = budget_->limits_;
  const double free = std::max(0.0, limits.load - (budget_->load_ - charged_.load));
  const double room = std::min(limits.sceneLoad, free);
  const double tick = limits.tickSeconds * scene.simulationRate;
  if (limits.tickSeconds > 0 && tick < room) return {tick, true, free};
  return {room, false, free};
}

std::string Charge::excessOf(const model::Scene& scene, double load, const Room& room) const {
  const BudgetLimits& limits = budget_->limits_;
  if (room.tick)
    return fmt::format(
        "would take {:.2f} s of the device's time a tick, by estimate; one tick may take {:.2f} s "
        "(--max-tick-time)",
        load / scene.simulationRate, limits.tickSeconds);
  return fmt::format(
      "would take {:.2f} s of the device's time a second, by estimate; one scene may take {:.2f} s, "
      "and {:.2f} s of {:.2f} s are free (--max-load, --profile)",
      load, limits.sceneLoad, room.free, limits.load);
}

void Charge::restore(const model::Scene& scene) {
  const std::lock_guard lock(budget_->mutex_);
  replace(priceOf(scene));
}

messages::Result<void> Charge::charge(const std::string& path, const model::Scene& scene, Pace pace) {
  const std::lock_guard lock(budget_->mutex_);
  const BudgetLimits& limits = budget_->limits_;
  const Amount price = priceOf(scene);
  const auto refuse = [&](std::string text) {
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                                               path.empty() ? std::move(text) : path + ": " + std::move(text),
                                               telemetry::Refusal::budget});
  };
  const Room roomForLoad = roomFor(scene);
  if (price.load > charged_.load && price.load > roomForLoad.load) {
    const auto loadOf = [&](const model::Scene& other) { return priceOf(other).load; };
    return refuse(excessOf(scene, price.load, roomForLoad) + ": " +
                  whatFits(scene, made_, price.load, roomForLoad.load, loadOf));
  }
  const auto secondsWith = [&](const model::Scene& other) { return secondsOf(other, colliders_.others); };
  const double seconds = secondsWith(scene), start = startSeconds(scene);
  if (const double most = std::max(kInTime, kMostOfStart * start);
      pace == Pace::inTime && price.load > charged_.load && seconds > most)
    return refuse(
        fmt::format("would take {:.2f} s of the device's time a second, by estimate; only an owner of the "
                    "scene may let it take more than {:.2f} s, and so slow it down: {}",
                    seconds, most, whatFits(scene, made_, seconds, most, secondsWith)));
  const double free = std::max(0.0, limits.megabytes - (budget_->megabytes_ - charged_.megabytes));
  const double room = std::min(limits.sceneMegabytes, free);
  if (price.megabytes > charged_.megabytes && price.megabytes > room)
    return refuse(fmt::format(
        "would take {:.0f} MB of memory, by estimate; one scene may take {:.0f}, and {:.0f} of "
        "{:.0f} are free (--max-memory, --profile): {}",
        price.megabytes, limits.sceneMegabytes, free, limits.megabytes,
        made_ ? "nothing more would fit"
              : fmt::format("about {:.0f} nodes would fit", scene.nodeCount() * room / price.megabytes)));
  replace(price);
  made_ = true;
  return {};
}

}  // namespace clothstream::scene

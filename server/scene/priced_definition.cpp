// SPDX-License-Identifier: MIT
#include "server/scene/priced_definition.h"

#include <utility>

#include <fmt/format.h>

#include "server/messages/client_message.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"

namespace clothstream::scene {
namespace {

// Refuses a change that the limits of announcements never allow.
messages::Result<void> checkAnnouncement(const v1::ParameterChange& change, std::size_t bytes) {
  const auto cloths = static_cast<std::size_t>(change.cloths_size());
  constexpr auto kMost = static_cast<std::size_t>(ChangeLimits::kOfParticipantBurstBytes);
  if (bytes <= kMost && cloths <= messages::limits::kMaxCloths) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_INVALID_ARGUMENT,
      fmt::format(
          "parameterChange: its announcement would have {} bytes and {} elements in `cloths`; at most "
          "{} bytes and {} elements are allowed: change fewer cloths at once",
          bytes, cloths, kMost, messages::limits::kMaxCloths)});
}

}  // namespace

PricedDefinition::PricedDefinition(model::Scene start, std::shared_ptr<Budget> budget, bool free,
                                   std::optional<std::string> cloths)
    : definition_(std::move(start), std::move(cloths)),
      isFree_(free),
      charge_(budget ? std::move(budget) : std::make_shared<Budget>(), definition_.start(), free) {}

model::Scene PricedDefinition::accepted() const {
  const std::lock_guard lock(mutex_);
  return definition_.accepted();
}

std::uint64_t PricedDefinition::version() const {
  const std::lock_guard lock(mutex_);
  return definition_.version();
}

std::shared_ptr<const delivery::DescriptionChunks> PricedDefinition::description(
    const std::function<v1::StreamDescription(const model::Scene& accepted)>& message) {
  const std::lock_guard lock(mutex_);
  if (auto description = definition_.description()) return description;
  v1::StreamDescription made = message(definition_.accepted());
  made.clear_cloths();
  return definition_.describe(made.SerializeAsString());
}

void PricedDefinition::accept(model::Scene scene) {
  definition_.change(std::move(scene));
  charge_.restore(definition_.accepted());
  comparePrice();
}

messages::Result<void> PricedDefinition::change(std::uint64_t participant, const v1::ParameterChange& message,
                                                Charge::Pace pace, Inbox& inbox) {
  const std::lock_guard lock(mutex_);
  if (auto counted = countChangeLocked(participant, "parameterChange"); !counted) return counted;
  messages::Result<model::ParameterChange> change =
      messages::toParameterChange(message, definition_.accepted(), definition_.stability());
  if (!change) return tl::unexpected(std::move(change).error());
  model::Scene changed = definition_.accepted();
  model::applyChange(changed, *change);
  AcceptedChange accepted{participant, *change, messages::withMaterials(message, changed)};
  const std::size_t bytes = accepted.message.ByteSizeLong();
  if (const auto fits = checkAnnouncement(accepted.message, bytes); !fits) return fits;
  if (auto counted = tooMany(changes_.countBytes(participant, bytes, Clock::now()), "parameterChange",
                             "bytes of changes");
      !counted)
    return counted;
  if (const auto charged = charge_.charge("parameterChange", changed, pace); !charged)
    return tl::unexpected(charged.error());
  if (!inbox.postChange(std::move(accepted))) {
    charge_.restore(definition_.accepted());
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                             "parameterChange: too many changes for one tick; send it again later",
                             telemetry::Refusal::parameterChanges});
  }
  definition_.change(std::move(changed));
  comparePrice();
  return {};
}

messages::Result<void> PricedDefinition::countChange(std::uint64_t participant, const char* call) {
  const std::lock_guard lock(mutex_);
  return countChangeLocked(participant, call);
}

// Each change is sent to all participants.
messages::Result<void> PricedDefinition::countChangeLocked(std::uint64_t participant, const char* call) {
  return tooMany(changes_.count(participant, Clock::now()), call, "changes");
}

messages::Result<void> PricedDefinition::tooMany(ChangeLimits::Exceeded exceeded, const char* call,
                                                 const char* what) const {
  if (exceeded == ChangeLimits::Exceeded::nothing) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_RESOURCE_EXHAUSTED,
      fmt::format("{}: too many {} of '{}'{} in one second; send it again later", call, what, start().name,
                  exceeded == ChangeLimits::Exceeded::byParticipant ? " by one participant" : ""),
      telemetry::Refusal::parameterChanges});
}

void PricedDefinition::restart(Inbox& inbox) {
  {
    const std::lock_guard lock(mutex_);
    inbox.dropChanges();
    charge_.forgetJoints();
    accept(start());
  }
  const std::lock_guard lock(boundsMutex_);
  clothBounds_.reset();
}

void PricedDefinition::revertTo(const model::Scene& applied, Inbox& inbox) {
  const std::lock_guard lock(mutex_);
  model::Scene definition = applied;
  inbox.forEachChange([&](const model::ParameterChange& change) { model::applyChange(definition, change); });
  accept(std::move(definition));
}

void PricedDefinition::restore(std::optional<model::Scene> definition) {
  const std::lock_guard lock(mutex_);
  if (!definition) definition = definition_.accepted();
  // The correction fraction of an eased change of solver is the host's.
  for (model::Cloth& cloth : definition->cloths) cloth.solver.correctionFraction.reset();
  definition_.restore(std::move(*definition));
  if (isFree_) charge_.restore(definition_.accepted());
  comparePrice();
}

messages::Result<void> PricedDefinition::charge(const std::string& path) {
  const std::lock_guard lock(mutex_);
  return charge_.charge(path, definition_.accepted());
}

void PricedDefinition::release() {
  const std::lock_guard lock(mutex_);
  charge_.release();
}

model::Work PricedDefinition::tickWork(std::size_t colliders) const {
  const std::lock_guard lock(mutex_);
  return charge_.work(definition_.accepted(), colliders);
}

double PricedDefinition::price() const {
  const std::lock_guard lock(mutex_);
  return charge_.load(definition_.accepted());
}

void PricedDefinition::setClothBounds(const ClothBounds& bounds) {
  const std::lock_guard lock(boundsMutex_);
  clothBounds_ = bounds;
}

double PricedDefinition::roomForHands() const {
  const std::lock_guard lock(mutex_);
  return charge_.roomForHands(definition_.accepted());
}

double PricedDefinition::roomForOthers(double hands) const {
  const std::lock_guard lock(mutex_);
  return charge_.roomForOthers(definition_.accepted(), hands);
}

messages::Result<void> PricedDefinition::chargeJoints() {
  const std::lock_guard lock(mutex_);
  auto charged = charge_.chargeJoints("colliderPoses.joints", definition_.accepted());
  comparePrice();
  return charged;
}

messages::Result<void> PricedDefinition::chargeWinds(std::size_t count) {
  const std::lock_guard lock(mutex_);
  auto charged = charge_.chargeWinds("colliderPoses.winds", definition_.accepted(), count);
  comparePrice();
  return charged;
}

messages::Result<void> PricedDefinition::chargeSurfaces(const SurfaceLoad& load) {
  const std::lock_guard lock(mutex_);
  auto charged = charge_.chargeSurfaces("", definition_.accepted(), load);
  comparePrice();
  return charged;
}

void PricedDefinition::chargeColliders(const ColliderLoad& load) {
  const std::lock_guard lock(mutex_);
  charge_.chargeColliders(definition_.accepted(), load);
}

bool PricedDefinition::boundsOfCloth(ClothBounds& bounds) const {
  const std::lock_guard lock(boundsMutex_);
  if (clothBounds_) bounds = *clothBounds_;
  return clothBounds_.has_value();
}

}  // namespace clothstream::scene

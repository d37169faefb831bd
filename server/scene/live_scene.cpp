// SPDX-License-Identifier: MIT
#include "server/scene/live_scene.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"
#include "server/encode/frame_encoder.h"
#include "server/messages/client_message.h"
#include "server/messages/description.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"

namespace clothstream::scene {
namespace {

static_assert(messages::limits::kMaxQualities == codec::kMaxQualities);

v1::ParameterChange allParameters(const model::Scene& scene) {
  std::vector<double> areas;
  for (const model::Cloth& cloth : scene.cloths) areas.push_back(model::areaOf(cloth));
  return messages::allParameters(messages::toMessageWithoutMeshes(scene), areas);
}

model::Scene nameAndRates(std::string name, const v1::StreamDescription& description) {
  model::Scene scene;
  scene.name = std::move(name);
  scene.simulationRate = description.simulation_rate();
  scene.streamRate = description.stream_rate();
  return scene;
}

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

// Copies everything that subscribers are sent into the journal.
std::function<void(const delivery::SharedBytes&)> tapOf(const std::shared_ptr<Journal>& journal) {
  if (!journal) return {};
  return [journal](const delivery::SharedBytes& message) { journal->sent(message); };
}

// Drops colliders and grabs of participants that are not in the roster: they left after the checkpoint.
void dropAbsent(const SavedRoster& roster, Checkpoint& checkpoint) {
  const auto isAbsent = [&](std::uint64_t id) {
    return std::ranges::find(roster.participants, id, [](const SavedParticipant& known) {
             return known.participant.id;
           }) == roster.participants.end();
  };
  std::erase_if(checkpoint.colliders.colliders,
                [&](const ColliderSet::Placed& placed) { return isAbsent(placed.participant); });
  std::vector<GrabsAndAttachments::Slot>& slots = checkpoint.grabs.slots;
  for (GrabsAndAttachments::Slot& slot : slots)
    if (slot.phase != GrabsAndAttachments::Slot::Phase::empty && isAbsent(slot.participant)) slot = {};
  std::erase_if(checkpoint.state.held.nodes, [&](const simulation::HeldNode& node) {
    return slots[node.grab].phase == GrabsAndAttachments::Slot::Phase::empty;
  });
}

std::string clothsOf(const v1::StreamDescription& description) {
  v1::StreamDescription cloths;
  *cloths.mutable_cloths() = description.cloths();
  return cloths.SerializeAsString();
}

}  // namespace

LiveScene::LiveScene(model::Scene definition, bool wasCreated, std::shared_ptr<Journal> kept,
                     std::uint32_t most, std::shared_ptr<Budget> budget)
    : created(wasCreated),
      maxParticipants(most),
      journal(std::move(kept)),
      subscribers(tapOf(journal)),
      poses(subscribers, inbox, this, model::kMaxLocalWinds - definition.winds.size()),
      roster(subscribers, poses, journal.get()),
      work(schedule::WorkLevel{1, definition.substeps}),
      definition_(std::move(definition)),
      charge_(budget ? std::move(budget) : std::make_shared<Budget>(), start(), !created) {}

LiveScene::LiveScene(std::string name, std::shared_ptr<FrameSource> from, std::uint32_t most)
    : created(false),
      maxParticipants(most),
      source(std::move(from)),
      poses(subscribers, inbox),
      roster(subscribers, poses, nullptr),
      work(schedule::WorkLevel{}),
      definition_(nameAndRates(std::move(name), source->description()), clothsOf(source->description())),
      charge_(std::make_shared<Budget>(), start(), true) {}

LiveScene::~LiveScene() {
  if (source) source->end();
  // Participants of a kept scene may come back in the next run of the server.
  roster.endObservation(keeper == nullptr);
  observer_.reset();
}

void LiveScene::observe(std::unique_ptr<SceneObserver> observer) {
  observer_ = std::move(observer);
  roster.observe(*observer_);
}

model::Scene LiveScene::definition() const {
  const std::lock_guard lock(mutex_);
  return definition_.accepted();
}

void LiveScene::restore(SavedScene saved, const ReconnectGrace& grace, Clock::time_point now) {
  if (saved.checkpoint) dropAbsent(saved.roster, *saved.checkpoint);
  {
    const std::lock_guard lock(mutex_);
    model::Scene definition = saved.accepted     ? *saved.accepted
                              : saved.checkpoint ? saved.checkpoint->scene
                                                 : definition_.accepted();
    // The correction fraction of an eased change of solver is the host's.
    for (model::Cloth& cloth : definition.cloths) cloth.solver.correctionFraction.reset();
    definition_.restore(std::move(definition));
    if (saved.checkpoint) tick = saved.checkpoint->state.tick;
    if (!created) charge_.restore(definition_.accepted());
    if (saved.checkpoint || saved.accepted)
      restored_ =
          std::make_shared<const Restored>(Restored{std::move(saved.checkpoint), std::move(saved.accepted)});
    comparePrice();
  }
  paused = saved.paused;
  resetRequested = saved.resetRequested;
  roster.restore(saved.roster, grace, now);
}

std::shared_ptr<const LiveScene::Restored> LiveScene::restored() const {
  const std::lock_guard lock(mutex_);
  return restored_;
}

void LiveScene::forgetRestored() {
  const std::lock_guard lock(mutex_);
  restored_.reset();
}

std::uint64_t LiveScene::version() const {
  const std::lock_guard lock(mutex_);
  return definition_.version();
}

messages::Result<void> LiveScene::charge(const std::string& path) {
  const std::lock_guard lock(mutex_);
  return charge_.charge(path, definition_.accepted());
}

double LiveScene::roomForHands() const {
  const std::lock_guard lock(mutex_);
  return charge_.roomForHands(definition_.accepted());
}

double LiveScene::roomForOthers(double hands) const {
  const std::lock_guard lock(mutex_);
  return charge_.roomForOthers(definition_.accepted(), hands);
}

messages::Result<void> LiveScene::chargeJoints() {
  const std::lock_guard lock(mutex_);
  auto charged = charge_.chargeJoints("colliderPoses.joints", definition_.accepted());
  comparePrice();
  return charged;
}

messages::Result<void> LiveScene::chargeWinds(std::size_t count) {
  const std::lock_guard lock(mutex_);
  auto charged = charge_.chargeWinds("colliderPoses.winds", definition_.accepted(), count);
  comparePrice();
  return charged;
}

void LiveScene::chargeColliders(const ColliderLoad& load) {
  const std::lock_guard lock(mutex_);
  charge_.chargeColliders(definition_.accepted(), load);
}

void LiveScene::setClothBounds(const ClothBounds& bounds) {
  const std::lock_guard lock(boundsMutex_);
  clothBounds_ = bounds;
}

bool LiveScene::boundsOfCloth(ClothBounds& bounds) const {
  const std::lock_guard lock(boundsMutex_);
  if (clothBounds_) bounds = *clothBounds_;
  return clothBounds_.has_value();
}

void LiveScene::discharge() {
  const std::lock_guard lock(mutex_);
  charge_.release();
}

model::Work LiveScene::tickWork(std::size_t colliders) const {
  const std::lock_guard lock(mutex_);
  return charge_.work(definition_.accepted(), colliders);
}

double LiveScene::price() const {
  const std::lock_guard lock(mutex_);
  return charge_.load(definition_.accepted());
}

void LiveScene::quarantine(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    quarantine_.begin(why);
  }
  roster.close(delivery::error(v1::ERROR_CODE_RESOURCE_EXHAUSTED, why, true));
}

void LiveScene::refuseUntil(Clock::time_point until, const std::string& why) {
  const std::lock_guard lock(mutex_);
  quarantine_.begin(why, until);
}

std::string LiveScene::quarantined(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  return quarantine_.reason(now);
}

messages::Result<void> LiveScene::countChange(std::uint64_t participant, const char* call) {
  const std::lock_guard lock(mutex_);
  return countChangeLocked(participant, call);
}

messages::Result<void> LiveScene::tooMany(ChangeLimits::Exceeded exceeded, const char* call,
                                          const char* what) const {
  if (exceeded == ChangeLimits::Exceeded::nothing) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_RESOURCE_EXHAUSTED,
      fmt::format("{}: too many {} of '{}'{} in one second; send it again later", call, what, name(),
                  exceeded == ChangeLimits::Exceeded::byParticipant ? " by one participant" : ""),
      telemetry::Refusal::parameterChanges});
}

// Each change is sent to all participants.
messages::Result<void> LiveScene::countChangeLocked(std::uint64_t participant, const char* call) {
  return tooMany(changes_.count(participant, Clock::now()), call, "changes");
}

messages::Result<void> LiveScene::change(std::uint64_t participant, const v1::ParameterChange& message,
                                         Role role) {
  if (source)
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                             fmt::format("parameterChange: '{}' {}; its parameters cannot be changed", name(),
                                         source->whyFixed())});
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
  const auto pace = role == Role::owner ? Charge::Pace::any : Charge::Pace::inTime;
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

std::uint32_t LiveScene::codec() const {
  return source ? source->description().codec() : codec::kCodecHierarchical;
}

delivery::StreamShape LiveScene::shape() const {
  if (!source) return {.rate = start().streamRate, .qualities = start().stream.qualities};
  return {.rate = start().streamRate, .qualities = source->qualities(), .lockstep = source->inLockstep()};
}

v1::ParameterChange LiveScene::restart() {
  const std::lock_guard lock(mutex_);
  inbox.dropChanges();
  definition_.change(start());
  restored_.reset();
  charge_.forgetJoints();
  charge_.restore(start());
  comparePrice();
  {
    const std::lock_guard boundsLock(boundsMutex_);
    clothBounds_.reset();
  }
  tick = 0;
  ++restarts;
  resetRequested = false;
  return allParameters(start());
}

v1::ParameterChange LiveScene::revertTo(const model::Scene& applied) {
  const std::lock_guard lock(mutex_);
  model::Scene definition = applied;
  inbox.forEachChange([&](const model::ParameterChange& change) { model::applyChange(definition, change); });
  definition_.change(std::move(definition));
  charge_.restore(definition_.accepted());
  comparePrice();
  return allParameters(applied);
}

std::shared_ptr<const delivery::DescriptionChunks> LiveScene::description() {
  const std::lock_guard lock(mutex_);
  if (auto description = definition_.description()) return description;
  const double seconds = static_cast<double>(tick.load()) * definition_.accepted().tickSeconds();
  v1::StreamDescription message =
      source ? source->description()
             : messages::descriptionWithoutCloths(definition_.accepted(), kEpoch, codec(), seconds);
  message.set_scene(name());
  message.clear_cloths();
  return definition_.describe(message.SerializeAsString());
}

bool LiveScene::hasBeenEmptyFor(std::chrono::milliseconds time, Clock::time_point now) {
  if (roster.size() > 0) {
    emptySince_.reset();
    return false;
  }
  if (!emptySince_) emptySince_ = now;
  return now - *emptySince_ >= time;
}

delivery::SharedBytes workNotice(const LiveScene& scene, std::uint64_t tick) {
  const schedule::WorkLevel work = scene.work;
  const schedule::WorkLevel all = scene.allWork();
  if (work == all)
    return delivery::notice(v1::NOTICE_KIND_LOAD_CHANGED,
                            "the device is no longer overloaded: the scene has all frames and substeps again",
                            tick);
  return delivery::notice(
      v1::NOTICE_KIND_LOAD_CHANGED,
      fmt::format(
          "the device is overloaded: the scene sends {} of {} frames/s and computes {} of {} substeps",
          scene.start().streamRate / work.frameDivisor, scene.start().streamRate, work.substeps,
          all.substeps),
      tick);
}

delivery::SharedBytes pausedNotice(const LiveScene& scene, std::uint64_t participant) {
  const bool paused = scene.paused;
  return delivery::notice(paused ? v1::NOTICE_KIND_SCENE_PAUSED : v1::NOTICE_KIND_SCENE_RESUMED,
                          paused ? "the scene is paused" : "the scene is resumed", scene.tick.load(),
                          participant);
}

}  // namespace clothstream::scene

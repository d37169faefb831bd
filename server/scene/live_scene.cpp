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
#include "server/messages/description.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/scene/shared_surfaces.h"

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

// Copies everything that subscribers are sent into the journal.
std::function<void(const delivery::SharedBytes&)> tapOf(const std::shared_ptr<Journal>& journal) {
  if (!journal) return {};
  return [journal](const delivery::SharedBytes& message) { journal->sent(message); };
}

// Drops colliders, grabs and winds of participants that are not in the roster: they left after the
// checkpoint.
void dropAbsent(const SavedRoster& roster, Checkpoint& checkpoint) {
  const auto isAbsent = [&](std::uint64_t id) {
    return std::ranges::find(roster.participants, id, [](const SavedParticipant& known) {
             return known.participant.id;
           }) == roster.participants.end();
  };
  std::erase_if(checkpoint.colliders.colliders,
                [&](const ColliderSet::Placed& placed) { return isAbsent(placed.participant); });
  std::erase_if(checkpoint.winds,
                [&](const HeldWinds::Placed& placed) { return isAbsent(placed.participant); });
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

LiveScene::LiveScene(model::Scene definition, SceneTerms agreed, std::shared_ptr<Journal> kept,
                     std::shared_ptr<Budget> budget)
    : terms(std::move(agreed)),
      journal(std::move(kept)),
      subscribers(tapOf(journal)),
      surfaces(&definition_),
      poses(subscribers, inbox, &definition_, model::kMaxLocalWinds - definition.winds.size(), &surfaces),
      roster(subscribers, poses, journal.get()),
      work(schedule::WorkLevel{1, definition.substeps}),
      definition_(std::move(definition), std::move(budget), !terms.created) {}

LiveScene::LiveScene(std::string name, std::shared_ptr<FrameSource> from, std::uint32_t maxParticipants)
    : terms{.maxParticipants = maxParticipants},
      source(std::move(from)),
      poses(subscribers, inbox),
      roster(subscribers, poses, nullptr),
      work(schedule::WorkLevel{}),
      definition_(nameAndRates(std::move(name), source->description()), nullptr, true,
                  clothsOf(source->description())) {}

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

void LiveScene::restore(SavedScene saved, const ReconnectGrace& grace, Clock::time_point now) {
  if (saved.checkpoint) {
    dropAbsent(saved.roster, *saved.checkpoint);
    tick = saved.checkpoint->state.tick;
  }
  definition_.restore(saved.accepted || !saved.checkpoint ? saved.accepted : saved.checkpoint->scene);
  if (saved.checkpoint || saved.accepted) {
    const std::lock_guard lock(mutex_);
    restored_ =
        std::make_shared<const Restored>(Restored{std::move(saved.checkpoint), std::move(saved.accepted)});
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

std::uint32_t LiveScene::codec() const {
  return source ? source->description().codec() : codec::kCodecHierarchical;
}

delivery::StreamShape LiveScene::shape() const {
  if (!source) return {.rate = start().streamRate, .qualities = start().stream.qualities};
  return {.rate = start().streamRate, .qualities = source->qualities(), .lockstep = source->inLockstep()};
}

messages::Result<void> LiveScene::change(std::uint64_t participant, const v1::ParameterChange& message,
                                         Role role) {
  if (source)
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                             fmt::format("parameterChange: '{}' {}; its parameters cannot be changed", name(),
                                         source->whyFixed())});
  return definition_.change(participant, message,
                            role == Role::owner ? Charge::Pace::any : Charge::Pace::inTime, inbox);
}

v1::ParameterChange LiveScene::restart() {
  forgetRestored();
  tick = 0;
  definition_.restart(inbox);
  ++restarts;
  resetRequested = false;
  return allParameters(start());
}

v1::ParameterChange LiveScene::revertTo(const model::Scene& applied) {
  definition_.revertTo(applied, inbox);
  return allParameters(applied);
}

std::shared_ptr<const delivery::DescriptionChunks> LiveScene::description() {
  return definition_.description([this](const model::Scene& accepted) {
    const double seconds = static_cast<double>(tick.load()) * accepted.tickSeconds();
    v1::StreamDescription message =
        source ? source->description()
               : messages::descriptionWithoutCloths(accepted, kEpoch, codec(), seconds);
    message.set_scene(name());
    return message;
  });
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

void LiveScene::announceSurfaces() {
  if (const delivery::SharedBytes list = surfaceList(surfaces, announcedSurfaces_))
    subscribers.announceHere(list);
}

delivery::SharedBytes pausedNotice(const LiveScene& scene, std::uint64_t participant) {
  const bool paused = scene.paused;
  return delivery::notice(paused ? v1::NOTICE_KIND_SCENE_PAUSED : v1::NOTICE_KIND_SCENE_RESUMED,
                          paused ? "the scene is paused" : "the scene is resumed", scene.tick.load(),
                          participant);
}

}  // namespace clothstream::scene

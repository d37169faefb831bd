// SPDX-License-Identifier: MIT
#include "server/fleet/directory.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <future>
#include <tuple>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/hosting/scene_server.h"
#include "server/saved_state/contents.h"
#include "server/saved_state/crc.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;

constexpr auto kPeriod = 500ms;
constexpr auto kRetry = 2s;
// Entries of servers are deleted by NATS after this time without a renewal.
constexpr auto kServerLifetime = 30s;
constexpr auto kStateTime = 2s;  // that reading a state may take
constexpr std::size_t kPartBytes = 512 * 1024;
constexpr std::uint64_t kMaxCheckpointBytes = std::uint64_t{256} << 20;
constexpr int kMaxParts = static_cast<int>(kMaxCheckpointBytes / kPartBytes) + 1;

std::string partKey(const std::string& scene, std::uint32_t slot, std::uint32_t part) {
  return fmt::format("{}.{}.{}", scene, slot, part);
}

// Deletes the parts of a slot from this one on. `parts` of the slot are known; there may be more, of an older
// checkpoint. The last one is deleted first, so that an interruption leaves no gap.
void purgeParts(Bucket& checkpoints, const std::string& scene, std::uint32_t slot, std::uint32_t first,
                std::uint32_t parts) {
  std::uint32_t end = std::max(first, parts);
  while (checkpoints.get(partKey(scene, slot, end))) ++end;
  while (end > first) checkpoints.purge(partKey(scene, slot, --end));
}

}  // namespace

struct Directory::Buckets {
  explicit Buckets(Nats& nats)
      : servers(nats, {.name = kServers, .lifetime = kServerLifetime}),
        scenes(nats, {.name = kScenes}),
        checkpoints(nats, {.name = kCheckpoints}) {}
  Bucket servers, scenes, checkpoints;
  bool serversRead = false, scenesRead = false;
  std::set<std::string> read;  // names of scenes, until all present entries are read
};

Directory::Directory(Nats& nats, hosting::SceneServer& server, v1::ServerEntry self, Adopt adopt)
    : nats_(nats), server_(server), self_(std::move(self)), adopt_(std::move(adopt)), view_(self_.origin()) {
  thread_ = std::thread([this] { run(); });
  renewing_ = std::thread([this] { renew(); });
}

Directory::~Directory() {
  end();
}

void Directory::end() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Directory::setScenes(std::vector<OwnScene> scenes) {
  {
    const std::lock_guard lock(mutex_);
    scenes_ = std::move(scenes);
    for (const OwnScene& own : scenes_) own_.offer(own.scene->name());
  }
  changed_.notify_all();
}

std::vector<Directory::OwnScene> Directory::scenesNow() const {
  const std::lock_guard lock(mutex_);
  return scenes_;
}

bool Directory::isTakenLocked(const std::string& name) const {
  const FleetView::Scene* const known = view_.find(name);
  return known != nullptr && known->entry.origin() != self_.origin() && !own_.moves(name) &&
         view_.isAlive(known->entry.origin(), Clock::now());
}

bool Directory::isTaken(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  return isTakenLocked(name);
}

bool Directory::isRunElsewhere(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  return isTakenLocked(name) && view_.server(view_.find(name)->entry.origin())->isNew;
}

bool Directory::owns(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  return view_.ownRevisionOf(name).has_value();
}

std::optional<std::string> Directory::publicNameOf(const std::string& scene) const {
  const std::lock_guard lock(mutex_);
  const FleetView::Scene* const known = view_.find(scene);
  if (known == nullptr || known->entry.origin() == self_.origin()) return std::nullopt;
  const Clock::time_point now = Clock::now();
  if (view_.isAlive(known->entry.origin(), now))
    return view_.server(known->entry.origin())->entry.public_name();
  const bool isContinued =
      known->entry.created() && known->entry.has_checkpoint() && orphans_.mayContinue(scene, now);
  return isContinued ? std::optional(std::string()) : std::nullopt;
}

void Directory::simulateLoss() {
  {
    const std::lock_guard lock(mutex_);
    lost_ = true;
  }
  changed_.notify_all();
}

std::vector<v1::ServerEntry> Directory::others() const {
  const std::lock_guard lock(mutex_);
  return view_.others(Clock::now());
}

bool Directory::isThere(std::uint64_t other) const {
  const std::lock_guard lock(mutex_);
  return view_.isAlive(other, Clock::now());
}

bool Directory::isStopping() const {
  const std::lock_guard lock(mutex_);
  return leaves_;
}

void Directory::setStopping() {
  {
    const std::lock_guard lock(mutex_);
    leaves_ = true;
  }
  changed_.notify_all();
}

std::optional<std::uint64_t> Directory::beginMove(const std::string& name) {
  std::unique_lock lock(mutex_);
  own_.beginMove(name);
  changed_.wait(lock, [&] { return saving_ != name; });
  const std::optional<std::uint64_t> revision = view_.ownRevisionOf(name);
  if (!revision) own_.endMove(name);
  return revision;
}

void Directory::endMove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  own_.endMove(name);
}

void Directory::expect(const std::string& name) {
  const std::lock_guard lock(mutex_);
  own_.expect(name);
}

void Directory::expectNoMore(const std::string& name) {
  const std::lock_guard lock(mutex_);
  own_.expectNoMore(name);
}

v1::StoredCheckpoint Directory::checkpointOf(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const FleetView::Scene* const known = view_.find(name);
  return known == nullptr ? v1::StoredCheckpoint() : known->entry.checkpoint();
}

bool Directory::transfer(const std::string& name, const v1::SceneEntry& entry, std::uint64_t revision) {
  const auto written = Bucket(nats_, {.name = kScenes}).update(name, entry.SerializeAsString(), revision);
  if (written) know(name, entry, *written);
  return written.has_value();
}

std::uint64_t Directory::ownerOf(const std::string& name) {
  const auto present = Bucket(nats_, {.name = kScenes}).get(name);
  v1::SceneEntry entry;
  return present && entry.ParseFromString(present->value) ? entry.origin() : 0;
}

void Directory::give(const std::string& name, const v1::SceneEntry& entry) {
  know(name, entry, Bucket(nats_, {.name = kScenes}).put(name, entry.SerializeAsString()));
}

void Directory::know(const std::string& name, const v1::SceneEntry& entry, std::uint64_t revision) {
  const std::lock_guard lock(mutex_);
  view_.learn(name, entry, revision);
}

v1::ServerEntry Directory::selfNow() const {
  v1::ServerEntry now = self_;
  for (const auto& scene : server_.scenes.all()) {
    now.set_participants(now.participants() + static_cast<std::uint32_t>(scene->subscribers.size()));
    now.set_created_scenes(now.created_scenes() + (scene->terms.created ? 1 : 0));
  }
  const scene::Budget::Usage usage = server_.budget->usage();
  now.set_load(usage.load);
  now.set_max_load(usage.load + usage.freeLoad);
  // A server that plays a recording has no device.
  now.set_max_created_scenes(server_.device.info().name.empty() ? 0 : server_.options.maxCreatedScenes);
  const std::lock_guard lock(mutex_);
  now.set_stopping(leaves_);
  return now;
}

void Directory::run() {
  telemetry::nameThread("directory");
  std::unique_ptr<Buckets> buckets;
  std::unique_lock lock(mutex_);
  for (;;) {
    const bool last = stopping_;
    if (lost_) break;
    lock.unlock();
    Clock::duration wait = kPeriod;
    try {
      if (!buckets && nats_.connected() && !last) {
        buckets = std::make_unique<Buckets>(nats_);
        const std::lock_guard reading(mutex_);
        view_.beginReading();
      }
      if (buckets) pass(*buckets);
      if (buckets && last) {
        saveScenes(*buckets, scenesNow(), true);
        endLease();
        buckets->servers.remove(keyOf(self_.origin()));
      }
      if (buckets) logged_ = false;
    } catch (const std::exception& failure) {
      if (!std::exchange(logged_, true))
        spdlog::warn(
            "the directory of the fleet cannot be used: {}; trying again (nats-server needs --jetstream)",
            failure.what());
      buckets.reset();
      wait = kRetry;
    }
    lock.lock();
    view_.setReads(buckets && buckets->serversRead && buckets->scenesRead);
    if (last) break;
    changed_.wait_for(lock, wait, [this] { return stopping_ || lost_; });
  }
  lock.unlock();
  endLease();
}

void Directory::renew() {
  std::unique_ptr<Bucket> servers;
  std::unique_lock lock(mutex_);
  while (!leaseEnds_ && !lost_) {
    lock.unlock();
    try {
      if (!servers && nats_.connected())
        servers =
            std::make_unique<Bucket>(nats_, BucketOptions{.name = kServers, .lifetime = kServerLifetime});
      if (servers) servers->put(keyOf(self_.origin()), selfNow().SerializeAsString());
    } catch (const std::exception&) {  // the other thread says why
      servers.reset();
    }
    lock.lock();
    changed_.wait_for(lock, kPeriod, [this] { return leaseEnds_ || lost_; });
  }
}

void Directory::endLease() {
  {
    const std::lock_guard lock(mutex_);
    leaseEnds_ = true;
  }
  changed_.notify_all();
  if (renewing_.joinable()) renewing_.join();
}

void Directory::pass(Buckets& buckets) {
  readChanges(buckets);
  if (!buckets.serversRead || !buckets.scenesRead) return;
  checkHearing();
  const std::vector<OwnScene> scenes = scenesNow();
  claimScenes(buckets, scenes);
  saveScenes(buckets, scenes, false);
  adoptScenes(buckets);
}

void Directory::checkHearing() {
  const std::lock_guard lock(mutex_);
  if (view_.isSilent(Clock::now())) throw std::runtime_error("NATS does not tell about changes any more");
}

void Directory::readChanges(Buckets& buckets) {
  while (const auto change = buckets.servers.next(1ms)) {
    if (change->key.empty()) {
      buckets.serversRead = true;
      continue;
    }
    v1::ServerEntry entry;
    if (!change->deleted && !entry.ParseFromString(change->value)) continue;
    const std::lock_guard lock(mutex_);
    if (change->deleted)
      view_.removeServer(change->key);
    else
      view_.renew(entry, buckets.serversRead, Clock::now());
  }
  while (const auto change = buckets.scenes.next(1ms)) {
    if (change->key.empty()) {
      buckets.scenesRead = true;
      const std::lock_guard lock(mutex_);
      view_.finishReading(buckets.read, Clock::now());
      continue;
    }
    v1::SceneEntry entry;
    if (!change->deleted && !entry.ParseFromString(change->value)) continue;
    if (!change->deleted && buckets.scenesRead) {
      know(change->key, entry, change->revision);
      continue;
    }
    const std::lock_guard lock(mutex_);
    if (change->deleted) {
      view_.removeScene(change->key, change->revision);
      continue;
    }
    view_.replace(change->key, entry, change->revision);
    buckets.read.insert(change->key);
  }
}

void Directory::claimScenes(Buckets& buckets, const std::vector<OwnScene>& scenes) {
  std::vector<std::pair<std::string, FleetView::Scene>> given;
  for (const OwnScene& own : scenes) {
    const std::string& name = own.scene->name();
    std::optional<FleetView::Scene> known;
    {
      const std::lock_guard lock(mutex_);
      if (own_.leaves(name)) continue;
      if (const auto* const found = view_.find(name)) known = *found;
      const Clock::time_point now = Clock::now();
      if (known && known->entry.origin() != self_.origin() &&
          (view_.isAlive(known->entry.origin(), now) || !view_.isSettled(now)))
        continue;
    }
    if (known && known->entry.origin() == self_.origin() && known->entry.stream() == own.stream) continue;
    v1::SceneEntry entry;
    entry.set_origin(self_.origin());
    entry.set_stream(own.stream);
    entry.set_created(own.scene->terms.created);
    // A scene that was continued here, or came here, keeps its checkpoint until it has another one.
    if (known && known->entry.origin() == self_.origin())
      *entry.mutable_checkpoint() = known->entry.checkpoint();
    const auto revision = known ? buckets.scenes.update(name, entry.SerializeAsString(), known->revision)
                                : buckets.scenes.create(name, entry.SerializeAsString());
    if (revision) know(name, entry, *revision);
  }
  {
    const std::lock_guard lock(mutex_);
    const auto isOffered = [&](const std::string& name) {
      return std::ranges::any_of(scenes_, [&](const OwnScene& own) { return own.scene->name() == name; });
    };
    for (const auto& [name, known] : view_.scenes())
      if (known.entry.origin() == self_.origin() && own_.had(name) && !own_.moves(name) && !isOffered(name))
        given.emplace_back(name, known);
    own_.forgetIf([&](const std::string& name) { return !view_.ownRevisionOf(name) && !isOffered(name); });
  }
  for (const auto& [name, known] : given) {
    // Another server may have it by now.
    const auto present = buckets.scenes.get(name);
    if (!present || present->revision != known.revision) continue;
    // The parts go first: without the entry nobody would look for them again.
    const v1::StoredCheckpoint& stored = known.entry.checkpoint();
    for (std::uint32_t slot = 0; slot < 2; ++slot)
      purgeParts(buckets.checkpoints, name, slot, 0, slot == stored.slot() ? stored.parts() : 0);
    buckets.scenes.remove(name);
    saved_.erase(name);
  }
}

void Directory::saveScenes(Buckets& buckets, const std::vector<OwnScene>& scenes, bool all) {
  for (const OwnScene& own : scenes) {
    if (!own.scene->terms.created) continue;
    Stored& stored = saved_[own.scene->name()];
    if (!all && Clock::now() - stored.at < kCheckpointPeriod) continue;
    // A scene that stands still may have other parameters or participants.
    const Stored next{
        .at = Clock::now(),
        .tick = own.scene->tick.load(),
        .version = own.scene->version(),
        .session = saved_state::crcOf(saved_state::stateOf(*own.scene, std::nullopt).SerializeAsString())};
    const bool isFirst = stored.at == Clock::time_point{};
    stored.at = next.at;
    if (!isFirst && stored == next) continue;
    {
      const std::lock_guard lock(mutex_);
      if (own_.leaves(own.scene->name())) continue;
      saving_ = own.scene->name();
    }
    bool isSaved = false, isLost = false;
    try {
      isSaved = save(buckets, own);
    } catch (const std::exception& failure) {  // such as a full store
      telemetry::log({own.scene->name()}, spdlog::level::warn,
                     "no checkpoint for other servers: {}; trying again", failure.what());
      isLost = true;
    }
    {
      const std::lock_guard lock(mutex_);
      saving_.clear();
    }
    changed_.notify_all();
    if (isSaved) stored = next;
    if (isLost) return;  // each attempt takes seconds
  }
}

bool Directory::save(Buckets& buckets, const OwnScene& own) {
  const std::string& name = own.scene->name();
  std::optional<std::uint64_t> revision;
  {
    const std::lock_guard lock(mutex_);
    revision = view_.ownRevisionOf(name);
  }
  if (!revision) return false;
  std::future<std::optional<scene::Checkpoint>> state = server_.device.read(own.scene);
  if (state.wait_for(kStateTime) != std::future_status::ready) return false;
  std::string bytes;
  v1::SceneEntry entry;
  try {
    const std::optional<scene::Checkpoint> checkpoint = state.get();
    v1::SavedParts parts = saved_state::definitionOf(*own.scene);
    v1::SavedParts rest = saved_state::stateOf(*own.scene, checkpoint);
    parts.MergeFrom(rest);
    bytes = parts.SerializeAsString();
    entry.mutable_checkpoint()->set_tick(checkpoint ? checkpoint->state.tick : 0);
  } catch (const std::exception& failure) {
    spdlog::debug("{}: no checkpoint for other servers: {}", name, failure.what());
    return false;
  }
  if (bytes.size() > kMaxCheckpointBytes) return false;
  const v1::StoredCheckpoint former = checkpointOf(name);
  entry.mutable_checkpoint()->set_slot(former.parts() > 0 ? 1 - former.slot() : 0);
  entry.set_origin(self_.origin());
  entry.set_stream(own.stream);
  entry.set_created(true);
  v1::StoredCheckpoint& stored = *entry.mutable_checkpoint();
  stored.set_bytes(bytes.size());
  stored.set_crc(saved_state::crcOf(bytes));
  for (std::size_t at = 0; at < bytes.size(); at += kPartBytes) {
    buckets.checkpoints.put(partKey(name, stored.slot(), stored.parts()), bytes.substr(at, kPartBytes));
    stored.set_parts(stored.parts() + 1);
  }
  const auto written = buckets.scenes.update(name, entry.SerializeAsString(), *revision);
  if (!written) return false;
  know(name, entry, *written);
  purgeParts(buckets.checkpoints, name, stored.slot(), stored.parts(), stored.parts());
  return true;
}

std::optional<v1::SavedParts> Directory::load(Buckets& buckets, const std::string& name,
                                              const v1::StoredCheckpoint& stored) {
  if (stored.bytes() > kMaxCheckpointBytes || stored.parts() > kMaxParts || stored.slot() > 1)
    return std::nullopt;
  std::string bytes;
  for (std::uint32_t part = 0; part < stored.parts(); ++part) {
    const auto entry = buckets.checkpoints.get(partKey(name, stored.slot(), part));
    if (!entry || bytes.size() + entry->value.size() > stored.bytes()) return std::nullopt;
    bytes += entry->value;
  }
  v1::SavedParts parts;
  if (saved_state::crcOf(bytes) != stored.crc() || !parts.ParseFromString(bytes)) return std::nullopt;
  return parts;
}

void Directory::adoptScenes(Buckets& buckets) {
  const Clock::time_point now = Clock::now();
  std::optional<std::pair<std::string, FleetView::Scene>> next;
  {
    const std::lock_guard lock(mutex_);
    if (leaves_ || stopping_ || !view_.isSettled(now)) return;
    orphans_.eraseIf([&](const std::string& name) { return view_.find(name) == nullptr; });
    for (const auto& [name, known] : view_.scenes()) {
      const v1::SceneEntry& entry = known.entry;
      // A claim of this server may have come through after it had given up.
      const bool isOurs = entry.origin() == self_.origin() && (own_.had(name) || own_.moves(name));
      const bool isOthers = entry.origin() != self_.origin() && view_.isAlive(entry.origin(), now);
      if (!entry.created() || !entry.has_checkpoint() || isOurs || isOthers) {
        orphans_.erase(name);
        continue;
      }
      orphans_.add(name, now);
      if (!next && orphans_.isDue(name, now)) next.emplace(name, known);
    }
  }
  if (!next) return;
  auto& [name, known] = *next;
  std::string problem = "its checkpoint is damaged";
  std::optional<std::uint64_t> claimed;
  if (auto parts = load(buckets, name, known.entry.checkpoint())) {
    expect(name);
    problem = adopt_(std::move(*parts), [&] {
      v1::SceneEntry entry = known.entry;
      entry.set_origin(self_.origin());
      entry.set_stream(0);
      claimed = buckets.scenes.update(name, entry.SerializeAsString(), known.revision);
      if (claimed) know(name, entry, *claimed);
      return claimed.has_value();
    });
  }
  if (problem.empty()) return;
  telemetry::log({name}, spdlog::level::warn, "the scene of a server that is gone is not continued here: {}",
                 problem);
  {
    const std::lock_guard lock(mutex_);
    orphans_.postpone(name, Clock::now() + 10 * kRetry);
  }
  // Another server may try.
  if (claimed) std::ignore = buckets.scenes.update(name, known.entry.SerializeAsString(), *claimed);
  expectNoMore(name);
}

}  // namespace clothstream::fleet

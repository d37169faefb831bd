// SPDX-License-Identifier: MIT
#include "server/saved_state/saved_state.h"

#include <algorithm>
#include <system_error>
#include <tuple>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/messages/scene_message.h"
#include "server/saved_state/contents.h"
#include "server/saved_state/state_message.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::saved_state {
namespace {

using schedule::Clock;

// Share of the limit that contents may take; the rest is for pages that are not full.
constexpr double kContentShare = 0.8;
constexpr std::chrono::seconds kAfterFailure{2};

void warnOfDamage(const std::string& name, const std::filesystem::path& file, const std::string& problem) {
  telemetry::log({name}, spdlog::level::err,
                 "not restored: {} (in {}); its row stays until a scene of this name "
                 "is kept or deleted",
                 problem, file.string());
}

}  // namespace

// Newest checkpoint of a scene, on its way from the device's thread to the writer.
class SavedState::CheckpointSlot final : public scene::SceneKeeper {
 public:
  explicit CheckpointSlot(std::chrono::milliseconds interval) : interval_(interval) {}

  bool due(Clock::time_point now) override {
    if (now < next_) return false;
    if (next_ == Clock::time_point{}) {
      const std::lock_guard lock(mutex_);
      runsSince_ = now;
    }
    next_ = now + interval_;
    return true;
  }
  void save(scene::Checkpoint checkpoint) override {
    const std::lock_guard lock(mutex_);
    waiting_ = Taken{std::move(checkpoint), Clock::now()};
  }
  std::optional<Clock::time_point> savedAt() const override {
    const std::lock_guard lock(mutex_);
    return savedAt_;
  }
  std::optional<Clock::time_point> unsavedSince() const override {
    const std::lock_guard lock(mutex_);
    return savedAt_ ? savedAt_ : runsSince_;
  }

  // The following belong to the writer.
  std::optional<Taken> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(waiting_, std::nullopt);
  }
  // Returns a checkpoint that was not written, unless there is a newer one.
  void putBack(Taken taken) {
    const std::lock_guard lock(mutex_);
    if (!waiting_) waiting_ = std::move(taken);
  }
  void written(Clock::time_point takenAt) {
    const std::lock_guard lock(mutex_);
    savedAt_ = takenAt;
  }
  bool waits() const {
    const std::lock_guard lock(mutex_);
    return waiting_.has_value();
  }

 private:
  const std::chrono::milliseconds interval_;
  Clock::time_point next_{};  // device's thread only

  mutable std::mutex mutex_;
  std::optional<Taken> waiting_;
  std::optional<Clock::time_point> savedAt_, runsSince_;
};

SavedState::SavedState(SavedStateOptions options)
    : options_(std::move(options)),
      database_({.directory = options_.directory / "scenes", .maxBytes = options_.maxBytes}) {
  for (Database::Row& row : database_.rows()) {
    auto contents = database_.read(row.name);
    if (!contents) {
      warnOfDamage(row.name, database_.file(), contents.error());
    } else if (!row.created) {
      earlier_.addOfServer(row.name, std::move(*contents));
    } else if (auto saved = toCreated(*contents); !saved) {
      warnOfDamage(row.name, database_.file(), saved.error());
    } else {
      earlier_.addCreated(row.name, std::move(*saved));
    }
    rows_.emplace(row.name, std::move(row));
  }
  status_.bytes = database_.bytes();
  thread_ = std::thread([this] { run(); });
}

SavedState::~SavedState() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::vector<scene::SavedScene> SavedState::takeCreated() {
  const std::lock_guard lock(mutex_);
  return earlier_.takeCreated();
}

std::optional<scene::SavedScene> SavedState::take(const model::Scene& start) {
  std::optional<SceneContents> contents;
  {
    const std::lock_guard lock(mutex_);
    contents = earlier_.takeOfServer(start.name);
  }
  if (!contents) return {};
  v1::SavedScene message;
  const bool isParsed = contents->scene && message.ParseFromString(*contents->scene);
  if (!isParsed) warnOfDamage(start.name, database_.file(), "its definition is damaged");
  scene::SavedScene saved{.start = start, .maxParticipants = message.max_participants()};
  if (isParsed && isOf(message, start)) {
    addSessionAndCheckpoint(*contents, saved);
    const std::lock_guard lock(mutex_);
    earlier_.setRestored(start.name);
    return saved;
  }
  if (isParsed)
    telemetry::log({start.name}, spdlog::level::info,
                   "its definition differs from that of the saved state: it starts from the beginning, and "
                   "keeps its bans");
  saved.roster = toRoster(parseSession(start.name, *contents));
  saved.roster.participants.clear();
  if (saved.roster.bans.empty() && saved.roster.refusedTokenHashes.empty()) return {};
  return saved;
}

std::shared_ptr<scene::SceneKeeper> SavedState::keep(const std::shared_ptr<scene::LiveScene>& scene) {
  auto slot = std::make_shared<CheckpointSlot>(options_.checkpointInterval);
  {
    const std::lock_guard lock(mutex_);
    if (!scene->terms.created && earlier_.isCreated(scene->name())) return nullptr;
    earlier_.eraseUnused(scene->name());
    kept_[scene->name()] = std::make_shared<KeptScene>(scene, slot, earlier_.isRestored(scene->name()));
  }
  changed_.notify_all();
  return slot;
}

void SavedState::remove(const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    kept_.erase(name);
    earlier_.remove(name);
    removed_.insert(name);
  }
  changed_.notify_all();
}

bool SavedState::flush(std::chrono::milliseconds timeout, const std::string& name) {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = flushes_.add(name);
  changed_.notify_all();
  if (!written_.wait_for(lock, timeout, [&] { return flushes_.isServed(number); }) || flushes_.failed())
    return false;
  return name.empty() ? retryAt_.empty() : !retryAt_.contains(name);
}

scene::StoreStatus SavedState::status() const {
  const std::lock_guard lock(mutex_);
  scene::StoreStatus status = status_;
  status.waiting = removed_.size() + failedRemovals_ +
                   static_cast<std::size_t>(std::ranges::count_if(
                       kept_, [](const auto& kept) { return kept.second->slot->waits(); }));
  return status;
}

void SavedState::run() {
  telemetry::nameThread("state writer");
  bool failed = false;
  for (bool last = false; !last;) {
    std::uint64_t asked = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, options_.lookInterval,
                        [&] { return stopping_ || flushes_.waits() || (!failed && !removed_.empty()); });
      last = stopping_;
      asked = flushes_.newest();
    }
    failed = false;
    try {
      pass();
    } catch (const std::exception& failure) {
      failed = true;
      if (std::exchange(logsNextFailure_, false))
        spdlog::error("states of scenes are not saved: {}; trying again", failure.what());
    }
    if (!failed) logsNextFailure_ = true;
    const std::lock_guard lock(mutex_);
    flushes_.serve(asked, failed);
    written_.notify_all();
  }
}

void SavedState::pass() {
  KeptScenes kept;
  std::set<std::string> flushed;
  {
    const std::lock_guard lock(mutex_);
    kept = kept_;
    flushed = flushes_.takeNames();
    toRemove_.merge(removed_);
    removed_.clear();
  }
  // A scene that failed is tried again later, or when flush() waits for it. Other scenes do not wait.
  const auto isDue = [&](const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto failed = retryAt_.find(name);
    return failed == retryAt_.end() || Clock::now() >= failed->second || stopping_ ||
           flushed.contains(name) || flushed.contains(std::string());
  };
  for (auto name = toRemove_.begin(); name != toRemove_.end();) {
    if (!isDue(*name) || !recordResult(*name, database_.remove(*name))) {
      ++name;
      continue;
    }
    recordSuccess(*name);
    rows_.erase(*name);
    leftOut_.erase(*name);
    name = toRemove_.erase(name);
  }
  findFreeSpace();
  // A removal that failed comes before another scene of the same name.
  for (const auto& [name, scene] : kept)
    if (!toRemove_.contains(name) && isDue(name)) saveScene(name, *scene);
  const std::lock_guard lock(mutex_);
  status_.bytes = database_.bytes();
  status_.leftOut = leftOut_.size();
  failedRemovals_ = toRemove_.size();
}

void SavedState::saveScene(const std::string& name, KeptScene& kept) {
  // The checkpoint is taken before the session is read, so that the session is not older.
  std::optional<Taken> checkpoint = diskIsFull_ ? std::nullopt : kept.slot->take();
  bool written = false;
  try {
    if (options_.beforeWrite) options_.beforeWrite(name);
    readSession(kept);
    written = write(name, kept, checkpoint);
  } catch (const std::exception& failure) {
    recordFailure(name, failure.what());
  }
  if (written)
    recordSuccess(name);
  else if (checkpoint)
    kept.slot->putBack(std::move(*checkpoint));
}

void SavedState::readSession(KeptScene& kept) {
  const std::shared_ptr<scene::LiveScene> live = kept.scene.lock();
  if (!live) return;
  // The version is read first: a change in between is seen by the next call.
  if (const std::uint64_t version = live->version(); kept.version != version) {
    kept.parameters = messages::toMessageWithoutMeshes(live->definition());
    kept.version = version;
  }
  const scene::SavedRoster roster = live->roster.saved();
  kept.hasSession = !roster.participants.empty() || !roster.bans.empty() ||
                    !roster.refusedTokenHashes.empty() || live->paused;
  std::string session = sessionOf(*live, roster, kept.parameters).SerializeAsString();
  if (session != kept.session)
    kept.waitingSession = std::move(session);
  else
    kept.waitingSession.reset();
}

bool SavedState::write(const std::string& name, KeptScene& kept, const std::optional<Taken>& checkpoint) {
  // A scene of the server has a row once it has run, is paused, or has a participant or a ban.
  if (!kept.hasRow && !kept.created && !checkpoint && !kept.hasSession) return true;
  if (kept.hasRow && !checkpoint && !kept.waitingSession) return true;
  SceneContents contents{.session = kept.waitingSession, .created = kept.created};
  if (!kept.hasRow) {
    const std::shared_ptr<scene::LiveScene> live = kept.scene.lock();
    if (!live) return true;
    contents.scene = toMessage(live->start(), live->terms).SerializeAsString();
  }
  if (checkpoint) contents.checkpoint = toMessage(checkpoint->checkpoint).SerializeAsString();
  Database::Row row = kept.hasRow ? rows_[name] : Database::Row{.name = name, .created = kept.created};
  if (contents.scene) row.sceneBytes = contents.scene->size();
  if (contents.session) row.sessionBytes = contents.session->size();
  const std::uint64_t rest = row.sceneBytes + row.sessionBytes;
  if (contents.checkpoint && !makeRoom(name, rest, contents.checkpoint->size())) {
    contents.checkpoint.reset();
    if (kept.hasRow) row.checkpointBytes = rows_[name].checkpointBytes;
  }
  // A definition that does not fit is refused by the database.
  if (contents.scene && !contents.checkpoint) std::ignore = makeRoom(name, rest, 0);
  if (!contents.scene && !contents.session && !contents.checkpoint) return true;
  if (!recordResult(name, database_.write(name, contents))) return false;
  if (contents.checkpoint) row.checkpointBytes = contents.checkpoint->size();
  rows_[name] = std::move(row);
  kept.hasRow = true;
  if (contents.session) kept.session = std::move(*contents.session);
  kept.waitingSession.reset();
  if (contents.checkpoint) kept.slot->written(checkpoint->at);
  return true;
}

bool SavedState::makeRoom(const std::string& name, std::uint64_t rest, std::uint64_t checkpoint) {
  if (options_.maxBytes == 0) return true;
  const auto room = static_cast<std::uint64_t>(kContentShare * static_cast<double>(options_.maxBytes));
  for (;;) {
    std::uint64_t bytes = rest + checkpoint, withoutCheckpoints = rest;
    Database::Row* largest = nullptr;
    for (auto& [key, row] : rows_) {
      if (key == name) continue;
      bytes += row.bytes();
      withoutCheckpoints += row.sceneBytes + row.sessionBytes;
      if (largest == nullptr || row.checkpointBytes > largest->checkpointBytes) largest = &row;
    }
    if (bytes <= room) {
      if (checkpoint > 0) leftOut_.erase(name);
      return true;
    }
    // A scene that never fits takes no room from others.
    const bool neverFits = withoutCheckpoints > room;
    if (!neverFits && dropOldestUnused()) continue;
    const bool isLargest = neverFits || largest == nullptr || largest->checkpointBytes <= checkpoint;
    if (isLargest && checkpoint == 0) return false;
    if (!leaveOut(isLargest ? name : largest->name) || isLargest) return false;
  }
}

bool SavedState::leaveOut(const std::string& name) {
  if (leftOut_.insert(name).second)
    telemetry::log({name}, spdlog::level::warn,
                   "its state is not saved: all scenes would take more than {:.0f} MB (--state-limit); "
                   "after a restart it starts from the beginning",
                   static_cast<double>(options_.maxBytes) / 1e6);
  const auto row = rows_.find(name);
  // An old checkpoint would restore an outdated state after a restart.
  if (row == rows_.end() || row->second.checkpointBytes == 0) return true;
  if (!recordResult(name, database_.removeCheckpoint(name))) return false;
  row->second.checkpointBytes = 0;
  return true;
}

bool SavedState::dropOldestUnused() {
  auto oldest = rows_.end();
  {
    const std::lock_guard lock(mutex_);
    for (auto row = rows_.begin(); row != rows_.end(); ++row)
      if (earlier_.isUnused(row->first) &&
          (oldest == rows_.end() || row->second.order < oldest->second.order))
        oldest = row;
  }
  if (oldest == rows_.end()) return false;
  const std::string name = oldest->first;
  if (!recordResult(name, database_.remove(name))) return false;
  telemetry::log({name}, spdlog::level::warn,
                 "its saved state is deleted, because the server does not start with this scene and other "
                 "scenes need the room (--state-limit)");
  rows_.erase(oldest);
  const std::lock_guard lock(mutex_);
  earlier_.eraseUnused(name);
  return true;
}

void SavedState::findFreeSpace() {
  std::error_code problem;
  const std::filesystem::space_info space = std::filesystem::space(options_.directory, problem);
  const bool full = !problem && space.available < options_.minFreeBytes;
  if (full && !diskIsFull_)
    spdlog::warn(
        "states of scenes are not saved: {} has {:.0f} MB left, and {:.0f} MB must stay free (--keep-free)",
        options_.directory.string(), static_cast<double>(space.available) / 1e6,
        static_cast<double>(options_.minFreeBytes) / 1e6);
  if (!full && diskIsFull_) spdlog::info("states of scenes are saved again");
  diskIsFull_ = full;
}

bool SavedState::recordResult(const std::string& name, const Database::Done& done) {
  {
    const std::lock_guard lock(mutex_);
    ++status_.writes;
  }
  if (!done) recordFailure(name, done.error());
  return done.has_value();
}

void SavedState::recordFailure(const std::string& name, const std::string& why) {
  const std::lock_guard lock(mutex_);
  ++status_.failedWrites;
  const bool isFirst = retryAt_.insert_or_assign(name, Clock::now() + kAfterFailure).second;
  if (isFirst)
    telemetry::log({name}, spdlog::level::err, "it cannot be saved in {}: {}; trying again",
                   database_.file().string(), why);
}

void SavedState::recordSuccess(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (retryAt_.erase(name) > 0) telemetry::log({name}, spdlog::level::info, "it is saved again");
}

}  // namespace clothstream::saved_state

// SPDX-License-Identifier: MIT
#include "server/saved_state/saved_state.h"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/messages/scene_message.h"
#include "server/saved_state/state_message.h"
#include "server/telemetry/log.h"

namespace clothstream::saved_state {
namespace {

using schedule::Clock;

// Share of the limit that contents may take; the rest is for pages that are not full.
constexpr double kContentShare = 0.8;
constexpr std::chrono::seconds kAfterFailure{2};

// Adds what is the same for all scenes. Returns the first problem.
Read<void> readRest(const SceneContents& contents, scene::SavedScene& saved) {
  const auto wrong = [](std::string what) { return tl::unexpected(std::move(what)); };
  v1::SavedSession session;
  if (contents.session && !session.ParseFromString(*contents.session)) return wrong("its session is damaged");
  saved.roster = toRoster(session);
  saved.paused = session.paused();
  v1::SavedCheckpoint checkpoint;
  if (contents.checkpoint) {
    if (!checkpoint.ParseFromString(*contents.checkpoint)) return wrong("its checkpoint is damaged");
    auto read = toCheckpoint(checkpoint, saved.start);
    if (!read) return wrong(std::move(read).error());
    saved.checkpoint = std::move(*read);
  }
  if (!session.has_parameters()) return {};
  const v1::Scene then =
      contents.checkpoint ? checkpoint.parameters() : messages::toMessageWithoutMeshes(saved.start);
  if (session.parameters().SerializeAsString() == then.SerializeAsString()) return {};
  auto accepted = withParameters(session.parameters(), saved.start);
  if (!accepted) return wrong(std::move(accepted).error());
  saved.accepted = std::move(*accepted);
  return {};
}

Read<scene::SavedScene> toCreated(const SceneContents& contents) {
  v1::SavedScene message;
  if (!contents.scene || !message.ParseFromString(*contents.scene))
    return tl::unexpected(std::string("its definition is damaged"));
  Read<model::Scene> start = toScene(message.definition());
  if (!start) return tl::unexpected(std::move(start).error());
  scene::SavedScene saved{
      .start = std::move(*start), .maxParticipants = message.max_participants(), .tenant = message.tenant()};
  if (auto rest = readRest(contents, saved); !rest) return tl::unexpected(std::move(rest).error());
  return saved;
}

void warnOfDamage(const std::string& name, const std::filesystem::path& file, const std::string& problem) {
  telemetry::log({name}, spdlog::level::err,
                 "not restored: {} (in {}); its row stays until a scene of this name "
                 "is kept or deleted",
                 problem, file.string());
}

}  // namespace

class SavedState::Keeper final : public scene::SceneKeeper {
 public:
  explicit Keeper(std::chrono::milliseconds interval) : interval_(interval) {}

  bool due(Clock::time_point now) override {
    if (now < next_) return false;
    next_ = now + interval_;
    return true;
  }
  void save(scene::Checkpoint checkpoint) override {
    const std::lock_guard lock(mutex_);
    waiting_ = std::move(checkpoint);
    takenAt_ = Clock::now();
  }
  std::optional<Clock::time_point> savedAt() const override {
    const std::lock_guard lock(mutex_);
    return savedAt_;
  }

  // The following belong to the writer.
  std::optional<std::pair<scene::Checkpoint, Clock::time_point>> take() {
    const std::lock_guard lock(mutex_);
    if (!waiting_) return {};
    std::pair taken(std::move(*waiting_), takenAt_);
    waiting_.reset();
    return taken;
  }
  // Returns a checkpoint that was not written, unless there is a newer one.
  void putBack(std::pair<scene::Checkpoint, Clock::time_point> taken) {
    const std::lock_guard lock(mutex_);
    if (waiting_) return;
    waiting_ = std::move(taken.first);
    takenAt_ = taken.second;
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
  std::optional<scene::Checkpoint> waiting_;
  Clock::time_point takenAt_{};  // of waiting_
  std::optional<Clock::time_point> savedAt_;
};

SavedState::SavedState(SavedStateOptions options)
    : options_(std::move(options)),
      database_({.directory = options_.directory / "scenes", .maxBytes = options_.maxBytes}) {
  for (Database::Row& row : database_.rows()) {
    auto contents = database_.read(row.name);
    if (!contents) {
      warnOfDamage(row.name, database_.file(), contents.error());
    } else if (!row.created) {
      ofServer_.emplace(row.name, std::move(*contents));
    } else if (auto saved = toCreated(*contents); !saved) {
      warnOfDamage(row.name, database_.file(), saved.error());
    } else {
      created_.push_back(std::move(*saved));
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
  for (const scene::SavedScene& saved : created_) restored_.insert(saved.start.name);
  return std::exchange(created_, {});
}

std::optional<scene::SavedScene> SavedState::take(const model::Scene& start) {
  SceneContents contents;
  {
    const std::lock_guard lock(mutex_);
    const auto found = ofServer_.find(start.name);
    if (found == ofServer_.end()) return {};
    contents = std::move(found->second);
    ofServer_.erase(found);
  }
  v1::SavedScene message;
  if (!contents.scene || !message.ParseFromString(*contents.scene)) {
    warnOfDamage(start.name, database_.file(), "its definition is damaged");
    return {};
  }
  if (!isOf(message, start)) {
    telemetry::log({start.name}, spdlog::level::info,
                   "its definition is not that of the saved state: it starts from the beginning");
    return {};
  }
  scene::SavedScene saved{.start = start, .maxParticipants = message.max_participants()};
  if (const auto rest = readRest(contents, saved); !rest) {
    warnOfDamage(start.name, database_.file(), rest.error());
    return {};
  }
  const std::lock_guard lock(mutex_);
  restored_.insert(start.name);
  return saved;
}

std::shared_ptr<scene::SceneKeeper> SavedState::keep(const std::shared_ptr<scene::LiveScene>& scene) {
  auto keeper = std::make_shared<Keeper>(options_.checkpointInterval);
  {
    const std::lock_guard lock(mutex_);
    kept_[scene->name()] = std::make_shared<Kept>(scene, keeper, restored_.contains(scene->name()));
  }
  changed_.notify_all();
  return keeper;
}

void SavedState::remove(const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    kept_.erase(name);
    restored_.erase(name);
    removed_.insert(name);
  }
  changed_.notify_all();
}

bool SavedState::flush(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = ++asked_;
  changed_.notify_all();
  return written_.wait_for(lock, timeout, [&] { return done_ >= number; }) && !failed_;
}

scene::StoreStatus SavedState::status() const {
  const std::lock_guard lock(mutex_);
  scene::StoreStatus status = status_;
  status.waiting =
      removed_.size() + static_cast<std::size_t>(std::ranges::count_if(
                            kept_, [](const auto& kept) { return kept.second->keeper->waits(); }));
  return status;
}

void SavedState::run() {
  for (bool good = true;;) {
    bool last = false;
    {
      std::unique_lock lock(mutex_);
      const auto something = [&] { return stopping_ || asked_ > done_ || !removed_.empty(); };
      // A failure delays the next pass, unless flush() waits for it.
      changed_.wait_for(lock, good ? options_.lookInterval : kAfterFailure,
                        [&] { return good ? something() : stopping_ || asked_ > done_; });
      last = stopping_;
    }
    good = pass();
    if (last) return;
  }
}

bool SavedState::pass() {
  Names kept;
  std::set<std::string> removed;
  std::uint64_t asked = 0;
  {
    const std::lock_guard lock(mutex_);
    kept = kept_;
    removed = std::exchange(removed_, {});
    asked = asked_;
  }
  bool good = true;
  for (const std::string& name : removed) {
    if (note(name, database_.remove(name))) {
      rows_.erase(name);
      leftOut_.erase(name);
      continue;
    }
    good = false;
    const std::lock_guard lock(mutex_);
    removed_.insert(name);
  }
  const bool hasRoom = diskHasRoom();
  for (const auto& [name, scene] : kept) {
    look(*scene);
    // A removal that failed comes before another scene of the same name.
    if (removed.contains(name) && rows_.contains(name) && !scene->hasRow) continue;
    if (hasRoom || scene->waitingSession || !scene->hasRow) good = write(name, *scene) && good;
  }
  const std::lock_guard lock(mutex_);
  status_.bytes = database_.bytes();
  status_.leftOut = leftOut_.size();
  done_ = asked;
  failed_ = !good;
  written_.notify_all();
  return good;
}

void SavedState::look(Kept& kept) {
  const std::shared_ptr<scene::LiveScene> live = kept.scene.lock();
  if (!live) return;
  // The version is read first: a change in between is seen by the next look.
  if (const std::uint64_t version = live->version(); kept.version != version) {
    kept.parameters = messages::toMessageWithoutMeshes(live->definition());
    kept.version = version;
  }
  std::string session = toMessage(live->roster.saved(), live->paused, kept.parameters).SerializeAsString();
  if (session != kept.session)
    kept.waitingSession = std::move(session);
  else
    kept.waitingSession.reset();
}

bool SavedState::write(const std::string& name, Kept& kept) {
  SceneContents contents{.created = kept.created};
  auto checkpoint = diskIsFull_ ? std::nullopt : kept.keeper->take();
  // A scene of the server has a row once it has run.
  if (!kept.created && !kept.hasRow && !checkpoint) return true;
  if (!kept.waitingSession && !checkpoint && kept.hasRow) return true;
  if (!kept.hasRow) {
    const std::shared_ptr<scene::LiveScene> live = kept.scene.lock();
    if (!live) return true;
    contents.scene =
        toMessage(live->start(), kept.created, live->maxParticipants, live->tenant).SerializeAsString();
  }
  contents.session = kept.waitingSession;
  if (checkpoint) {
    contents.checkpoint = toMessage(checkpoint->first).SerializeAsString();
    if (!makeRoom(name, contents.checkpoint->size())) contents.checkpoint.reset();
  }
  if (!contents.scene && !contents.session && !contents.checkpoint) return true;
  if (!note(name, database_.write(name, contents))) {
    if (checkpoint) kept.keeper->putBack(std::move(*checkpoint));
    return false;
  }
  Database::Row& row = rows_[name];
  row.name = name;
  row.created = kept.created;
  const std::uint64_t rest = contents.scene ? contents.scene->size() : row.bytes - row.checkpointBytes;
  if (contents.checkpoint || contents.scene)
    row.checkpointBytes = contents.checkpoint ? contents.checkpoint->size() : 0;
  row.bytes = rest + row.checkpointBytes;
  kept.hasRow = true;
  if (contents.session) kept.session = std::move(*contents.session);
  kept.waitingSession.reset();
  if (contents.checkpoint) kept.keeper->written(checkpoint->second);
  return true;
}

bool SavedState::makeRoom(const std::string& name, std::uint64_t bytes) {
  if (options_.maxBytes == 0) return true;
  const auto room = static_cast<std::uint64_t>(kContentShare * static_cast<double>(options_.maxBytes));
  for (;;) {
    std::uint64_t others = 0;
    const Database::Row* largest = nullptr;
    for (const auto& [key, row] : rows_) {
      others += key == name ? row.bytes - row.checkpointBytes : row.bytes;
      if (key != name && (largest == nullptr || row.checkpointBytes > largest->checkpointBytes))
        largest = &row;
    }
    if (others + bytes <= room) {
      leftOut_.erase(name);
      return true;
    }
    const bool isLargest = largest == nullptr || largest->checkpointBytes <= bytes;
    const std::string leaves = isLargest ? name : largest->name;
    if (leftOut_.insert(leaves).second)
      telemetry::log({leaves}, spdlog::level::warn,
                     "its state is not saved: all scenes would take more than {:.0f} MB (--state-limit); "
                     "after a restart it starts from the beginning",
                     static_cast<double>(options_.maxBytes) / 1e6);
    Database::Row& row = rows_[leaves];
    // An old checkpoint would bring back a state that everybody has forgotten.
    if (row.checkpointBytes > 0 && !note(leaves, database_.removeCheckpoint(leaves))) return false;
    row.bytes -= row.checkpointBytes;
    row.checkpointBytes = 0;
    if (isLargest) return false;
  }
}

bool SavedState::diskHasRoom() {
  std::error_code problem;
  const std::filesystem::space_info space = std::filesystem::space(options_.directory, problem);
  const bool full = !problem && space.available < options_.minFreeBytes;
  if (full && !diskIsFull_)
    spdlog::warn(
        "states of scenes are not saved: {} has {:.0f} MB left, and {:.0f} MB stay free (--keep-free)",
        options_.directory.string(), static_cast<double>(space.available) / 1e6,
        static_cast<double>(options_.minFreeBytes) / 1e6);
  if (!full && diskIsFull_) spdlog::info("states of scenes are saved again");
  diskIsFull_ = full;
  return !full;
}

bool SavedState::note(const std::string& name, const Database::Done& done) {
  const std::lock_guard lock(mutex_);
  ++status_.writes;
  if (done) {
    if (!std::exchange(complains_, true)) spdlog::info("states of scenes are saved again");
    return true;
  }
  ++status_.failedWrites;
  if (std::exchange(complains_, false))
    telemetry::log({name}, spdlog::level::err, "its state cannot be saved in {}: {}; trying again",
                   database_.file().string(), done.error());
  return false;
}

}  // namespace clothstream::saved_state

// SPDX-License-Identifier: MIT
// Bounded queue of messages, and the thread that writes them to a file.
#include "server/recording/recorder.h"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <exception>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "proto/recording/file.h"
#include "server/messages/scene_message.h"
#include "server/recording/metadata.h"
#include "server/recording/tick_message.h"
#include "server/scene/snapshot_message.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::recording {
namespace {

using SteadyClock = std::chrono::steady_clock;

// Maximum time before a chunk is closed. If the program is killed, at most this time plus the time of writing
// is lost.
constexpr std::chrono::nanoseconds kChunkTime{McapWriter::kChunkNs};
constexpr int kMaxSameNames = 100;

// Creates a file with the next free name. Existing files are kept.
using Created = tl::expected<std::pair<OutputFile, std::string>, std::string>;

Created createNew(const std::filesystem::path& directory, const std::string& scene) {
  const std::string stem = fmt::format("{}-{:%Y%m%dT%H%M%SZ}", scene, fmt::gmtime(std::time(nullptr)));
  for (int i = 1;; ++i) {
    const std::string path =
        (directory / (i == 1 ? stem + ".mcap" : fmt::format("{}-{}.mcap", stem, i))).string();
    auto file = OutputFile::create(path);
    if (file) return std::pair(std::move(*file), path);
    std::error_code none;
    if (i == kMaxSameNames || !std::filesystem::exists(path, none)) return tl::unexpected(file.error());
  }
}

// The error does not name the directory, because it is sent to a client.
Created createNamed(const std::filesystem::path& directory, const std::string& name) {
  const std::string path = (directory / (name + ".mcap")).string();
  auto file = OutputFile::create(path);
  if (file) return std::pair(std::move(*file), path);
  std::error_code none;
  if (!std::filesystem::exists(path, none))
    return tl::unexpected(fmt::format("{}.mcap cannot be created on the server", name));
  return tl::unexpected(fmt::format("a recording {}.mcap already exists; choose another name", name));
}

}  // namespace

tl::expected<std::shared_ptr<Recorder>, std::string> Recorder::create(RecorderOptions options,
                                                                      const std::string& scene,
                                                                      const std::string& name) {
  if (options.disk)
    if (auto room = options.disk->check(); !room) {
      spdlog::warn("{}: not recorded: {}", scene, room.error());
      return tl::unexpected(std::move(room.error()));
    }
  Created created = name.empty() ? createNew(options.directory, scene) : createNamed(options.directory, name);
  if (!created) {
    telemetry::log({scene}, spdlog::level::warn, "not recorded: {}", created.error());
    return tl::unexpected(name.empty() ? std::string("no file can be created on the server")
                                       : created.error());
  }
  auto recorder = std::make_shared<Recorder>(std::move(options));
  recorder->file_ = std::make_unique<OutputFile>(std::move(created->first));
  recorder->path_ = std::move(created->second);
  return recorder;
}

Recorder::~Recorder() {
  finish();
}

Recorder::State Recorder::finish() {
  {
    const std::lock_guard lock(beginning_);
    end();
  }
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock(mutex_);
  if (std::exchange(file_, nullptr)) std::remove(path_.c_str());
  return state_;
}

std::string Recorder::path() const {
  const std::lock_guard lock(mutex_);
  return path_;
}

void Recorder::begin(const vulkan::DeviceInfo& device, const model::Scene& scene,
                     const v1::StreamDescription& description, const simulation::StateSnapshot& state,
                     const simulation::StateSnapshot& start) {
  const std::lock_guard lock(beginning_);
  if (ended_) return;
  state_ = State::running;
  try {
    put(Topic::description, description);
    v1::RecordedScene recorded;
    *recorded.mutable_scene() = messages::toMessage(scene);
    put(Topic::scene, recorded);
    saved(state);
    if (&start != &state) put(start, true);
    thread_ = std::thread(
        [this, name = scene.name, metadata = metadataOf(options_.serverName, device, scene, description)] {
          try {
            run(name, metadata);
          } catch (const std::exception& failure) {
            fail(failure.what());
          }
        });
  } catch (const std::exception& failure) {
    // For example, there is no thread. The recording would otherwise run forever.
    fail(failure.what());
  }
}

void Recorder::ticked(const scene::AppliedTick& tick) {
  if (!active()) return;
  scene::AppliedTick recordedTick = tick;
  recordedTick.clothsChanged |= std::exchange(describeCloths_, false);
  write(recordedTick, tick_);
  put(Topic::ticks, tick_);
}

void Recorder::saved(const simulation::StateSnapshot& state) {
  put(state, false);
  describeCloths_ = true;
}

void Recorder::put(const simulation::StateSnapshot& state, bool start) {
  v1::Checkpoint checkpoint;
  scene::write(state, checkpoint);
  checkpoint.set_start(start);
  put(Topic::checkpoints, checkpoint);
}

void Recorder::restored(std::uint64_t tick, const simulation::StateSnapshot& state) {
  v1::Checkpoint checkpoint;
  scene::write(state, checkpoint);
  checkpoint.set_tick(tick);
  checkpoint.set_restored(true);
  put(Topic::checkpoints, checkpoint);
}

void Recorder::end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
}

void Recorder::sent(const delivery::SharedBytes& message) {
  if (!active()) return;
  push(message, message->size());
}

void Recorder::joined(std::uint64_t participant, const std::string& clientName,
                      const std::string& displayName) {
  writeParticipant(participant, v1::PARTICIPANT_EVENT_KIND_JOINED, clientName, displayName);
}

void Recorder::left(std::uint64_t participant) {
  writeParticipant(participant, v1::PARTICIPANT_EVENT_KIND_LEFT, {}, {});
}

void Recorder::writeParticipant(std::uint64_t participant, v1::ParticipantEventKind kind,
                                const std::string& clientName, const std::string& displayName) {
  v1::ParticipantEvent event;
  event.set_participant_id(participant);
  event.set_kind(kind);
  event.set_client_name(clientName);
  event.set_display_name(displayName);
  put(Topic::participants, event);
}

void Recorder::put(Topic topic, const google::protobuf::MessageLite& message) {
  Own own{topic, message.SerializeAsString()};
  const std::size_t bytes = own.bytes.size();
  push(std::move(own), bytes);
}

void Recorder::push(std::variant<Own, delivery::SharedBytes> what, std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (ended_ || overflowed_ || state_ == State::failed) return;
    if (waitingBytes_ + bytes > options_.maxWaitingBytes) {
      overflowed_ = true;
    } else {
      waiting_.push_back({clock_.now(), std::move(what)});
      waitingBytes_ += bytes;
    }
  }
  changed_.notify_all();
}

void Recorder::run(const std::string& sceneName, const Metadata& metadata) {
  telemetry::nameThread("recorder");
  std::unique_ptr<OutputFile> file;
  {
    const std::lock_guard lock(mutex_);
    file = std::move(file_);
  }
  if (!file) {
    if (options_.disk)
      if (const auto room = options_.disk->check(); !room) return fail(room.error());
    Created created = createNew(options_.directory, sceneName);
    if (!created) return fail(created.error());
    file = std::make_unique<OutputFile>(std::move(created->first));
    const std::lock_guard lock(mutex_);
    path_ = created->second;
  }
  const std::string path = this->path();
  telemetry::log({sceneName}, spdlog::level::info, "recorded to {}", path);
  auto writer = RecordingWriter::begin([&](std::string_view bytes) { return file->write(bytes); },
                                       options_.serverName, metadata);
  if (!writer) return fail(writer.error());
  const auto written = writeAll(*writer);
  // Finishes the file also after an error that is not the disk's, so that it is complete.
  const auto finished = writer->finish().and_then([&] { return file->sync(); });
  bytes_ = writer->bytes();
  if (!finished)
    return fail(fmt::format("{}; read the rest of the recording after `clothstream recover {} OUT`",
                            finished.error(), path));
  if (!written) return fail(fmt::format("{}; {} ends there", written.error(), path));
  telemetry::log({sceneName}, spdlog::level::info, "the recording {} is complete, {:.1f} MiB", path,
                 static_cast<double>(writer->bytes()) / (1 << 20));
  state_ = State::complete;
}

Written Recorder::writeAll(RecordingWriter& writer) {
  std::vector<Waiting> taken;
  SteadyClock::time_point due = SteadyClock::time_point::max();  // time to close the chunk
  for (;;) {
    bool ends = false;
    {
      std::unique_lock lock(mutex_);
      const auto something = [&] { return !waiting_.empty() || ended_ || overflowed_; };
      if (due == SteadyClock::time_point::max())
        changed_.wait(lock, something);
      else
        changed_.wait_until(lock, due, something);
      taken.swap(waiting_);
      waitingBytes_ = 0;
      if (overflowed_)
        return tl::unexpected(fmt::format(
            "more than {} bytes are waiting to be written: the disk is too slow", options_.maxWaitingBytes));
      ends = ended_;
    }
    if (!taken.empty() && due == SteadyClock::time_point::max()) due = SteadyClock::now() + kChunkTime;
    for (const Waiting& waiting : taken) {
      Written written;
      if (const auto* own = std::get_if<Own>(&waiting.what)) {
        written = writer.write(own->topic, waiting.time, own->bytes);
      } else {
        const delivery::SharedBytes& bytes = std::get<delivery::SharedBytes>(waiting.what);
        v1::ServerMessage message;
        if (message.ParseFromArray(bytes->data(), static_cast<int>(bytes->size())))
          written = writer.write(waiting.time, message);
      }
      if (!written) return written;
    }
    taken.clear();
    if (ends) return {};
    if (SteadyClock::now() >= due) {
      if (options_.disk)
        if (auto room = options_.disk->check(); !room) return room;
      if (auto closed = writer.closeChunk(); !closed) return closed;
      due = SteadyClock::time_point::max();
    }
    bytes_ = writer.bytes();
  }
}

void Recorder::fail(std::string_view reason) {
  spdlog::error("a recording stopped; its scene continues: {}", reason);
  const std::lock_guard lock(mutex_);
  state_ = State::failed;
  waiting_.clear();
  waiting_.shrink_to_fit();
}

}  // namespace clothstream::recording

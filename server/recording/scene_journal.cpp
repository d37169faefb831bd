// SPDX-License-Identifier: MIT
// Starts, continues and stops the recordings of a scene.
#include "server/recording/scene_journal.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace clothstream::recording {
namespace {

constexpr std::size_t kMaxNameLength = 64;

bool isFileName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxNameLength && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

tl::unexpected<messages::FieldError> refused(v1::ErrorCode code, std::string text) {
  return tl::unexpected(messages::FieldError{code, std::move(text)});
}

std::string fileOf(const Recorder& recorder) {
  return std::filesystem::path(recorder.path()).filename().string();
}

void add(RecordingCounts& counts, const Recorder& recorder) {
  const Recorder::State state = recorder.state();
  counts.running += state == Recorder::State::running ? 1 : 0;
  counts.complete += state == Recorder::State::complete ? 1 : 0;
  counts.failed += state == Recorder::State::failed ? 1 : 0;
  counts.bytes += recorder.bytes();
}

}  // namespace

SceneJournal::SceneJournal(std::string scene, RecorderOptions options, bool always)
    : scene_(std::move(scene)), options_(std::move(options)), always_(always) {
  if (always_) current_ = std::make_shared<Recorder>(options_);
}

std::shared_ptr<Recorder> SceneJournal::current() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

RecordingCounts SceneJournal::counts() const {
  const std::lock_guard lock(mutex_);
  RecordingCounts counts = before_;
  for (const auto& recorder : finishing_) add(counts, *recorder);
  if (current_) add(counts, *current_);
  return counts;
}

void SceneJournal::replace(std::shared_ptr<Recorder> next, bool continues) {
  std::erase_if(finishing_, [&](const auto& recorder) {
    if (recorder->state() == Recorder::State::running) return false;
    add(before_, *recorder);
    return true;
  });
  if (current_) finishing_.push_back(std::move(current_));
  current_ = std::move(next);
  continues_ = continues;
  if (!current_) return;
  for (const auto& [participant, names] : participants_)
    current_->joined(participant, names.first, names.second);
}

messages::Result<void> SceneJournal::requireNoRecording() {
  if (current_ && current_->state() == Recorder::State::failed) replace(nullptr);
  if (!current_) return {};
  return refused(v1::ERROR_CODE_INVALID_ARGUMENT,
                 always_ ? fmt::format("startRecording: '{}' is recorded by the server all the time", scene_)
                         : fmt::format("startRecording: '{}' is already being recorded to {}", scene_,
                                       fileOf(*current_)));
}

messages::Result<std::string> SceneJournal::start(const std::string& name) {
  if (!name.empty() && !isFileName(name))
    return refused(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("startRecording.name = \"{:.80}\": must be 1 to {} characters out of [A-Za-z0-9_-]", name,
                    kMaxNameLength));
  {
    const std::lock_guard lock(mutex_);
    if (auto free = requireNoRecording(); !free) return tl::unexpected(std::move(free).error());
  }
  // The device thread takes the lock and must not wait for a disk, so the file is created without it. If
  // another request was faster, the file is deleted.
  auto recorder = Recorder::create(options_, scene_, name);
  if (!recorder)
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                                               "startRecording: " + recorder.error(),
                                               telemetry::Refusal::diskShare});
  const std::lock_guard lock(mutex_);
  if (auto free = requireNoRecording(); !free) return tl::unexpected(std::move(free).error());
  std::string file = fileOf(**recorder);
  replace(std::move(*recorder));
  return file;
}

messages::Result<v1::StopRecordingResponse> SceneJournal::stop() {
  std::shared_ptr<Recorder> recorder;
  {
    const std::lock_guard lock(mutex_);
    if (always_)
      return refused(v1::ERROR_CODE_INVALID_ARGUMENT,
                     fmt::format("stopRecording: '{}' is recorded by the server all the time", scene_));
    if (!current_)
      return refused(v1::ERROR_CODE_INVALID_ARGUMENT,
                     fmt::format("stopRecording: '{}' is not being recorded", scene_));
    recorder = current_;
    replace(nullptr);
  }
  const std::string file = fileOf(*recorder);
  switch (recorder->finish()) {
    case Recorder::State::waiting:
      return refused(
          v1::ERROR_CODE_INVALID_ARGUMENT,
          fmt::format("stopRecording: '{}' has not run since startRecording, so there is no recording",
                      scene_));
    case Recorder::State::failed:
      return refused(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                     fmt::format("stopRecording: {} is incomplete; the log of the server says why", file));
    default:
      break;
  }
  v1::StopRecordingResponse response;
  response.set_file(file);
  response.set_bytes(recorder->bytes());
  return response;
}

bool SceneJournal::due() const {
  const std::lock_guard lock(mutex_);
  return current_ && current_->due();
}

bool SceneJournal::active() const {
  const std::lock_guard lock(mutex_);
  return current_ && (current_->active() || (continues_ && current_->due()));
}

void SceneJournal::begin(const vulkan::DeviceInfo& device, const model::Scene& scene,
                         const v1::StreamDescription& description, const simulation::StateSnapshot& state,
                         const simulation::StateSnapshot& start) {
  if (const auto recorder = current()) recorder->begin(device, scene, description, state, start);
}

void SceneJournal::ticked(const scene::AppliedTick& tick) {
  const auto recorder = current();
  if (!recorder) return;
  recorder->ticked(tick);
  if (options_.maxBytes == 0 || !recorder->active() || recorder->bytes() < options_.maxBytes) return;
  // The next file starts with the next tick.
  const std::lock_guard lock(mutex_);
  if (current_ != recorder) return;
  recorder->end();
  replace(std::make_shared<Recorder>(options_), true);
}

void SceneJournal::saved(const simulation::StateSnapshot& state) {
  if (const auto recorder = current()) recorder->saved(state);
}

void SceneJournal::restored(std::uint64_t tick, const simulation::StateSnapshot& state) {
  if (const auto recorder = current()) recorder->restored(tick, state);
}

void SceneJournal::end() {
  const std::lock_guard lock(mutex_);
  if (!current_ || current_->due()) return;
  current_->end();
  replace(always_ ? std::make_shared<Recorder>(options_) : nullptr);
}

void SceneJournal::sent(const delivery::SharedBytes& message) {
  if (const auto recorder = current()) recorder->sent(message);
}

void SceneJournal::joined(std::uint64_t participant, const std::string& clientName,
                          const std::string& displayName) {
  const std::lock_guard lock(mutex_);
  participants_[participant] = {clientName, displayName};
  if (current_) current_->joined(participant, clientName, displayName);
}

void SceneJournal::left(std::uint64_t participant) {
  const std::lock_guard lock(mutex_);
  participants_.erase(participant);
  if (current_) current_->left(participant);
}

}  // namespace clothstream::recording

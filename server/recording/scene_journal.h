// SPDX-License-Identifier: MIT
// Journal of a scene over all of its recordings. At most one runs at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/recording/recorder.h"
#include "server/scene/journal.h"

namespace clothstream::recording {

// Numbers of recordings by state, and their total bytes.
struct RecordingCounts {
  std::uint64_t running = 0, complete = 0, failed = 0, bytes = 0;

  RecordingCounts& operator+=(const RecordingCounts& more) {
    running += more.running;
    complete += more.complete;
    failed += more.failed;
    bytes += more.bytes;
    return *this;
  }
};

// Thread-safe.
class SceneJournal : public scene::Journal {
 public:
  // `always` records the scene from its start, and clients cannot stop it.
  SceneJournal(std::string scene, RecorderOptions options, bool always);

  RecordingCounts counts() const;

  messages::Result<std::string> start(const std::string& name) override;
  messages::Result<v1::StopRecordingResponse> stop() override;
  bool due() const override;
  bool active() const override;
  void begin(const vulkan::DeviceInfo& device, const model::Scene& scene,
             const v1::StreamDescription& description, const simulation::StateSnapshot& state,
             const simulation::StateSnapshot& start) override;
  void ticked(const scene::AppliedTick& tick) override;
  void saved(const simulation::StateSnapshot& state) override;
  void restored(std::uint64_t tick, const simulation::StateSnapshot& state) override;
  void end() override;
  void sent(const delivery::SharedBytes& message) override;
  void joined(std::uint64_t participant, const std::string& clientName,
              const std::string& displayName) override;
  void left(std::uint64_t participant) override;

 private:
  std::shared_ptr<Recorder> current() const;
  // The caller must hold the lock for the following functions.
  // Drops a recording that failed, and refuses if one runs.
  [[nodiscard]] messages::Result<void> requireNoRecording();
  // `continues`: the recording continues in another file.
  void replace(std::shared_ptr<Recorder> next, bool continues = false);

  const std::string scene_;
  const RecorderOptions options_;
  const bool always_;

  mutable std::mutex mutex_;                          // protects the following members
  std::shared_ptr<Recorder> current_;                 // null if none runs
  bool continues_ = false;                            // current_ continues another recording
  std::vector<std::shared_ptr<Recorder>> finishing_;  // ended, but still being written
  RecordingCounts before_;                            // counts of deleted recorders
  std::map<std::uint64_t, std::pair<std::string, std::string>> participants_;  // client name and display name
};

}  // namespace clothstream::recording

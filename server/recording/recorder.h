// SPDX-License-Identifier: MIT
// Writes the journal of one scene to a file in a separate thread.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

#include "clothstream/v1/recording.pb.h"
#include "proto/recording/clock.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_writer.h"
#include "server/recording/disk_share.h"
#include "server/scene/journal.h"

namespace clothstream::recording {

struct RecorderOptions {
  std::filesystem::path directory;  // must exist
  std::string serverName;
  // File size after which the recording continues in another file; 0: never.
  std::uint64_t maxBytes = 0;
  // Checked before a file is created and while it is written; null: no limit.
  std::shared_ptr<DiskShare> disk = nullptr;
  // Maximum size of the queue. The recording ends if it overflows, because the scene does not wait for a
  // disk.
  std::size_t maxWaitingBytes = std::size_t{64} << 20;
};

// Journal of one recording. Thread-safe. Creates the file SCENE-TIME.mcap when the scene starts to run. An
// error ends the recording and is logged; it does not affect the scene.
class Recorder final : public scene::Journal {
 public:
  explicit Recorder(RecorderOptions options) : options_(std::move(options)) {}
  // Creates the file immediately, with this name if it is not empty. The error says why that is impossible,
  // for example because the file exists.
  [[nodiscard]] static tl::expected<std::shared_ptr<Recorder>, std::string> create(RecorderOptions options,
                                                                                   const std::string& scene,
                                                                                   const std::string& name);
  // Writes everything in the queue first.
  ~Recorder() override;

  enum class State : std::uint8_t { waiting, running, complete, failed };
  State state() const { return state_; }
  // Path of the file. Empty before the recording starts.
  std::string path() const;
  std::uint64_t bytes() const { return bytes_; }
  // Ends the recording and waits until it is written. A recording that never started is deleted with its
  // file. Only one thread may call it at a time.
  State finish();

  bool active() const override { return state_ == State::running && !ended_; }
  bool due() const override { return state_ == State::waiting && !ended_; }
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
  struct Own {
    Topic topic{};
    std::string bytes;
  };
  struct Waiting {
    std::uint64_t time = 0;
    std::variant<Own, delivery::SharedBytes> what;
  };

  void put(Topic topic, const google::protobuf::MessageLite& message);
  void push(std::variant<Own, delivery::SharedBytes> what, std::size_t bytes);
  void writeParticipant(std::uint64_t participant, v1::ParticipantEventKind kind,
                        const std::string& clientName, const std::string& displayName);
  // `start`: a reset returns to this state.
  void put(const simulation::StateSnapshot& state, bool start);
  void run(const std::string& sceneName, const Metadata& metadata);
  // Writes until the recording ends, or until an error, which it returns.
  [[nodiscard]] Written writeAll(RecordingWriter& writer);
  void fail(std::string_view reason);

  const RecorderOptions options_;
  const RecordingClock clock_;
  std::atomic<State> state_ = State::waiting;
  std::atomic<bool> ended_ = false;
  std::atomic<std::uint64_t> bytes_ = 0;

  std::mutex beginning_;      // prevents an end during begin()
  mutable std::mutex mutex_;  // protects the members down to overflowed_
  std::condition_variable changed_;
  std::string path_;
  std::unique_ptr<OutputFile> file_;  // created before the recording starts
  std::vector<Waiting> waiting_;
  std::size_t waitingBytes_ = 0;
  bool overflowed_ = false;

  v1::RecordedTick tick_;       // reused; device thread only
  bool describeCloths_ = true;  // write the cloths with the next tick; device thread only
  std::thread thread_;          // runs after begin()
};

}  // namespace clothstream::recording

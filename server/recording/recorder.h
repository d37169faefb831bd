// SPDX-License-Identifier: MIT
// The journal of one scene, written to a file by a thread of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "clothstream/v1/recording.pb.h"
#include "proto/recording/clock.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_writer.h"
#include "server/scene/journal.h"

namespace clothstream::recording {

struct RecorderOptions {
  std::filesystem::path directory;  // there must be one
  std::string serverName;
  // After which a recording goes on in another file, where grabs hold cloth up to an eighth later; 0: never.
  std::uint64_t maxBytes = 0;
  // Of what waits to be written. When it is more, the recording ends: the scene does not wait for a disk.
  std::size_t maxWaitingBytes = std::size_t{64} << 20;
};

// Thread-safe. Of one recording. Its file is SCENE-TIME.mcap, made when the scene begins to run. An error
// ends the recording, is logged, and leaves the scene alone.
class Recorder : public scene::Journal {
 public:
  explicit Recorder(RecorderOptions options) : options_(std::move(options)) {}
  // The file is made at once, under this name where it is not empty. The error says why it cannot be, such as
  // that there is one.
  [[nodiscard]] static tl::expected<std::shared_ptr<Recorder>, std::string> create(RecorderOptions options,
                                                                                   const std::string& scene,
                                                                                   const std::string& name);
  // Everything that was told is written first.
  ~Recorder() override;

  enum class State : std::uint8_t { waiting, running, complete, failed };
  State state() const { return state_; }
  // Empty before it runs.
  std::string path() const;
  std::uint64_t bytes() const { return bytes_; }
  // Ends it, and waits until it is written. One that never began is gone, with its file. Of one thread at a
  // time.
  State finish();

  bool active() const override { return state_ == State::running && !ended_; }
  bool due() const override { return state_ == State::waiting && !ended_; }
  void begin(const vulkan::DeviceInfo& device, const model::Scene& scene,
             const v1::StreamDescription& description, const simulation::StateSnapshot& state,
             const simulation::StateSnapshot& start) override;
  void ticked(const scene::AppliedTick& tick) override;
  void saved(const simulation::StateSnapshot& state, bool grabsHold) override;
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
  void tellParticipant(std::uint64_t participant, v1::ParticipantEventKind kind,
                       const std::string& clientName, const std::string& displayName);
  void put(const simulation::StateSnapshot& state, bool grabsHold, bool start);
  void run(const std::string& sceneName, const Facts& facts);
  // Until the end, or the error that it returns.
  [[nodiscard]] Written writeAll(RecordingWriter& writer);
  void fail(const std::string& reason);

  const RecorderOptions options_;
  const RecordingClock clock_;
  std::atomic<State> state_ = State::waiting;
  std::atomic<bool> ended_ = false;
  std::atomic<std::uint64_t> bytes_ = 0;

  std::mutex beginning_;      // so that it does not end meanwhile
  mutable std::mutex mutex_;  // of all down to overflowed_
  std::condition_variable changed_;
  std::string path_;
  std::unique_ptr<OutputFile> file_;  // that was made before it runs
  std::vector<Waiting> waiting_;
  std::size_t waitingBytes_ = 0;
  bool overflowed_ = false;

  v1::RecordedTick tick_;  // the device's thread's, used again
  bool tellsCloths_ =
      true;             // the same thread's: with the next tick, so that one can go on from the state before
  std::thread thread_;  // from begin() on
};

}  // namespace clothstream::recording

// SPDX-License-Identifier: MIT
// Simulates the ticks of a recording with their recorded inputs.
#include "server/recording/resimulate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_reader.h"
#include "proto/text/printable.h"
#include "server/messages/scene_message.h"
#include "server/recording/metadata.h"
#include "server/recording/tick_message.h"
#include "server/scene/snapshot_message.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/recorder.h"

namespace clothstream::recording {
namespace {

using Done = tl::expected<void, std::string>;

template <typename... Arguments>
tl::unexpected<std::string> broken(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  return tl::unexpected(fmt::format(text, std::forward<Arguments>(arguments)...));
}

template <typename MessageType>
Done parse(std::string_view bytes, const char* what, MessageType& message) {
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return broken("a {} in it cannot be read", what);
  return {};
}

// Repeats the device work of a SceneHost from its recording.
class Replay {
 public:
  // `layout`: of the recorded stream; an impossible one if it is not known.
  Replay(const ResimulateOptions& options, Resimulation& result, const codec::StreamLayout& layout)
      : options_(options), result_(result), frames_(layout) {}

  bool started() const { return simulation_ != nullptr; }
  Done take(const v1::RecordedScene& message);
  Done take(v1::Checkpoint& message);
  Done take(const v1::RecordedTick& message);
  // Frames show how far a state is off that differs.
  void takeFrame(std::string_view frame, double seconds);
  // Reports that a message cannot be read. The replay continues from the next state. States of releases
  // before 0.3 do not contain the nodes that grabs hold, so those with grabs are skipped.
  void lose(std::string reason);

 private:
  template <typename Record>
  void submit(const Record& record) {
    recorder_->begin();
    record();
    device_->wait(device_->submit(*recorder_));
  }
  void makeSimulation(const simulation::StateSnapshot& state);
  void compare(const v1::RecordedTick& message, const simulation::TickStatus& status);
  void showGiven(const simulation::StateSnapshot& state);

  const ResimulateOptions& options_;
  Resimulation& result_;
  v1::Scene definition_;
  model::Scene scene_;
  simulation::StateSnapshot start_;
  std::uint64_t tick_ = 0;
  std::uint32_t substeps_ = 0;  // of simulation_
  bool lost_ = false;           // waits for a state from which it can continue
  bool keeps_ = false;          // the device has a state for a rollback
  FrameDistance frames_;
  std::unique_ptr<vulkan::Device> device_;
  std::unique_ptr<vulkan::Recorder> recorder_;
  std::unique_ptr<simulation::ClothSimulation> simulation_;
};

void Replay::lose(std::string reason) {
  if (!lost_) result_.missing.push_back({.after = tick_, .until = {}, .reason = std::move(reason)});
  lost_ = true;
}

Done Replay::take(const v1::RecordedScene& message) {
  messages::Result<model::Scene> scene =
      messages::toScene(message.scene(), {}, {.nodes = options_.limits.vertices});
  if (!scene) return broken("its scene is invalid: {}", scene.error().text);
  definition_ = message.scene();
  scene_ = std::move(*scene);
  result_.maxError = double{scene_.stream.maxError};
  return {};
}

void Replay::takeFrame(std::string_view frame, double seconds) {
  frames_.take(frame, seconds);
  result_.faults = frames_.faults();
  result_.frames = frames_.frames();
  result_.largestOfFrames = frames_.largest();
}

Done Replay::take(v1::Checkpoint& message) {
  if (scene_.cloths.empty()) return broken("it has a state before its scene");
  const auto read = scene::toSnapshot(message, scene_.nodeCount());
  if (!read) return broken("its state after tick {} {}", message.tick(), read.error());
  const simulation::StateSnapshot& snapshot = *read;
  if (message.start()) {
    start_ = snapshot;
  } else if (!started()) {
    if (std::exchange(lost_, false)) result_.missing.back().until = message.tick();
    start_ = snapshot;
    tick_ = message.tick();
    device_ = std::make_unique<vulkan::Device>(options_.device(scene_.nodeCount()));
    recorder_ = std::make_unique<vulkan::Recorder>(*device_);
    result_.device = fmt::format("{} ({})", device_->info().name, device_->info().driver);
    makeSimulation(snapshot);
    keeps_ = tick_ == 0;
    showGiven(snapshot);
  } else if (lost_ && (!message.grips_hold() || message.has_held())) {
    lost_ = false;
    tick_ = message.tick();
    result_.missing.back().until = tick_;
    makeSimulation(snapshot);
    keeps_ = message.restored();
    showGiven(snapshot);
  } else if (lost_) {
    return {};
  } else if (message.restored()) {
    makeSimulation(snapshot);
  } else if (result_.firstDifferent) {
    submit([&] { simulation_->recordSaveState(*recorder_); });
    result_.differences.push_back(
        differenceOf(tick_, simulation::unpack(snapshot).positions,
                     simulation::unpack(simulation_->collectState(tick_)).positions));
  }
  return {};
}

void Replay::makeSimulation(const simulation::StateSnapshot& state) {
  // A new simulation starts from its first state, as in SceneHost.
  keeps_ = true;
  simulation_.reset();
  simulation_ = std::make_unique<simulation::ClothSimulation>(*device_, scene_);
  substeps_ = scene_.substeps;
  submit([&] {
    simulation_->recordRestoreState(*recorder_, state);
    simulation_->recordRestoreGrabs(*recorder_, state.held);
  });
}

Done Replay::take(const v1::RecordedTick& message) {
  if (lost_) return {};
  if (!started()) return broken("it has a tick before its first state");
  if (message.tick() != tick_ + 1) {
    lose(fmt::format("after tick {} comes tick {}", tick_, message.tick()));
    return {};
  }
  if (message.recovery() == v1::RECOVERY_ROLLBACK && !keeps_) {
    lose("it rolled back to a state that is not in the recording");
    return {};
  }
  if (message.surfaces_left_out() > 0) {
    lose(fmt::format("{} surfaces of a real room acted in tick {}, and recordings leave their shapes out",
                     message.surfaces_left_out(), message.tick()));
    return {};
  }
  keeps_ |= message.keeps_state();
  const auto inputs = toInputs(message, scene_);
  if (!inputs) return tl::unexpected(inputs.error());
  if (message.cloths_size() > 0) {
    auto cloths = toCloths(message, definition_);
    if (!cloths) return tl::unexpected(cloths.error());
    scene_.cloths = std::move(*cloths);
    simulation_->setCloths(scene_.cloths);
  }
  if (const std::uint32_t substeps = message.substeps() == 0 ? scene_.substeps : message.substeps();
      substeps != substeps_)
    simulation_->setSubsteps(substeps_ = substeps, scene_.cloths);
  submit([&] {
    if (message.recovery() == v1::RECOVERY_ROLLBACK) simulation_->recordRollback(*recorder_);
    if (message.recovery() == v1::RECOVERY_RESET) simulation_->recordRestoreState(*recorder_, start_);
    if (message.keeps_state()) simulation_->recordCheckpoint(*recorder_);
    simulation_->recordTick(*recorder_, *inputs);
  });
  ++tick_;
  compare(message, simulation_->status());
  return {};
}

void Replay::showGiven(const simulation::StateSnapshot& state) {
  if (!options_.states) return;
  options_.states(
      {.snapshot = state, .hash = simulation::statusOf(state).stateHash, .given = true, .scene = scene_});
}

void Replay::compare(const v1::RecordedTick& message, const simulation::TickStatus& status) {
  ++result_.ticks;
  // NaNs may have different bits.
  const bool bothUnhealthy = message.unhealthy() && !status.healthy;
  const bool same = bothUnhealthy || (!message.unhealthy() && status.stateHash == message.state_hash());
  const bool compares = !same || result_.firstDifferent;
  if (options_.states || compares) {
    submit([&] { simulation_->recordSaveState(*recorder_); });
    const simulation::StateSnapshot snapshot = simulation_->collectState(message.tick());
    if (compares) frames_.add(message.tick(), simulation::unpack(snapshot).positions);
    if (options_.states)
      options_.states({.snapshot = snapshot, .hash = status.stateHash, .same = same, .scene = scene_});
  }
  if (same) return;
  ++result_.different;
  if (result_.firstDifferent) return;
  result_.firstDifferent = message.tick();
  result_.hash = status.stateHash;
  result_.recordedHash = message.state_hash();
}

Done replay(RecordingReader& reader, const ResimulateOptions& options, Resimulation& result) {
  const auto description = readDescription(reader);
  reader.rewind();
  Replay replay(options, result, description ? layoutOf(*description) : codec::StreamLayout{});
  v1::RecordedTick tick;
  const auto length = static_cast<double>(reader.end() - reader.start());
  for (;;) {
    const auto message = reader.next();
    if (!message) {
      reader.passChunk();
      replay.lose(message.error());
      continue;
    }
    if (!*message) break;
    const std::string_view bytes = (*message)->bytes;
    Done done;
    if ((*message)->topic == Topic::scene) {
      v1::RecordedScene scene;
      done = parse(bytes, "scene", scene).and_then([&] { return replay.take(scene); });
    } else if ((*message)->topic == Topic::checkpoints) {
      v1::Checkpoint checkpoint;
      done = parse(bytes, "state", checkpoint).and_then([&] { return replay.take(checkpoint); });
    } else if ((*message)->topic == Topic::frames) {
      replay.takeFrame(bytes, static_cast<double>((*message)->time - reader.start()) * 1e-9);
    } else if ((*message)->topic == Topic::ticks) {
      done = parse(bytes, "tick", tick).and_then([&] { return replay.take(tick); });
      if (options.progress && length > 0)
        options.progress(static_cast<double>((*message)->time - reader.start()) / length);
      if (options.interrupted()) {
        result.interrupted = true;
        return done;
      }
    }
    if (!done) return done;
  }
  if (!replay.started() && !result.missing.empty()) return broken("{}", result.missing.front().reason);
  if (!replay.started())
    return broken("it holds no simulation; use a recording made by a server (clothstream-server --record)");
  return {};
}

}  // namespace

tl::expected<Resimulation, std::string> resimulate(const ResimulateOptions& options) {
  auto reader = RecordingReader::open(options.path, CutFiles::refused, options.limits);
  if (!reader) return tl::unexpected(reader.error());
  Resimulation result;
  result.scene = reader->metadata("scene");
  result.kernels = compareKernels(reader->metadata(kKernelsEntry), shaderHash());
  result.recordedOn = fmt::format("{} ({})", reader->metadata("device"), reader->metadata("driver"));
  if (Done done = replay(*reader, options, result); !done)
    return broken("{} cannot be simulated again: {}", options.path, done.error());
  return result;
}

std::string toText(const Resimulation& result) {
  const std::string ticks =
      fmt::format("{} ticks{}", result.ticks, result.interrupted ? " before it was interrupted" : "");
  std::string text =
      fmt::format("scene     {}\nrecorded  {}\nagain     {}\nkernels   {}\n", printable(result.scene),
                  printable(result.recordedOn), printable(result.device), nameOf(result.kernels));
  for (const Difference& difference : result.differences)
    text += fmt::format("tick {}: nodes differ by at most {:.3g} m, on average by {:.3g} m\n",
                        difference.tick, difference.largest, difference.mean);
  for (const Missing& missing : result.missing)
    text += fmt::format("ticks after {} are missing{}: {}\n", missing.after,
                        missing.until ? fmt::format(" until tick {}", *missing.until) : " to the end",
                        printable(missing.reason));
  if (result.faults.any()) text += fmt::format("{}\n", result.faults.text());
  const char* all = result.missing.empty() ? "all" : "all available ticks";
  if (!result.firstDifferent) return text + fmt::format("{}, {} bit-identical\n", ticks, all);
  if (result.frames > 0)
    text += fmt::format(
        "{} frames show other positions: nodes are at most {:.3g} m from them (tick {}), of which {:.3g} m "
        "may be "
        "the codec's\n",
        result.frames, result.largestOfFrames.largest, result.largestOfFrames.tick,
        std::sqrt(3.0) * result.maxError);
  else if (result.differences.empty())
    text += "no state was recorded after the first difference, so its size is unknown\n";
  return text +
         fmt::format(
             "{} of {} differ, first tick {}: the hash of its state is {:016x}, recorded was {:016x}\n",
             result.different, ticks, *result.firstDifferent, result.hash, result.recordedHash);
}

std::string toJson(const Resimulation& result) {
  using Json = nlohmann::ordered_json;
  const auto hex = [](std::uint64_t hash) { return fmt::format("{:016x}", hash); };
  const auto jsonOf = [](const Difference& difference) {
    return Json{{"tick", difference.tick}, {"largest", difference.largest}, {"mean", difference.mean}};
  };
  Json json{{"verdict", nameOf(result.verdict())},
            {"exitCode", static_cast<int>(result.verdict())},
            {"interrupted", result.interrupted},
            {"scene", result.scene},
            {"kernels", nameOf(result.kernels)},
            {"recordedOn", result.recordedOn},
            {"device", result.device},
            {"ticks", result.ticks},
            {"different", result.different},
            {"firstDifferent", nullptr},
            {"missing", Json::array()},
            {"states", Json::array()},
            {"frames", {{"compared", result.frames}, {"maxError", result.maxError}, {"largest", nullptr}}}};
  if (result.firstDifferent)
    json["firstDifferent"] = {{"tick", *result.firstDifferent},
                              {"hash", hex(result.hash)},
                              {"recordedHash", hex(result.recordedHash)}};
  for (const Missing& missing : result.missing) {
    Json& part = json["missing"].emplace_back(Json{{"after", missing.after}, {"until", nullptr}});
    if (missing.until) part["until"] = *missing.until;
    part["reason"] = missing.reason;
  }
  for (const Difference& difference : result.differences) json["states"].push_back(jsonOf(difference));
  json["frames"]["undecodable"] = result.faults.undecodable();
  json["frames"]["hashMismatches"] = result.faults.different();
  json["frames"]["firstFaultTick"] =
      result.faults.firstTick() ? Json(*result.faults.firstTick()) : Json(nullptr);
  if (result.frames > 0) json["frames"]["largest"] = jsonOf(result.largestOfFrames);
  // Names of devices and files may not be UTF-8.
  return printableJson(json.dump(1, ' ', false, Json::error_handler_t::replace)) + '\n';
}

}  // namespace clothstream::recording

// SPDX-License-Identifier: MIT
#include "tests/soak/soak.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "clients/grpc/scene_control.h"
#include "clients/grpc/scene_list.h"
#include "clients/load/hostile_client.h"
#include "clients/load/participant.h"
#include "tests/attack/measured_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::soak {
namespace {

using namespace std::chrono_literals;
using load::Clock;
using load::Participant;
using load::ParticipantOptions;

constexpr std::uint32_t kScenes = 8;
constexpr double kFramesPerSecond = 36;
constexpr auto kStep = 28ms;  // between two poses of a participant
// Time for scenes to load, with the address sanitizer too, and for a server to return to rest.
constexpr auto kPatience = 120s;
// The server drains for 10 s at most (--drain), and then saves and ends.
constexpr auto kEndPatience = 30s;
// Frames count from this time after a participant has joined.
constexpr auto kSettled = 2s;
// Threads and descriptors that gRPC keeps more or fewer of from one moment to the next.
constexpr std::uint64_t kTolerated = 4;

double seconds(Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

std::string sceneName(std::uint32_t index) {
  return fmt::format("soak-{}", index % kScenes);
}

// Files of scenes that a small machine simulates together; each second one has constraints.
std::vector<std::string> writeScenes(const std::filesystem::path& directory) {
  std::vector<std::string> arguments{"--scene", sceneName(0)};
  for (std::uint32_t i = 0; i < kScenes; ++i) {
    const std::string path = (directory / (sceneName(i) + ".json")).string();
    std::ofstream(path) << fmt::format(
        R"({{"name": "{}", "simulationRate": {}, "streamRate": {}, "substeps": 6, "environment": {{"wind": {{"z": 2}}}},
 "cloths": [{{"name": "sheet", "grid": {{"rows": 14, "columns": 12, "width": 0.6, "height": 0.7}}, "mass": 0.2,
  "structural": {{"stiffness": 10, "damping": 0.01}}, "shear": {{"stiffness": 2, "damping": 0.002}},
  "bend": {{"stiffness": 1, "damping": 0.001}}, "damping": 0.5, "drag": 0.5,
  {} "pins": [{{"firstRow": 0, "firstColumn": 0, "lastColumn": 11}}]}}],
 "colliders": [{{"name": "ball", "sphere": {{"radius": 0.1}}, "pose": {{"position": {{"y": -0.4, "z": 0.2}}}}}}]}})",
        sceneName(i), kFramesPerSecond, kFramesPerSecond,
        i % 2 == 0 ? "" : R"("solver": {"constraint": {"iterations": 10}},)");
    arguments.insert(arguments.end(), {"--scene-file", path});
  }
  return arguments;
}

// A small scene that participants create.
v1::Scene createdScene() {
  v1::Scene scene;
  scene.set_name("created");
  scene.set_simulation_rate(30);
  scene.set_stream_rate(30);
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_grid()->set_rows(8);
  cloth.mutable_grid()->set_columns(8);
  cloth.mutable_grid()->set_width(1);
  cloth.mutable_grid()->set_height(1);
  cloth.set_mass(0.2f);
  return scene;
}

// A place that one participant after another takes.
struct Seat {
  enum class Kind : std::uint8_t { viewer, mover, vanishing, slow };

  std::uint32_t number = 0;
  Kind kind = Kind::viewer;
  std::unique_ptr<Participant> participant = {};
  std::optional<Clock::time_point> joined = {};
  Clock::time_point until{};  // leaves, or the next one comes

  bool isHonest() const { return kind == Kind::viewer || kind == Kind::mover; }
};

// Half of the places have viewers; one of eight is of each other kind, movers two.
Seat::Kind kindOf(std::uint32_t number) {
  constexpr std::array kinds{Seat::Kind::viewer, Seat::Kind::mover, Seat::Kind::viewer, Seat::Kind::vanishing,
                             Seat::Kind::viewer, Seat::Kind::mover, Seat::Kind::viewer, Seat::Kind::slow};
  // Each scene has every kind, on both endpoints.
  return kinds[(number + number / kScenes) % kinds.size()];
}

class Soak {
 public:
  explicit Soak(const SoakOptions& options)
      : options_(options),
        server_(options.server, arguments()),
        links_{load::makeGrpcLinks(server_.grpc()), load::makeWebLinks(server_.web())} {}

  SoakReport run() {
    visitEveryScene();
    report_.before = restingServer(std::nullopt);
    use();
    seats_.clear();
    leaving_.clear();
    for (const auto& client : hostileClients_) report_.hostileVisits += client->visits();
    hostileClients_.clear();
    report_.crashed = !server_.runs();
    if (!report_.crashed) report_.after = restingServer(report_.before);
    const std::optional<double> end = server_.end(kEndPatience);
    report_.crashed |= !end;
    report_.endSeconds = end.value_or(0);
    return std::move(report_);
  }

 private:
  struct Leaving {
    std::unique_ptr<Participant> participant;
    Clock::time_point until;
  };

  std::vector<std::string> arguments() {
    if (!options_.layers.empty()) {
      ::setenv("VK_ADD_LAYER_PATH", options_.layers.c_str(), 1);
      ::setenv("VK_INSTANCE_LAYERS", "VK_LAYER_CLOTHSTREAM_lost_device", 1);
      ::setenv("CLOTHSTREAM_LOSE_DEVICE", lossFile().c_str(), 1);
    }
    std::filesystem::create_directory(directory_.path() / "recordings");
    std::vector<std::string> all = writeScenes(directory_.path());
    // The recordings reach their share of the disk, places and created scenes expire soon.
    all.insert(all.end(),
               {"--recordings", (directory_.path() / "recordings").string(), "--recordings-limit", "4",
                "--keep-free", "0", "--hold", "3", "--scene-lifetime", "3", "--state-dir",
                (directory_.path() / "state").string(), "--log-level", "warning", "--log-format", "json"});
    return all;
  }
  std::filesystem::path lossFile() const { return directory_.path() / "lose"; }

  double between(double least, double most) { return std::uniform_real_distribution(least, most)(random_); }
  Clock::time_point in(double time) {
    return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time));
  }

  std::unique_ptr<Participant> participantOf(const Seat& seat) {
    const bool slow = seat.kind == Seat::Kind::slow;
    return std::make_unique<Participant>(
        *links_[seat.number / kScenes % links_.size()],
        ParticipantOptions{.scene = sceneName(seat.number),
                           .name = fmt::format("soak {}", ++report_.visits),
                           .token = {},
                           .decodes = seat.number % 16 == 0,
                           .moves = seat.kind == Seat::Kind::mover || seat.kind == Seat::Kind::vanishing,
                           .phase = 0.1 * seat.number,
                           .bytesPerSecond = slow ? 2'000.0 : 0.0});
  }

  // Joins every scene on both endpoints, so that everything that is made once has been made.
  void visitEveryScene() {
    std::vector<std::unique_ptr<Participant>> visitors;
    for (std::uint32_t number = 0; number < 2 * kScenes; ++number)
      visitors.push_back(participantOf({.number = number}));
    const auto end = Clock::now() + kPatience;
    std::vector<std::uint64_t> frames(visitors.size());
    while (std::ranges::any_of(frames, [](std::uint64_t count) { return count < 10; })) {
      if (Clock::now() > end) throw std::runtime_error("the scenes do not send frames");
      std::this_thread::sleep_for(kStep);
      for (std::size_t i = 0; i < visitors.size(); ++i) {
        visitors[i]->step(Clock::now());
        frames[i] += visitors[i]->take().frames;
        if (const auto why = visitors[i]->ended()) throw std::runtime_error(why->text);
      }
    }
  }

  // Measures the server without participants, when it has returned to `before` or kPatience is over. Without
  // `before`, when it has stayed the same for five seconds.
  Sample restingServer(const std::optional<Sample>& before) {
    // Threads and descriptors for calls, such as those of measure(), come and go.
    const auto isMore = [](const Sample& now, const Sample& then) {
      return now.descriptors > then.descriptors + kTolerated || now.threads > then.threads + kTolerated ||
             now.scenes != then.scenes || now.participants > 0;
    };
    const auto end = Clock::now() + kPatience;
    Sample newest = measure(), steady = newest;
    for (auto since = Clock::now(); Clock::now() < end;) {
      std::this_thread::sleep_for(100ms);
      newest = measure();
      if (isMore(newest, steady) || isMore(steady, newest)) {
        steady = newest;
        since = Clock::now();
      }
      if (before ? !isMore(newest, *before) : Clock::now() - since > 5s) break;
    }
    return newest;
  }

  Sample measure() {
    Sample sample{.seconds = seconds(Clock::now() - start_),
                  .megabytes = server_.megabytes(),
                  .descriptors = server_.descriptors(),
                  .threads = server_.threads()};
    if (const auto scenes = listScenes(server_.grpc())) {
      sample.scenes = scenes->size();
      for (const SceneSummary& scene : *scenes) sample.participants += scene.participants;
    }
    return sample;
  }

  void use() {
    start_ = Clock::now();
    const auto end = in(options_.seconds);
    for (std::uint32_t number = 0; number < options_.participants; ++number)
      seats_.push_back({.number = number, .kind = kindOf(number), .until = in(between(0, 2))});
    for (std::uint32_t i = 0; i < options_.hostileClients; ++i)
      hostileClients_.push_back(
          std::make_unique<load::HostileClient>(*links_[i % links_.size()], sceneName(i), i));
    std::ofstream csv;
    if (!options_.csv.empty()) {
      csv.open(options_.csv);
      if (!csv) throw std::runtime_error("cannot write " + options_.csv.string());
      csv << "seconds,megabytes,descriptors,threads,scenes,participants,expected,received,after_loss\n";
    }
    const std::jthread operations([this](const std::stop_token& stop) { operate(stop); });
    // The first loss comes early, so that a short run has one.
    auto nextLoss = in(std::min(options_.lossSeconds, options_.seconds / 3));
    auto nextSample = Clock::now() + 1s;
    while (Clock::now() < end && server_.runs()) {
      std::this_thread::sleep_for(kStep);
      const auto now = Clock::now();
      for (Seat& seat : seats_) step(seat, now);
      for (const auto& client : hostileClients_) client->step(now);
      std::erase_if(leaving_,
                    [&](const Leaving& one) { return one.participant->ended() || now >= one.until; });
      if (!options_.layers.empty() && now >= nextLoss) {
        loseDevice();
        nextLoss = now + std::chrono::duration_cast<Clock::duration>(
                             std::chrono::duration<double>(options_.lossSeconds));
      }
      if (now < nextSample) continue;
      take(now);
      nextSample = now + 1s;
      const Sample& s = report_.samples.back();
      csv << fmt::format("{:.1f},{:.1f},{},{},{},{},{:.0f},{:.0f},{}\n", s.seconds, s.megabytes,
                         s.descriptors, s.threads, s.scenes, s.participants, s.expected, s.received,
                         s.afterLoss ? 1 : 0)
          << std::flush;
    }
  }

  void step(Seat& seat, Clock::time_point now) {
    if (!seat.participant) {
      if (now < seat.until) return;
      seat.participant = participantOf(seat);
      seat.joined.reset();
      seat.until = seat.kind == Seat::Kind::vanishing ? in(between(1, 5)) : in(between(10, 60));
      return;
    }
    seat.participant->step(now);
    if (!seat.joined && seat.participant->joined()) seat.joined = now;
    const std::optional<Failure> why = seat.participant->ended();
    if (!why && now < seat.until) return;
    if (why && seat.isHonest() && report_.cutOff++ == 0) report_.firstReason = why->text;
    // A vanishing participant disconnects without a goodbye.
    if (!why && seat.kind != Seat::Kind::vanishing) {
      seat.participant->leave();
      leaving_.push_back({std::move(seat.participant), now + 2s});
    }
    seat.participant.reset();
    seat.until = in(between(0.2, 2));
  }

  // Adds a sample with the frames since the last one.
  void take(Clock::time_point now) {
    const double time = seconds(now - sampled_.value_or(start_));
    Sample sample = measure();
    for (Seat& seat : seats_) {
      if (!seat.participant) continue;
      const std::uint64_t frames = seat.participant->take().frames;
      if (!seat.isHonest() || !seat.joined || now - *seat.joined < kSettled + 1s) continue;
      sample.expected += kFramesPerSecond * time;
      sample.received += static_cast<double>(frames);
    }
    sample.afterLoss = lost_ && seconds(now - *lost_) < SoakReport::kLossWindow;
    sampled_ = now;
    report_.samples.push_back(sample);
  }

  // The rename makes the file complete when it appears.
  void loseDevice() {
    std::ofstream(lossFile().string() + ".draft") << "lost";
    std::filesystem::rename(lossFile().string() + ".draft", lossFile());
    ++report_.losses;
    lost_ = Clock::now();
  }

  // Creates, deletes and controls scenes, and records. A server that is busy refuses; that is part of the
  // use.
  void operate(const std::stop_token& stop) {
    std::mt19937 random(2);
    const auto pick = [&](std::uint32_t count) { return static_cast<std::uint32_t>(random() % count); };
    for (std::uint32_t round = 0; !stop.stop_requested(); ++round) {
      std::this_thread::sleep_for(400ms);
      const std::string scene = sceneName(pick(kScenes));
      switch (pick(5)) {
        case 0: {
          const std::string name = fmt::format("created-{}", round);
          const auto created = createScene(
              server_.grpc(), {.named = {}, .scene = createdScene(), .name = name, .progress = {}});
          if (!created) {
            if (report_.refusedScenes++ == 0) report_.firstRefusal = created.error().text;
            break;
          }
          ++report_.createdScenes;
          // Half of them expire.
          if (pick(2) == 0) static_cast<void>(deleteScene(server_.grpc(), name));
          break;
        }
        case 1:
          static_cast<void>(controlScene(server_.grpc(), scene, std::nullopt, true));
          break;
        case 2:
          if (startRecording(server_.grpc(), scene, "")) ++report_.recordings;
          break;
        case 3:
          static_cast<void>(stopRecording(server_.grpc(), scene));
          break;
        default:
          static_cast<void>(controlScene(server_.grpc(), "no such scene", true, false));
      }
    }
    for (std::uint32_t i = 0; i < kScenes; ++i)
      static_cast<void>(stopRecording(server_.grpc(), sceneName(i)));
  }

  const SoakOptions options_;
  const e2e::TemporaryDirectory directory_;
  attack::MeasuredServer server_;
  std::array<std::unique_ptr<load::Links>, 2> links_;
  std::mt19937 random_{1};
  SoakReport report_;
  std::vector<Seat> seats_;
  std::vector<Leaving> leaving_;
  std::vector<std::unique_ptr<load::HostileClient>> hostileClients_;
  Clock::time_point start_ = Clock::now();
  std::optional<Clock::time_point> sampled_, lost_;
};

}  // namespace

double SoakReport::share(bool healthy) const {
  double expected = 0, received = 0;
  for (const Sample& sample : samples) {
    if (healthy && sample.afterLoss) continue;
    expected += sample.expected;
    received += sample.received;
  }
  return expected > 0 ? received / expected : 0;
}

double SoakReport::drift() const {
  const std::size_t warm = samples.size() / 4, part = (samples.size() - warm) / 5;
  if (samples.size() < kLeastSamples) return 0;
  const auto mean = [&](std::size_t from) {
    double sum = 0;
    for (std::size_t i = 0; i < part; ++i) sum += samples[from + i].megabytes;
    return sum / static_cast<double>(part);
  };
  return mean(samples.size() - part) / mean(warm) - 1;
}

double SoakReport::growth(std::uint64_t Sample::*count) const {
  const std::size_t part = samples.size() / 5;
  if (samples.size() < kLeastSamples) return 0;
  const auto mean = [&](std::size_t from) {
    double sum = 0;
    for (std::size_t i = 0; i < part; ++i) sum += static_cast<double>(samples[from + i].*count);
    return sum / static_cast<double>(part);
  };
  return mean(samples.size() - part) - mean(2 * part);
}

bool SoakReport::leaks() const {
  return after.descriptors > before.descriptors + kTolerated || after.threads > before.threads + kTolerated ||
         after.scenes != before.scenes || after.participants > 0;
}

SoakReport runSoak(const SoakOptions& options) {
  return Soak(options).run();
}

std::string toText(const SoakReport& report) {
  std::string text = fmt::format("{:<28}{:>10}{:>10}{:>10}\n", "", "before", "most", "after");
  const auto row = [&](const char* name, auto member, const char* form) {
    const auto most = std::ranges::max(report.samples, {}, member).*member;
    text += fmt::format("{:<28}", name);
    for (const auto value : {report.before.*member, most, report.after.*member})
      text += fmt::format(fmt::runtime(form), static_cast<double>(value));
    text += '\n';
  };
  if (!report.samples.empty()) {
    row("resident memory, MB", &Sample::megabytes, "{:>10.1f}");
    row("descriptors", &Sample::descriptors, "{:>10.0f}");
    row("threads", &Sample::threads, "{:>10.0f}");
    row("scenes", &Sample::scenes, "{:>10.0f}");
    row("connected participants", &Sample::participants, "{:>10.0f}");
  }
  text += fmt::format(
      "drift of memory after warm-up {:>7.2f} %\n"
      "growth from middle to end     {:>7.2f} descriptors, {:.2f} threads\n"
      "frames of honest viewers      {:>7.2f} %, {:.2f} % without {:.0f} s after each loss of the device\n"
      "visits {}, of hostile clients {}, created scenes {}, recordings {}, losses of the device {}\n"
      "honest viewers cut off {}{}\n"
      "scenes refused {}{}\n",
      100 * report.drift(), report.growth(&Sample::descriptors), report.growth(&Sample::threads),
      100 * report.share(false), 100 * report.share(true), SoakReport::kLossWindow, report.visits,
      report.hostileVisits, report.createdScenes, report.recordings, report.losses, report.cutOff,
      report.cutOff > 0 ? ": " + report.firstReason : "", report.refusedScenes,
      report.refusedScenes > 0 ? ": " + report.firstRefusal : "");
  text += report.crashed ? "the server ended unexpectedly\n"
                         : fmt::format("the server ended within {:.1f} s of SIGTERM\n", report.endSeconds);
  return text;
}

}  // namespace clothstream::soak

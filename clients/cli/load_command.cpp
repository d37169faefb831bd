// SPDX-License-Identifier: MIT
// Options, progress line and report of a load test.
#include "clients/cli/load_command.h"

#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "clients/cli/recording_limits.h"
#include "clients/cli/report.h"
#include "clients/cli/signals.h"
#include "clients/cli/transport_option.h"
#include "clients/files/new_file.h"
#include "clients/load/hung_scene.h"
#include "clients/native/address.h"

namespace clothstream::cli {
namespace {

// CPU time of a process so far, from /proc. Nothing if there is no such process.
std::optional<double> cpuSeconds(std::uint32_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string text;
  if (!std::getline(file, text)) return std::nullopt;
  // Skips the process name in brackets, which may contain anything.
  std::istringstream rest(text.substr(text.rfind(')') + 1));
  std::string skipped;
  for (int i = 0; i < 11; ++i) rest >> skipped;
  double user = 0, system = 0;
  if (!(rest >> user >> system)) return std::nullopt;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

struct Ages {
  double p50, p99;
};
Ages agesOf(std::vector<float>& samples) {
  return {load::percentile(samples, 50), load::percentile(samples, 99)};
}

struct Stage {
  const char* key;
  std::vector<float> load::PoseTimes::*samples;
};
constexpr Stage kStages[]{{"poseToDisplayable", &load::PoseTimes::whole},
                          {"poseToTick", &load::PoseTimes::toTick},
                          {"tickToPacket", &load::PoseTimes::tickToPacket},
                          {"packetToDecoded", &load::PoseTimes::packetToDecoded},
                          {"decodedToDisplayable", &load::PoseTimes::decodedToDisplayable}};

// Adds the times of poses; null without poses.
void addPoses(nlohmann::ordered_json& object, load::PoseTimes& poses) {
  const bool some = !poses.whole.empty();
  object["poses"] = poses.whole.size();
  for (const Stage& stage : kStages) {
    std::vector<float>& samples = poses.*stage.samples;
    const Ages ages = agesOf(samples);
    const auto set = [&](const char* what, double ms) {
      nlohmann::ordered_json& value = object[fmt::format("{}Ms{}", stage.key, what)];
      if (some) value = ms;
    };
    set("P50", ages.p50);
    set("P99", ages.p99);
    set("Mean", load::mean(samples));
  }
}

// Adds the percentiles of times, which are null without samples.
void addTimes(nlohmann::ordered_json& object, const std::string& name, std::vector<float>& samplesMs) {
  const auto set = [&](const char* what, nlohmann::ordered_json value) {
    object[name + what] = std::move(value);
  };
  if (samplesMs.empty()) {
    set("MsP50", nullptr);
    set("MsP99", nullptr);
    return;
  }
  const Ages times = agesOf(samplesMs);
  set("MsP50", times.p50);
  set("MsP99", times.p99);
}

// Adds figures by participant, and those of created scenes, which are null without them.
void addScenes(nlohmann::ordered_json& object, load::LoadReport& report) {
  load::SceneReport& scenes = report.scenes;
  object["slowestFramesPerSecond"] = load::percentile(report.participantRates, 0);
  object["medianFramesPerSecond"] = load::percentile(report.participantRates, 50);
  object["lateFrames"] = report.figures.late;
  object["scenes"] = scenes.wanted;
  object["scenesCreated"] = scenes.created;
  object["scenesNotDeleted"] = scenes.remaining;
  addTimes(object, "firstFrame", scenes.firstFrameMs);
  addTimes(object, "joinToFrame", report.joinToFrameMs);
  addTimes(object, "joinToDatagramFrame", report.joinToDatagramFrameMs);
}

std::string json(load::LoadReport& report, std::optional<double> serverCpu) {
  const Ages ages = agesOf(report.figures.ages), tickAges = agesOf(report.figures.tickAges);
  nlohmann::ordered_json object{
      {"participants", report.participants},
      {"seconds", report.seconds},
      {"framesPerSecond", report.framesPerSecond()},
      {"frameAgeMsP50", ages.p50},
      {"frameAgeMsP99", ages.p99},
      {"tickAgeMsP50", tickAges.p50},
      {"tickAgeMsP99", tickAges.p99},
      {"dropped", report.figures.dropped},
      {"decodeErrors", report.figures.decodeErrors + report.slowFigures.decodeErrors},
      {"hashMismatches", report.figures.hashMismatches + report.slowFigures.hashMismatches},
      {"mbitPerSecond", report.mbitPerSecond()},
      {"serverCpuSeconds", nullptr},
      {"joined", report.joined},
      {"left", report.left},
      {"lost", report.lost},
      {"slow", report.slow},
      {"slowFramesPerSecond", report.slowFramesPerSecond()},
      {"slowDropped", report.slowFigures.dropped},
      {"intruders", report.hostileClients},
      {"intrusions", report.visits},
      {"withDatagrams", report.withDatagrams},
      {"datagrams", jsonOf(report.datagrams)},
  };
  if (serverCpu) object["serverCpuSeconds"] = *serverCpu;
  addPoses(object, report.figures.poses);
  addScenes(object, report);
  return jsonText(object, 2);
}

// One line of JSON for each frame.
std::string frameLines(const load::LoadReport& report) {
  std::string lines;
  for (const load::FrameTime& frame : report.figures.frameTimes)
    fmt::format_to(std::back_inserter(lines),
                   R"({{"seconds":{:.4f},"participant":{},"tick":{},"ageMs":{:.2f},"displayableMs":{}}})"
                   "\n",
                   std::chrono::duration<double>(frame.arrived - report.start).count(), frame.participant,
                   frame.tick, frame.age,
                   frame.displayableAge ? fmt::format("{:.2f}", *frame.displayableAge) : "null");
  return lines;
}

std::string text(load::LoadReport& report, std::optional<double> serverCpu) {
  const Ages ages = agesOf(report.figures.ages), tickAges = agesOf(report.figures.tickAges);
  std::string text = fmt::format(
      "{} participants for {:.1f} s: {:.1f} frames/s each, {:.1f} Mbit/s in total, {} dropped, {} refused\n"
      "age of a frame on arrival: {:.2f} ms median, {:.2f} ms p99; since its tick began: {:.2f} and {:.2f} "
      "ms",
      report.participants, report.seconds, report.framesPerSecond(), report.mbitPerSecond(),
      report.figures.dropped, report.figures.decodeErrors + report.slowFigures.decodeErrors, ages.p50,
      ages.p99, tickAges.p50, tickAges.p99);
  if (!report.figures.poses.whole.empty()) {
    const auto of = [&](const Stage& stage) {
      const Ages times = agesOf(report.figures.poses.*stage.samples);
      return fmt::format("{:.2f} / {:.2f}", times.p50, times.p99);
    };
    text += fmt::format(
        "\nfrom a pose to its effect first displayable, ms median / p99: {}; by stage: to the tick {}, to "
        "the "
        "packet {}, to decoded {}, in play-out {}",
        of(kStages[0]), of(kStages[1]), of(kStages[2]), of(kStages[3]), of(kStages[4]));
  }
  if (report.scenes.created > 0) {
    const Ages times = agesOf(report.scenes.firstFrameMs);
    text += fmt::format(
        "\n{} scenes, from CreateScene to the first frame: {:.1f} ms median, {:.1f} ms p99"
        "\nslowest participant {:.1f} frames/s, median {:.1f}; {} frames late",
        report.scenes.created, times.p50, times.p99, load::percentile(report.participantRates, 0),
        load::percentile(report.participantRates, 50), report.figures.late);
  }
  if (report.slow > 0)
    text += fmt::format("\n{} slow: {:.1f} frames/s each, {} dropped", report.slow,
                        report.slowFramesPerSecond(), report.slowFigures.dropped);
  if (report.withDatagrams > 0)
    text += fmt::format("\n{} with datagrams: {}", report.withDatagrams, cli::text(report.datagrams));
  if (report.left > 0) text += fmt::format("\n{} left and were replaced", report.left);
  if (report.hostileClients > 0)
    text += fmt::format("\n{} hostile clients connected {} times", report.hostileClients, report.visits);
  if (serverCpu)
    text += fmt::format("\n{:.2f} s of CPU time of the server, {:.3f} ms per second and participant",
                        *serverCpu, 1000 * *serverCpu / report.seconds / (report.participants + report.slow));
  return text;
}

// Prints the errors of a test, and returns the exit code of the first one.
ExitCode printErrors(const load::LoadReport& report, const std::string& address) {
  ExitCode code = kOk;
  const auto add = [&](ExitCode of, const std::string& text) {
    printError(of, text);
    if (code == kOk) code = of;
  };
  const load::SceneReport& scenes = report.scenes;
  if (scenes.failure)
    add(exitCodeOf(scenes.failure->kind),
        fmt::format("{} of {} scenes were created at {}; the next one was not: {}", scenes.created,
                    scenes.wanted, address, scenes.failure->text));
  if (report.lost > 0)
    add(exitCodeOf(report.firstLoss.kind),
        report.joined == 0
            ? fmt::format("no participant could join at {}: {}", address, report.firstLoss.text)
            : fmt::format("{} participants were refused or disconnected; the first: {}", report.lost,
                          report.firstLoss.text));
  if (scenes.remaining > 0)
    add(exitCodeOf(scenes.whyRemaining.kind), fmt::format("{} scenes could not be deleted; the first: {}",
                                                          scenes.remaining, scenes.whyRemaining.text));
  if (report.figures.hashMismatches + report.slowFigures.hashMismatches > 0)
    add(kHashMismatch, "decoded frames differ from the server's");
  return code;
}

}  // namespace

void LoadCommand::add(CLI::App& app) {
  command_ = app.add_subcommand("load", "Run a load test with many participants and print what they receive");
  command_->add_option("ADDRESS", address_,
                       "HOST or HOST:PORT of the server's gRPC endpoint, default 127.0.0.1:50051, with "
                       "https:// before it for TLS; with --web, of its web "
                       "endpoint, default 127.0.0.1:8080");
  CLI::Option* const scene =
      command_->add_option("--scene", options_.scene, "Scene to join; default: the server's default scene");
  CLI::Option* const scenes =
      command_
          ->add_option("--scenes", options_.scenes,
                       "Create this many scenes, share the participants out to them in turn, and delete them "
                       "at the end. Default: join --scene")
          ->check(CLI::Range(1u, 10'000u))
          ->excludes(scene);
  command_
      ->add_option("--nodes", options_.nodes,
                   "About this many nodes in each created scene: a sheet that hangs by two corners")
      ->check(CLI::Range(load::kLeastNodes, load::kMostNodes))
      ->capture_default_str()
      ->needs(scenes);
  command_->add_option("--rate", options_.rate, "Ticks and frames per second of each created scene")
      ->check(CLI::Range(load::kLeastRate, load::kMostRate))
      ->capture_default_str()
      ->needs(scenes);
  command_
      ->add_option("--participants", participants_,
                   "Number of participants that read at full speed. Default: 10; with --scenes, one for each")
      ->check(CLI::Range(1u, 100'000u));
  command_->add_option("--viewers", viewers_,
                       "Number of these that send no poses; the others move a sphere. Default: 0; with "
                       "--scenes, all");
  command_->add_option(
      "--decoders", decoders_,
      "Number of these that decode frames and compare them with the server's; the others only acknowledge. "
      "Default: all");
  command_->add_option("--slow", options_.slow, "Number of additional participants that read slowly")
      ->check(CLI::Range(0u, 100'000u))
      ->capture_default_str();
  command_
      ->add_option("--slow-rate", options_.slowBytesPerSecond,
                   "Reading rate of each slow participant, bytes/s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command_
      ->add_option("--intruders", options_.hostileClients,
                   "Number of additional hostile clients, which send invalid messages, never read, "
                   "disconnect and reconnect")
      ->check(CLI::Range(0u, 10'000u))
      ->capture_default_str();
  command_
      ->add_option("--joins", options_.joinsPerSecond,
                   "Participants that join per second at the start; with --scenes, the scenes are created at "
                   "most at this rate, one after the other")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command_
      ->add_option("--leaves", options_.leavesPerSecond,
                   "Participants that leave per second after that; each is replaced")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command_->add_option("--seconds", options_.seconds, "Seconds to measure after all have joined")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  addStreamLimit(*command_, options_.maxVertices);
  addTransport(*command_, options_.datagrams);
  command_->add_flag("--sctp", options_.sctp, "Datagrams travel in SCTP, as those of browsers do");
  command_->add_flag("--web", web_, "Use WebSocket, as the page does, instead of gRPC");
  command_->add_option("--server-pid", serverPid_,
                       "Process id of the server on this machine; adds its CPU time to the report");
  command_
      ->add_option("--frames", framesPath_,
                   "Write a line of JSON for each frame of the participants that are not slow to this file")
      ->type_name("FILE");
  command_->add_flag("--json", json_, "Print only one JSON object");
}

void LoadCommand::check() {
  if (!parsed()) return;
  if (address_.empty()) address_ = web_ ? std::string("127.0.0.1") : std::string(kDefaultAddress);
  const bool creates = options_.scenes > 0;
  options_.participants = participants_.value_or(creates ? options_.scenes : options_.participants);
  if (options_.participants < options_.scenes)
    throw CLI::ValidationError("--participants", "must be at least --scenes, so that each scene has one");
  options_.viewers = viewers_.value_or(creates ? options_.participants : options_.viewers);
  if (options_.sctp && options_.datagrams == Datagrams::off)
    throw CLI::ValidationError("--sctp", "needs datagrams, which --transport tcp turns off");
  if (options_.viewers > options_.participants)
    throw CLI::ValidationError("--viewers", "must not exceed --participants");
  options_.decoders = decoders_.value_or(options_.participants);
  if (options_.decoders > options_.participants)
    throw CLI::ValidationError("--decoders", "must not exceed --participants");
  if (serverPid_ && !cpuSeconds(*serverPid_))
    throw CLI::ValidationError("--server-pid",
                               fmt::format("there is no process {} on this machine", *serverPid_));
}

ExitCode LoadCommand::run(const ServerAddress& address) const {
  std::optional<files::NewFile> frames;
  if (!framesPath_.empty()) {
    auto created = files::NewFile::create(framesPath_);
    if (!created) return printError(kNotWritten, created.error());
    frames.emplace(std::move(*created));
  }
  const auto links = web_ ? load::makeWebLinks(address) : load::makeGrpcLinks(address);
  const bool shows = !json_ && isatty(STDOUT_FILENO) != 0;
  std::optional<double> before, after;
  const auto serverCpuNow = [&] { return serverPid_ ? cpuSeconds(*serverPid_) : std::nullopt; };
  load::LoadProgress progress{.running = [] { return !interrupted(); },
                              .gathered = [&] { before = serverCpuNow(); },
                              .measured = [&] { after = serverCpuNow(); },
                              .show = {}};
  if (shows) {
    progress.show = [](const load::LoadReport& last) {
      std::vector<float> ages = last.figures.ages;
      showStatus(stdout,
                 fmt::format("{} joined, {} left, {} lost  {:.1f} frames/s each  {:.2f} ms p99", last.joined,
                             last.left, last.lost, last.framesPerSecond(), load::percentile(ages, 99)));
    };
  }
  load::LoadOptions options = options_;
  options.token = address.token;
  options.keepsFrames = frames.has_value();
  load::LoadReport report = load::runLoad(*links, options, progress);
  if (shows) showStatus(stdout, "");
  std::optional<double> serverCpu;
  if (before && after) serverCpu = *after - *before;
  const bool nothing = report.joined == 0 && (report.lost > 0 || report.scenes.failure);
  if (!nothing) put((json_ ? json(report, serverCpu) : text(report, serverCpu)) + '\n');
  const ExitCode code = printErrors(report, address.address);
  if (!frames || nothing) return code;
  const auto written = frames->write(frameLines(report)).and_then([&] { return frames->finish(); });
  return written ? code : printError(kNotWritten, written.error());
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
// Output, options and exit codes of clothstream-server.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "server/messages/scene_file.h"
#include "tests/e2e/server_process.h"
#include "tests/endpoint/web_client.h"
#include "tests/serving/small_scene.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;

// Serves a small scene from a temporary file, so that a busy machine keeps up.
class ServerProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::temp_directory_path() /
                 (std::string("clothstream-") + info->name() + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
    std::ofstream(sceneFile()) << messages::toJson(smallScene("small"));
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path sceneFile() const { return directory_ / "small.json"; }
  std::vector<std::string> options(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{
        "--scene-file", sceneFile(),         "--scene", "small", "--port", "0", "--grpc-port", "0",
        "--cache-dir",  directory_ / "cache"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

 private:
  std::filesystem::path directory_;
};

// A file that a start waits for, so that the start does not end by itself.
std::filesystem::path makeFifo(const std::filesystem::path& path) {
  EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
  return path;
}

TEST_F(ServerProgram, EndsWithinDrainIfItIsStoppedWhileItStarts) {
  const std::string fifo = makeFifo(sceneFile().replace_filename("never.json"));
  ServerProcess server(options({"--scene-file", fifo, "--metrics-port", "0", "--drain", "0.5"}));
  server.lineWith("metrics http://127.0.0.1:");
  server.signal(SIGTERM);
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("ending at once: the start takes too long"));
}

TEST_F(ServerProgram, StopsAfterAStartDuringWhichItWasStopped) {
  const std::string fifo = makeFifo(sceneFile().replace_filename("late.json"));
  ServerProcess server(options({"--scene-file", fifo, "--metrics-port", "0", "--drain", "600"}));
  server.lineWith("metrics http://127.0.0.1:");
  server.signal(SIGTERM);
  server.lineWith("stopping when the start is complete, or after 600 s");
  std::ofstream(fifo) << messages::toJson(smallScene("late"));
  EXPECT_EQ(server.exitCode(), 0);
}

TEST_F(ServerProgram, PrintsDeviceScenesAndAddressesAndStreams) {
  ServerProcess server(options({"--drain", "9.5"}));
  EXPECT_THAT(server.lineWith("device"), HasSubstr("Vulkan"));
  EXPECT_THAT(server.lineWith("scenes"),
              testing::AllOf(HasSubstr("curtain (4096 vertices)"), HasSubstr("flag ("),
                             HasSubstr("sphere_drop ("), HasSubstr("small (120 vertices)")));
  const std::uint16_t port = server.portIn(server.lineWith("page    http://127.0.0.1:"));
  EXPECT_GT(server.portIn(server.lineWith("gRPC    127.0.0.1:")), 0);

  WebSocketClient client(port);
  client.send(hello());
  Viewer viewer;
  ASSERT_TRUE(client.watch(viewer, [&] { return viewer.frames >= 10; }));
  EXPECT_EQ(viewer.welcome.scene(), "small");
  EXPECT_THAT(viewer.welcome.server_name(), HasSubstr("clothstream-server 0."));

  server.signal(SIGUSR1);
  server.lineWith("scene small (ms)");
  EXPECT_THAT(server.lineWith("tick lateness"), HasSubstr("."));
  server.signal(SIGTERM);
  EXPECT_FALSE(client.watch(viewer, [] { return false; }));
  ASSERT_FALSE(viewer.notices.empty());
  EXPECT_EQ(viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
  EXPECT_EQ(viewer.notices.back().ends_within_seconds(), 9.5f);
  EXPECT_THAT(viewer.notices.back().text(), HasSubstr("within 9.5 s"));
  EXPECT_EQ(server.exitCode(), 0) << server.output();
  EXPECT_THAT(server.output().substr(server.output().rfind("scene small (ms)")), HasSubstr("joins 1"));
}

TEST_F(ServerProgram, StopsAfterSecondsAndOnInterrupt) {
  EXPECT_EQ(ServerProcess(options({"--seconds", "0.2"})).exitCode(), 0);
  ServerProcess longest(options({"--seconds", "1e9"}));
  longest.lineWith("gRPC");
  longest.signal(SIGTERM);
  EXPECT_EQ(longest.exitCode(), 0) << longest.output();
  ServerProcess interrupted(options());
  interrupted.lineWith("gRPC");
  interrupted.signal(SIGINT);
  EXPECT_EQ(interrupted.exitCode(), 0) << interrupted.output();
}

TEST_F(ServerProgram, ServesTheStreamThatAFileDescribes) {
  model::Scene scene = smallScene("small");
  scene.simulationRate = 50;
  scene.streamRate = 25;
  scene.substeps = 16;
  scene.stream.maxError = 0.002f;
  scene.stream.normals = model::Normals::octahedral;
  std::ofstream(sceneFile()) << messages::toJson(scene);
  ServerProcess server(options());
  WebSocketClient client(server.portIn(server.lineWith("page    http://")));
  client.send(hello());
  Viewer viewer;
  ASSERT_TRUE(client.watch(viewer, [&] { return viewer.frames >= 2; }));
  EXPECT_EQ(viewer.description.simulation_rate(), 50u);
  EXPECT_EQ(viewer.description.stream_rate(), 25u);
  EXPECT_EQ(viewer.description.definition().substeps(), 16u);
  EXPECT_EQ(viewer.description.normals(), v1::NORMALS_OCTAHEDRAL);
  EXPECT_FLOAT_EQ(viewer.description.max_error(), 0.002f);
}

TEST_F(ServerProgram, NamesPortAndOptionWhenAPortIsInUse) {
  ServerProcess first(options());
  const std::string page = std::to_string(first.portIn(first.lineWith("page    http://")));
  const std::string grpc = std::to_string(first.portIn(first.lineWith("gRPC    ")));
  ServerProcess samePage(options({"--port", page}));
  EXPECT_EQ(samePage.exitCode(), 1);
  EXPECT_THAT(samePage.output(), testing::AllOf(HasSubstr("port " + page), HasSubstr("--port")));
  ServerProcess sameGrpc(options({"--grpc-port", grpc}));
  EXPECT_EQ(sameGrpc.exitCode(), 1);
  EXPECT_THAT(sameGrpc.output(), testing::AllOf(HasSubstr("port " + grpc), HasSubstr("--grpc-port")));
}

TEST_F(ServerProgram, ListsTheScenesForAnUnknownName) {
  ServerProcess server({"--scene", "nowhere"});
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(
      server.output(),
      HasSubstr("there is no scene 'nowhere'; there are balloon, curtain, cushion, dress, figure_07"));
}

TEST_F(ServerProgram, RefusesTooFewSubsteps) {
  model::Scene scene = smallScene("small");
  scene.substeps = 1;
  std::ofstream(sceneFile()) << messages::toJson(scene);
  ServerProcess server(options());
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("substeps"));
}

TEST_F(ServerProgram, NamesTheSceneFileThatCannotBeRead) {
  std::ofstream(sceneFile()) << "{\"name\": \"small\", ";
  ServerProcess server(options());
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("small.json"));
  ServerProcess missing({"--scene-file", "/nowhere/scene.json"});
  EXPECT_EQ(missing.exitCode(), 1);
  EXPECT_THAT(missing.output(), HasSubstr("/nowhere/scene.json"));
}

std::vector<float> numbersIn(const std::filesystem::path& path) {
  std::vector<float> numbers(std::filesystem::file_size(path) / sizeof(float));
  std::ifstream(path, std::ios::binary)
      .read(reinterpret_cast<char*>(numbers.data()),
            static_cast<std::streamsize>(numbers.size() * sizeof(float)));
  return numbers;
}

// Two runs write the same states, also if the second run writes fewer states.
TEST_F(ServerProgram, StepWritesAFileWithADescription) {
  const std::filesystem::path whole = sceneFile().replace_filename("whole.f32");
  const std::filesystem::path some = sceneFile().replace_filename("some.f32");
  std::ofstream(some.string() + ".json") << "of an earlier run";
  ServerProcess every({"step", "--scene", sceneFile(), "--ticks", "20", "--out", whole});
  EXPECT_EQ(every.exitCode(), 0) << every.output();
  ServerProcess fifth({"step", "--scene", sceneFile(), "--ticks", "20", "--out", some, "--every", "5"});
  EXPECT_EQ(fifth.exitCode(), 0) << fifth.output();

  const model::Scene scene = smallScene("small");
  const std::size_t frame = std::size_t{scene.nodeCount()} * 6;
  const std::vector<float> all = numbersIn(whole), few = numbersIn(some);
  ASSERT_EQ(all.size(), 21 * frame);
  ASSERT_EQ(few.size(), 5 * frame);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_TRUE(std::equal(few.begin() + static_cast<std::ptrdiff_t>(i * frame),
                           few.begin() + static_cast<std::ptrdiff_t>((i + 1) * frame),
                           all.begin() + static_cast<std::ptrdiff_t>(5 * i * frame)))
        << "frame " << i;
  // Frame 0 is the start: at rest, with the first node at its corner. Later frames fall.
  EXPECT_EQ(few[0], -0.45f);
  EXPECT_EQ(few[3], 0);
  EXPECT_LT(few[4 * frame + 6 * 115 + 1], few[6 * 115 + 1]);

  const auto description = nlohmann::json::parse(std::ifstream(some.string() + ".json"));
  EXPECT_EQ(description["shape"], (std::vector<std::size_t>{5, 120, 6}));
  EXPECT_EQ(description["dtype"], "<f4");
  EXPECT_EQ(description["file"], "some.f32");
  EXPECT_EQ(description["complete"], true);
  EXPECT_EQ(description["ticks"], (std::vector<int>{0, 5, 10, 15, 20}));
  EXPECT_EQ(description["hashes"].size(), 5u);
  EXPECT_EQ(description["cloths"][0]["name"], "sheet");
  EXPECT_EQ(description["cloths"][0]["rows"], 12);
  EXPECT_TRUE(description["reports"][0].is_null());
  const auto& report = description["reports"][4]["cloths"][0];
  EXPECT_GT(report["strainMax"], 0);
  EXPECT_GT(report["kineticEnergy"], 0);
  EXPECT_GE(report["penetration"], 0);
  EXPECT_EQ(description["scene"]["cloths"][0]["grid"]["columns"], 10);
  EXPECT_THAT(description["server"].get<std::string>(), HasSubstr("clothstream-server 0."));
}

TEST_F(ServerProgram, StepChangesRateAndSubsteps) {
  const std::filesystem::path out = sceneFile().replace_filename("other.f32");
  ServerProcess server(
      {"step", "--scene", sceneFile(), "--ticks", "1", "--out", out, "--rate", "50", "--substeps", "16"});
  ASSERT_EQ(server.exitCode(), 0) << server.output();
  const auto description = nlohmann::json::parse(std::ifstream(out.string() + ".json"));
  EXPECT_EQ(description["scene"]["simulationRate"], 50);
  // The largest divisor of 50 up to the scene's own 40.
  EXPECT_EQ(description["scene"]["streamRate"], 25);
  EXPECT_EQ(description["scene"]["substeps"], 16);
}

// The example of docs/simulation.md, with the standard library of Python.
TEST_F(ServerProgram, PythonReadsTheFileOfAStep) {
  const std::filesystem::path out = sceneFile().replace_filename("state.f32");
  ServerProcess server({"step", "--scene", sceneFile(), "--ticks", "8", "--every", "4", "--out", out});
  ASSERT_EQ(server.exitCode(), 0) << server.output();
  const std::filesystem::path script = sceneFile().replace_filename("read.py");
  std::ofstream(script) << R"(
import array, json, sys
description = json.load(open(sys.argv[1] + '.json'))
frames, nodes, columns = description['shape']
numbers = array.array('f')
numbers.fromfile(open(sys.argv[1], 'rb'), frames * nodes * columns)
assert (frames, nodes, columns) == (3, 120, 6) and description['columns'][1] == 'py'
height = lambda frame: sum(numbers[(frame * nodes + node) * columns + 1] for node in range(nodes)) / nodes
assert height(2) < height(1) < height(0), 'the cloth must fall'
energy = [sum(report['cloths'][0][kind] for kind in ('kineticEnergy', 'elasticEnergy', 'gravityEnergy'))
          for report in description['reports'][1:]]
assert len(energy) == 2
)";
  const std::string command = "python3 '" + script.string() + "' '" + out.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST_F(ServerProgram, InterruptedStepLeavesAValidFile) {
  const std::filesystem::path out = sceneFile().replace_filename("long.f32");
  ServerProcess server(
      {"step", "--scene", sceneFile(), "--ticks", "100000000", "--every", "3", "--out", out});
  server.lineWith("tick ");  // progress
  server.signal(SIGINT);
  EXPECT_EQ(server.exitCode(), 130);
  EXPECT_THAT(server.output(), HasSubstr("interrupted after tick"));
  const auto description = nlohmann::json::parse(std::ifstream(out.string() + ".json"));
  EXPECT_EQ(description["complete"], false);
  const std::size_t frames = description["shape"][0];
  EXPECT_GT(frames, 1u);
  EXPECT_EQ(std::filesystem::file_size(out), frames * 120 * 6 * sizeof(float));
  EXPECT_EQ(description["ticks"].size(), frames);
  EXPECT_EQ(description["reports"].size(), frames);
}

TEST_F(ServerProgram, ExplainsWrongOptionsOfAStep) {
  const auto fails = [](const std::vector<std::string>& options, const std::string& text) {
    ServerProcess server(options);
    EXPECT_EQ(server.exitCode(), 1) << server.output();
    EXPECT_THAT(server.output(), HasSubstr(text));
  };
  const std::string file = sceneFile(), out = sceneFile().replace_filename("x.f32");
  fails({"step", "--scene", file, "--ticks", "1"}, "--out");
  fails({"step", "--scene", file, "--ticks", "0", "--out", out}, "--ticks");
  fails({"step", "--scene", "nowhere", "--ticks", "1", "--out", out}, "nowhere");
  fails({"step", "--scene", file, "--ticks", "1", "--out", "/nowhere/x.f32"}, "cannot write /nowhere/x.f32");
  fails({"step", "--scene", file, "--ticks", "1", "--out", out, "--substeps", "1"},
        "scene 'small' with these options: substeps");
  ServerProcess help({"step", "--help"});
  EXPECT_EQ(help.exitCode(), 0);
  for (const char* word : {"--scene", "--ticks", "--out", "--every", "--device", "numpy"})
    EXPECT_THAT(help.output(), HasSubstr(word));
}

TEST_F(ServerProgram, DoctorReadsTheOptionsOfTheServerAndReportsProblems) {
  const std::filesystem::path report = sceneFile().replace_filename("doctor.json");
  ServerProcess well({"--port", "0", "--grpc-port", "0", "doctor", "--seconds", "0", "--report", report});
  ASSERT_EQ(well.exitCode(), 0) << well.output();
  EXPECT_THAT(well.output(), HasSubstr("the server uses"));
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(report))["findings"][0]["level"], "ok");

  ServerProcess server(options({}));
  const std::uint16_t port = server.portIn(server.lineWith("page"));
  ServerProcess ill(
      {"--port", std::to_string(port), "--grpc-port", "0", "doctor", "--seconds", "0", "--json"});
  EXPECT_EQ(ill.exitCode(), 1);
  EXPECT_THAT(ill.output(), HasSubstr("is already in use"));
}

TEST_F(ServerProgram, ListsDevicesAndRefusesAnUnknownOne) {
  ServerProcess list({"--list-devices"});
  EXPECT_EQ(list.exitCode(), 0);
  EXPECT_THAT(list.output(), HasSubstr("0  "));
  ServerProcess server(options({"--device", "no such device"}));
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("no such device"));
}

TEST_F(ServerProgram, ListsMaterials) {
  ServerProcess list({"--list-materials"});
  EXPECT_EQ(list.exitCode(), 0);
  for (const char* word : {"cotton", "wool", "0.324", "denim"}) EXPECT_THAT(list.output(), HasSubstr(word));
}

TEST_F(ServerProgram, ExplainsOptionsAndRefusesUnknownOnes) {
  ServerProcess help({"--help"});
  EXPECT_EQ(help.exitCode(), 0);
  for (const char* option :
       {"--scene", "--scene-file", "--profile", "--reports", "step", "Limits of --profile", "--host",
        "--port", "--grpc-port", "--page", "--device", "--list-devices", "--list-materials",
        "--software-threads", "--kernels", "--log-level", "--seconds"})
    EXPECT_THAT(help.output(), HasSubstr(option));
  ServerProcess version({"--version"});
  EXPECT_EQ(version.exitCode(), 0);
  EXPECT_THAT(version.output(), HasSubstr("clothstream-server 0."));
  ServerProcess wrong({"--speed", "3"});
  EXPECT_EQ(wrong.exitCode(), 1);
  EXPECT_THAT(wrong.output(), HasSubstr("--speed"));
  ServerProcess level(options({"--log-level", "loud"}));
  EXPECT_EQ(level.exitCode(), 1);
  EXPECT_THAT(level.output(), HasSubstr("loud"));
}

// Options come from the command line, the environment and a file. Needs no device.
class ServerOptions : public ServerProgram {
 protected:
  struct Result {
    int exitCode = 0;
    std::string output;
  };
  static Result run(const std::vector<std::string>& options,
                    const std::vector<std::string>& environment = {}) {
    ServerProcess server(options, environment);
    const int exitCode = server.exitCode();
    return {exitCode, server.output()};
  }
  std::string file(const std::string& text) const {
    std::ofstream(sceneFile().replace_filename("server.toml")) << text;
    return sceneFile().replace_filename("server.toml");
  }
  void expectError(const Result& result, const std::string& text) const {
    EXPECT_EQ(result.exitCode, 1) << result.output;
    EXPECT_THAT(result.output, HasSubstr(text));
  }
};

TEST_F(ServerOptions, CommandLineBeatsEnvironmentWhichBeatsFile) {
  const std::string config = file("port = 1001\ngrpc-port = 1002\nscene = \"flag\"\nalways-run = true\n");
  const std::vector<std::string> environment{"CLOTHSTREAM_PORT=2001", "CLOTHSTREAM_GRPC_PORT=2002",
                                             "CLOTHSTREAM_HOLD="};
  const Result result = run({"--config", config, "--port", "3001", "--print-config"}, environment);
  EXPECT_EQ(result.exitCode, 0);
  for (const char* line : {"\nport = 3001\n", "\ngrpc-port = 2002\n", "\nscene = \"flag\"\n",
                           "\nalways-run = true\n", "\nhold = 60\n"})
    EXPECT_THAT(result.output, HasSubstr(line));
  EXPECT_EQ(
      run({"--port", "3001", "--print-config"}, {"CLOTHSTREAM_CONFIG=" + config, environment[1]}).output,
      result.output);
  EXPECT_THAT(run({"--config", config, "--print-config"}, {"CLOTHSTREAM_ALWAYS_RUN=false"}).output,
              HasSubstr("\nalways-run = false\n"));
}

TEST_F(ServerOptions, PrintedConfigurationReadsBackUnchanged) {
  const std::string config = file(
      "# A comment.\n"
      "scene = 'fl#ag' # another\n"
      "page = \"a \\\"quoted\\\" \\\\ \\u00e9 directory\"\n"
      "allow-origin = [\n  \"https://a.example\", # first\n  \"https://b.example\",\n]\n"
      "participants-change = [\"cloths\"]\n"
      "cache-dir = \"\"\nmax-load = 0.002\nanonymous-role = \"viewer\"\nhold = 2.5\nrecord-limit = 1_000\n"
      "recordings = \"records\"\nseconds = 3\n");
  const Result first = run({"--config", config, "--print-config"});
  ASSERT_EQ(first.exitCode, 0) << first.output;
  for (const char* line : {"\nscene = \"fl#ag\"\n", "\npage = \"a \\\"quoted\\\" \\\\ \u00e9 directory\"\n",
                           "\nallow-origin = [\"https://a.example\", \"https://b.example\"]\n",
                           "\ncache-dir = \"\"\n", "\nparticipants-change = [\"cloths\"]\n",
                           "\nanonymous-role = \"viewer\"\n", "\nrecord-limit = 1000\n",
                           "\nrecordings = \"records\"\n", "\nseconds = 3\n", "\n# record is not set\n"})
    EXPECT_THAT("\n" + first.output, HasSubstr(line));
  EXPECT_EQ(run({"--config", file(first.output), "--print-config"}).output, first.output);
  const Result defaults = run({"--print-config"});
  EXPECT_EQ(run({"--config", file(defaults.output), "--print-config"}).output, defaults.output);
  EXPECT_EQ(run({"--config", "deploy/server.toml", "--print-config"}).output, defaults.output);
}

TEST_F(ServerOptions, PrintedConfigurationReadsBackWithEveryOptionSet) {
  const Result defaults = run({"--print-config"});
  // Options that exclude each other are set in separate rounds.
  struct Turn {
    std::vector<std::string> arguments, unset;
  };
  for (const Turn& turn :
       {Turn{{"--record=line\nand\ttab", "--tls=self"},
             {"# recordings is not set", "# tls-certificate is not set", "# tls-key is not set"}},
        Turn{{"--recordings=line\nand\ttab", "--tls-certificate=chain.pem", "--tls-key=key.pem"},
             {"# record is not set", "tls = \"off\""}}}) {
    std::vector<std::string> arguments{"--scene=a \"scene\" \\ 'of' mine",
                                       "--scene-file=one.json",
                                       "--scene-file=two, three.json",
                                       "--profile=public",
                                       "--always-run",
                                       "--reports=0.25",
                                       "--record-limit=1e9",
                                       "--recordings-limit=500",
                                       "--keep-free=0",
                                       "--max-created-scenes=0",
                                       "--scene-lifetime=0",
                                       "--max-load=.5e-3",
                                       "--max-tick-time=1.5",
                                       "--max-memory=1000",
                                       "--encoder-threads=7",
                                       "--hold=0.000001",
                                       "--hold-page=3",
                                       "--max-participants=12",
                                       "--participants-change=cloths,colliders",
                                       "--participants-may=create,own",
                                       "--room-surfaces=off",
                                       "--owners-alone",
                                       "--token-keys=keys",
                                       "--token-audience=studio",
                                       "--pairing",
                                       "--insecure",
                                       "--anonymous-role=viewer",
                                       "--max-scenes-per-tenant=2",
                                       "--host=::",
                                       "--port=0",
                                       "--grpc-port=65535",
                                       "--transport=tcp",
                                       "--datagram-port=7000",
                                       "--public-address=192.0.2.1",
                                       "--page=# no comment",
                                       "--public-name=cloth.example.org",
                                       "--reflection",
                                       "--allow-origin=https://a.example",
                                       "--allow-origin=https://b.example",
                                       "--max-connections=1000",
                                       "--announce=on",
                                       "--max-upload-memory=48",
                                       "--overload=keep",
                                       "--state-limit=500",
                                       "--tls-client-ca=ca.pem",
                                       "--nats=nats://10.0.0.5:4222,nats://10.0.0.6:4222",
                                       "--nats-credentials=server.creds",
                                       "--nats-ca=nats.pem",
                                       "--agones",
                                       "--events-url=http://127.0.0.1:9000/events",
                                       "--events-secret-file=events.secret",
                                       "--state-dir=state",
                                       "--metrics-port=0",
                                       "--metrics-host=::1",
                                       "--device=1",
                                       "--software-threads=0",
                                       "--kernels=cpu",
                                       "--cache-dir",
                                       "",
                                       "--log-level=off",
                                       "--log-format=json",
                                       "--seconds=1e9",
                                       "--drain=2.5",
                                       "--print-config"};
    arguments.insert(arguments.end(), turn.arguments.begin(), turn.arguments.end());
    const Result first = run(arguments);
    ASSERT_EQ(first.exitCode, 0) << first.output;
    for (const char* line :
         {"\nmax-load = 0.0005\n", "\nprofile = \"public\"\n", "\nrecord-limit = 1000000000\n",
          "\nhold = 1e-06\n", "\nreports = 0.25\n", "\nseconds = 1000000000\n",
          "\nscene-file = [\"one.json\", \"two, three.json\"]\n",
          "\nparticipants-change = [\"cloths\", \"colliders\"]\n",
          "\nnats = [\"nats://10.0.0.5:4222\", \"nats://10.0.0.6:4222\"]\n", "\ndevice = \"1\"\n"})
      EXPECT_THAT(first.output, HasSubstr(line));
    std::istringstream lines(defaults.output);
    for (std::string line; std::getline(lines, line);) {
      const bool isOption = line.find(" = ") != std::string::npos || line.ends_with(" is not set");
      if (isOption && std::ranges::find(turn.unset, line) == turn.unset.end()) {
        EXPECT_THAT("\n" + first.output, testing::Not(HasSubstr("\n" + line + "\n"))) << "keeps its default";
      }
    }
    const Result second = run({"--config", file(first.output), "--print-config"});
    EXPECT_EQ(second.exitCode, 0);
    EXPECT_EQ(second.output, first.output);
  }
}

TEST_F(ServerOptions, RefusesNumbersThatAreNotDecimal) {
  const std::string hint = "use 0 to 65535, in decimal digits without spaces or leading zeros";
  for (const char* text :
       {"0755", "0x10", "0b1", "+5", "5e", "1.5", "1e3", "1_000", "-", "99999999999999999999x"}) {
    const std::string problem = std::string(text) + " is not a port; " + hint;
    expectError(run({"--port", text}), "--port: " + problem);
    expectError(run({}, {std::string("CLOTHSTREAM_PORT=") + text}), "CLOTHSTREAM_PORT: " + problem);
    const std::string config = file("port = '" + std::string(text) + "'\n");
    expectError(run({"--config", config}), config + ":1: port: " + problem);
  }
  expectError(run({"--port", " 5"}), "--port: ' 5' is not a port; " + hint);
  expectError(run({"--port", "5 "}), "--port: '5 ' is not a port; " + hint);
  expectError(run({"--port", ""}), "--port: '' is not a port; " + hint);
  expectError(run({"--hold", "007"}), "--hold: 007 is not a number; use 0 to 3600, in decimal digits");
  expectError(run({"--hold", "0x1p3"}), "--hold: 0x1p3 is not a number; use 0 to 3600, in decimal digits");
  expectError(run({"--config", file("port = 0755\n")}), ":1: ");
  EXPECT_THAT(run({"--port", "0", "--hold", "0.5", "--print-config"}).output,
              testing::AllOf(HasSubstr("\nport = 0\n"), HasSubstr("\nhold = 0.5\n")));
}

TEST_F(ServerOptions, RefusesInfiniteAndTooLargeNumbers) {
  const std::string range = "use more than 0, at most 1000000000";
  for (const char* text : {"inf", "-inf", "nan", "infinity"}) {
    expectError(run({"--seconds", text}), std::string("--seconds: ") + text + " is not a number; " + range);
    expectError(run({"--max-load", text}), std::string("--max-load: ") + text + " is not a number");
  }
  for (const char* text : {"1e10", "1e300", "1e999", "0", "-1"})
    expectError(run({"--seconds", text}), std::string("--seconds: ") + text + " is out of range; " + range);
  const std::string config = file("seconds = inf\n");
  expectError(run({"--config", config}), config + ":1: seconds: inf is not a number; " + range);
  expectError(run({"--max-participants", "99999999999999999999"}),
              "--max-participants: 99999999999999999999 is out of range; use 1 to 135");
}

TEST_F(ServerOptions, StrongerOfTwoExclusiveOptionsWins) {
  const std::string config = file("record = \"all\"\n");
  const Result result = run({"--config", config, "--recordings", "asked", "--print-config"});
  EXPECT_THAT(result.output, HasSubstr("# record is not set\nrecordings = \"asked\"\n"));
  expectError(run({"--record", "all", "--recordings", "asked"}), "--record excludes --recordings");
  expectError(run({}, {"CLOTHSTREAM_RECORD=a", "CLOTHSTREAM_RECORDINGS=b"}),
              "CLOTHSTREAM_RECORDINGS: cannot be combined with record");
}

TEST_F(ServerOptions, SuggestsTheNearestNameForAnUnknownOne) {
  expectError(run({"--prot", "1"}), "--prot: unknown option; did you mean '--port'?");
  expectError(run({"ply", "x.mcap"}), "ply: unknown command; did you mean 'play'?");
  expectError(run({"rate"}), "rate: unknown command");
  const std::string config = file("port = 1\n\ngrpc_port = 2\n");
  expectError(run({"--config", config}), config + ":3: unknown key 'grpc_port'; did you mean 'grpc-port'?");
  const Result warned = run({"--list-materials"}, {"CLOTHSTREAM_PROT=1", "CLOTHSTREAM_VALIDATION=1"});
  EXPECT_EQ(warned.exitCode, 0);
  EXPECT_THAT(warned.output,
              HasSubstr("CLOTHSTREAM_PROT is not an option of this program and is ignored; did you mean "
                        "'CLOTHSTREAM_PORT'?"));
  EXPECT_THAT(warned.output, testing::Not(HasSubstr("CLOTHSTREAM_VALIDATION")));
}

TEST_F(ServerOptions, NamesSourceAndAllowedRangeOfABadValue) {
  const std::string problem = "70000 is not a port; use 0 to 65535";
  expectError(run({"--port", "70000"}), "--port: " + problem);
  expectError(run({}, {"CLOTHSTREAM_PORT=70000"}), "CLOTHSTREAM_PORT: " + problem);
  const std::string config = file("scene = \"flag\"\nport = 70000\n");
  expectError(run({"--config", config}), config + ":2: port: " + problem);
  expectError(run({"--max-participants", "0"}), "--max-participants: 0 is out of range; use 1 to 135");
  expectError(run({"--max-participants", "few"}),
              "--max-participants: few is not a whole number; use 1 to 135");
  expectError(run({"--anonymous-role", "king"}),
              "--anonymous-role: 'king' is not allowed; use owner, participant, viewer");
  expectError(run({"--profile", "office"}), "--profile: 'office' is not allowed; use fleet, home, public");
  expectError(run({}, {"CLOTHSTREAM_ALWAYS_RUN=maybe"}),
              "CLOTHSTREAM_ALWAYS_RUN: 'maybe' is not allowed; use true");
  expectError(run({"--participants-change", "none,cloths"}), "--participants-change: 'none' excludes");
}

TEST_F(ServerOptions, ProfileSetsLimits) {
  const Result home = run({"--print-config"}), open = run({"--print-config"}, {"CLOTHSTREAM_PROFILE=public"});
  EXPECT_THAT(home.output, HasSubstr("\nprofile = \"home\"\nmax-upload-memory = 64\n"));
  EXPECT_THAT(home.output, HasSubstr("\nowners-alone = false\n"));
  EXPECT_THAT(home.output, HasSubstr("# Limits of the profile home\n"));
  EXPECT_THAT(home.output, HasSubstr("\n# nodes of a created scene: 262144\n"));
  EXPECT_THAT(open.output, HasSubstr("\nprofile = \"public\"\nmax-upload-memory = 32\n"));
  EXPECT_THAT(open.output, HasSubstr("\nowners-alone = true\n"));
  EXPECT_THAT(open.output, HasSubstr("\n# nodes of a created scene: 65536\n"));
  EXPECT_EQ(run({"--config", file(open.output), "--print-config"}).output, open.output);
}

TEST_F(ServerOptions, ExplicitOptionBeatsItsProfile) {
  const std::string config = file("max-upload-memory = 5\nowners-alone = false\n");
  const Result result =
      run({"--config", config, "--profile", "public", "--scene-lifetime", "7", "--print-config"});
  for (const char* line : {"\nmax-upload-memory = 5\n", "\nowners-alone = false\n", "\nscene-lifetime = 7\n"})
    EXPECT_THAT(result.output, HasSubstr(line));
}

TEST_F(ServerOptions, SaysWhatReplacesARemovedOption) {
  expectError(run({"--substeps", "3"}), "--substeps: unknown option; set it in a scene file (--scene-file)");
  const std::string config = file("max-parsed-memory = 8\n");
  expectError(run({"--config", config}),
              config + ":1: unknown key 'max-parsed-memory'; use --profile, which sets this limit");
  EXPECT_THAT(
      run({"--list-materials"}, {"CLOTHSTREAM_LOG_RATE=1"}).output,
      HasSubstr("CLOTHSTREAM_LOG_RATE is not an option of this program and is ignored; use --profile"));
}

TEST_F(ServerOptions, NamesTheLineOfASyntaxError) {
  const auto refuses = [&](const std::string& text, const std::string& error) {
    const std::string config = file("# first line\n" + text);
    expectError(run({"--config", config}), config + ":" + error);
  };
  refuses("[play]\n", "2: tables are not supported");
  refuses("port 3\n", "2: ");
  refuses("port =\n", "2: ");
  refuses("scene = flag\n", "2: ");
  refuses("scene = \"flag\n", "2: ");
  refuses("scene = \"\\q\"\n", "2: ");
  refuses("port = 1\nport = 2\n", "3: ");
  refuses("port = 1 scene = 2\n", "2: ");
  refuses("port = [1, 2]\n", "2: port: use one value, not an array");
  refuses("stop = 2026-01-01\n", "2: stop: use a string, a number, true, false, or an array of these");
  refuses("allow-origin = [\n\"a\"\n", "3: ");
  expectError(run({"--config", "/nowhere/server.toml"}),
              "--config: /nowhere/server.toml cannot be read: No such file or directory");
}

TEST_F(ServerOptions, CommandsUseSourcesForOptionsThatTheyShare) {
  const std::string out = sceneFile().replace_filename("x.f32");
  const std::vector<std::string> step{"step", "--scene", sceneFile(), "--ticks", "1", "--out", out};
  expectError(run(step, {"CLOTHSTREAM_DEVICE=no such device"}), "no such device");
  std::vector<std::string> chosen = step;
  chosen.insert(chosen.end(), {"--device", "0"});
  const Result result = run(chosen, {"CLOTHSTREAM_DEVICE=no such device", "CLOTHSTREAM_SCENE=nowhere"});
  EXPECT_EQ(result.exitCode, 0) << result.output;
}

// To update the page: clothstream-server --help-markdown > docs/server-options.md
TEST_F(ServerOptions, DocumentationPageMatchesTheProgram) {
  std::ifstream in("docs/server-options.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(run({"--help-markdown"}).output, page);
}

}  // namespace
}  // namespace clothstream::tests

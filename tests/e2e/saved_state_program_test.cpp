// SPDX-License-Identifier: MIT
// The real clothstream-server ends, also by SIGKILL, and starts again with its state directory.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "clients/grpc/grpc_client.h"
#include "clients/grpc/scene_control.h"
#include "proto/codec/packet_header.h"
#include "server/messages/scene_message.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/web_client.h"
#include "tests/serving/small_scene.h"

namespace clothstream::e2e {
namespace {

using model::SolverKind;
using ::testing::HasSubstr;

constexpr SolverKind kSolvers[] = {SolverKind::massSpring, SolverKind::constraint, SolverKind::acad,
                                   SolverKind::xpbd, SolverKind::implicitEuler};

// A client of one scene, over several runs of the server.
class Member {
 public:
  Member(const std::string& address, const std::string& scene) {
    NativeClientOptions options;
    options.scene = scene;
    options.onMessage = [this](std::span<const std::byte> bytes) { receive(bytes); };
    auto joined = joinByGrpc(address, options, [](cs_client*, std::uint32_t) {});
    if (!joined) throw std::runtime_error(joined.error().text);
    client_ = std::move(*joined);
  }

  std::uint64_t tick() const {
    const std::lock_guard lock(mutex_);
    return tick_;
  }
  // Number of runs that this client has joined.
  std::size_t runs() const {
    const std::lock_guard lock(mutex_);
    return welcomes_.size();
  }
  std::vector<v1::Welcome> welcomes() const {
    const std::lock_guard lock(mutex_);
    return welcomes_;
  }
  // First tick that was seen in each run.
  std::vector<std::uint64_t> firstTicks() const {
    const std::lock_guard lock(mutex_);
    return firstTicks_;
  }
  // Ticks that were seen in two runs, and those of them with two states.
  std::size_t repeated() const {
    const std::lock_guard lock(mutex_);
    return repeated_;
  }
  std::size_t different() const {
    const std::lock_guard lock(mutex_);
    return different_;
  }

 private:
  void receive(std::span<const std::byte> bytes) {
    v1::ServerMessage message;
    if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
    const std::lock_guard lock(mutex_);
    if (message.has_welcome()) {
      welcomes_.push_back(message.welcome());
      begins_ = true;
    }
    if (!message.has_frame()) return;
    const auto packet = codec::parsePacket(std::as_bytes(std::span(message.frame().packet())));
    if (!packet) return;
    tick_ = packet->header.tick;
    if (std::exchange(begins_, false)) firstTicks_.push_back(tick_);
    const auto [seen, isNew] = states_.emplace(tick_, message.frame().state_hash());
    if (isNew) return;
    ++repeated_;
    if (seen->second != message.frame().state_hash()) ++different_;
  }

  mutable std::mutex mutex_;
  std::vector<v1::Welcome> welcomes_;
  std::vector<std::uint64_t> firstTicks_;
  std::map<std::uint64_t, std::uint64_t> states_;  // hash by tick
  std::uint64_t tick_ = 0;
  std::size_t repeated_ = 0, different_ = 0;
  bool begins_ = false;
  std::unique_ptr<NativeClient> client_;
};

class SavedStateProgram : public RunningServer {
 protected:
  Arguments options(const Arguments& more = {}) const {
    Arguments all = kSmallScene;
    all.insert(all.end(), {"--state-dir", directory_.path().string(), "--max-load", "1000", "--max-tick-time",
                           "0", "--keep-free", "0", "--overload", "keep", "--metrics-port", "0"});
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  auto requestScene(const std::string& name, SolverKind solver, std::uint32_t rows = 12,
                    std::uint32_t columns = 10) const {
    model::Scene scene = tests::smallScene(name);
    scene.cloths[0].solver.kind = solver;
    scene.cloths[0].grid.rows = rows;
    scene.cloths[0].grid.columns = columns;
    CreateSceneOptions request;
    request.scene = messages::toMessage(scene);
    return clothstream::createScene(address_, request);
  }
  void createScene(const std::string& name, SolverKind solver) const {
    const auto made = requestScene(name, solver);
    ASSERT_TRUE(made.has_value()) << made.error().text;
  }
  // Lets the server make a large scene with the address space that it has now.
  void useUpMemory() {
    std::uint64_t pages = 0;
    std::ifstream("/proc/" + std::to_string(server_->id()) + "/statm") >> pages;
    const auto bytes = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    const rlimit limit{bytes, bytes};
    ASSERT_EQ(::prlimit(server_->id(), RLIMIT_AS, &limit, nullptr), 0);
    EXPECT_FALSE(requestScene("large", SolverKind::xpbd, 8000, 32));
    EXPECT_EQ(server_->waitForEnd(kPatience), 71);
  }
  // Time in seconds since which a running scene has no newer state on the disk.
  double stateAge() const {
    const auto address = server_->waitForLine("metrics http://127.0.0.1:", kPatience);
    if (!address) throw std::runtime_error("the server names no port for metrics");
    tests::HttpClient client(static_cast<std::uint16_t>(std::stoul(*address)));
    const std::string metrics = client.get("/metrics").body();
    const std::string name = "\nclothstream_state_age_seconds ";
    return std::stod(metrics.substr(metrics.find(name) + name.size()));
  }
  // Pauses the scene and waits until its tick has ended.
  void pause(const std::string& name) const {
    v1::ControlSceneRequest request;
    request.set_name(name);
    request.set_paused(true);
    ASSERT_TRUE(eventually([&] {
      const auto summary = controlScene(address_, request);
      return summary && !summary->running();
    }));
  }
  void startAgain() {
    const std::string port = std::to_string(portIn(address_));
    startServer(options(), port);
  }

  TemporaryDirectory directory_;
};

TEST_F(SavedStateProgram, ScenesOfEverySolverGoOnAfterSigkillAndSigterm) {
  startServer(options());
  if (address_.empty()) return;
  std::vector<std::unique_ptr<Member>> members;
  for (const SolverKind solver : kSolvers) {
    const std::string name = "solver" + std::to_string(static_cast<int>(solver));
    ASSERT_NO_FATAL_FAILURE(createScene(name, solver));
    members.push_back(std::make_unique<Member>(address_, name));
  }
  const auto all = [&](const std::function<bool(const Member&)>& holds) {
    return eventually([&] { return std::ranges::all_of(members, [&](const auto& m) { return holds(*m); }); });
  };
  ASSERT_TRUE(all([](const Member& member) { return member.tick() > 10; }));
  std::vector<std::uint64_t> saved;
  for (const auto& member : members) saved.push_back(member->tick());
  // The disk has a state of every scene that is newer than these ticks.
  const auto seen = std::chrono::steady_clock::now();
  ASSERT_TRUE(eventually([&] {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - seen;
    constexpr double kMetricsAge = 0.2;  // s, at most
    return stateAge() + kMetricsAge < elapsed.count();
  }));
  server_->signal(SIGKILL);
  ASSERT_TRUE(server_->waitForEnd(kPatience));
  std::vector<std::uint64_t> last;
  for (const auto& member : members) last.push_back(member->tick());

  startAgain();
  ASSERT_TRUE(all([](const Member& member) { return member.firstTicks().size() == 2; }));
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Member& member = *members[i];
    ASSERT_TRUE(eventually([&] { return member.tick() > last[i]; }));
    EXPECT_TRUE(member.welcomes()[1].resumed());
    EXPECT_EQ(member.welcomes()[1].participant_id(), member.welcomes()[0].participant_id());
    EXPECT_EQ(member.welcomes()[1].role(), v1::ROLE_OWNER);
    EXPECT_GE(member.firstTicks()[1], saved[i]);
    repeated += member.repeated();
    EXPECT_EQ(member.different(), 0u) << "solver " << i << ", " << member.repeated() << " ticks again";
  }
  EXPECT_GT(repeated, 0u);

  // No tick is under way at the end, which could take longer than the server waits.
  for (const SolverKind solver : kSolvers)
    ASSERT_NO_FATAL_FAILURE(pause("solver" + std::to_string(static_cast<int>(solver))));
  stopServer();
  last.clear();
  for (const auto& member : members) last.push_back(member->tick());
  startAgain();
  ASSERT_TRUE(all([](const Member& member) { return member.firstTicks().size() == 3; }));
  for (std::size_t i = 0; i < members.size(); ++i) {
    EXPECT_TRUE(members[i]->welcomes()[2].resumed());
    EXPECT_GE(members[i]->firstTicks()[2], last[i]) << "an orderly end loses no tick";
  }
}

TEST_F(SavedStateProgram, ScenesComeBackAfterMemoryRanOut) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer's allocator ends the program";
#endif
  // Larger than the memory.
  const Arguments budgets{"--max-memory", "10000"};
  startServer(options(budgets));
  if (address_.empty()) return;
  ASSERT_NO_FATAL_FAILURE(createScene("kept", SolverKind::massSpring));
  ASSERT_NO_FATAL_FAILURE(useUpMemory());
  EXPECT_THAT(server_->errors(), HasSubstr("critical memory ran out, so the server ends with status 71."));

  Arguments json = budgets;
  json.insert(json.end(), {"--log-format", "json"});
  startServer(options(json));
  {
    const Member member(address_, "kept");
    ASSERT_TRUE(eventually([&] { return member.tick() > 0; }));
  }
  ASSERT_NO_FATAL_FAILURE(useUpMemory());
  EXPECT_THAT(server_->errors(), HasSubstr("{\"level\":\"critical\",\"message\":\"memory ran out,"));
  server_.reset();
}

TEST_F(SavedStateProgram, ADamagedDatabaseStopsTheStart) {
  startServer(options());
  if (address_.empty()) return;
  stopServer();
  server_.reset();
  const std::filesystem::path file = directory_.path() / "scenes" / "scenes.sqlite";
  std::ofstream(file, std::ios::binary | std::ios::trunc) << std::string(5000, 'x');
  Arguments command{CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0"};
  const Arguments more = options();
  command.insert(command.end(), more.begin(), more.end());
  Process server(command);
  EXPECT_EQ(server.waitForEnd(kPatience), 1);
  EXPECT_THAT(server.errors(), HasSubstr("scenes.sqlite: is damaged, and nothing in it was changed"));
  EXPECT_EQ(std::filesystem::file_size(file), 5000u);
}

}  // namespace
}  // namespace clothstream::e2e

// SPDX-License-Identifier: MIT
// clothstream-attack: attacks a server that it starts, while an honest client watches a scene of it.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/resource.h>

#include "clients/grpc/grpc_client.h"
#include "tests/attack/attacks.h"
#include "tests/e2e/process.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::attack {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using e2e::Process;

// Goals for the honest client and the server, of the design's requirements.
constexpr double kMinFrames = 0.9, kMaxGapSeconds = 0.25, kMaxMegabytes = 268.4, kMaxEndSeconds = 10;
constexpr auto kPatience = 60s;

double seconds(Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

// Counts the frames that an honest client receives.
class Victim {
 public:
  explicit Victim(const std::string& address) {
    auto joined = GrpcClient::join(address, {}, [this](cs_client*, std::uint32_t events) {
      if ((events & CS_EVENT_FRAME) == 0) return;
      const auto now = Clock::now();
      const std::lock_guard lock(mutex_);
      ++frames_;
      longestGap_ = std::max(longestGap_, now - newest_);
      newest_ = now;
    });
    if (!joined) throw std::runtime_error("the victim cannot join: " + joined.error().text);
    client_ = std::move(*joined);
  }

  void begin() {
    const std::lock_guard lock(mutex_);
    frames_ = 0;
    longestGap_ = {};
    begun_ = newest_ = Clock::now();
  }

  struct Seen {
    double framesPerSecond = 0, longestGap = 0;
  };
  Seen seen() {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    return {.framesPerSecond = static_cast<double>(frames_) / seconds(now - begun_),
            .longestGap = seconds(std::max(longestGap_, now - newest_))};
  }

 private:
  std::mutex mutex_;
  std::uint64_t frames_ = 0;
  Clock::time_point begun_{}, newest_{};
  Clock::duration longestGap_{};
  std::unique_ptr<GrpcClient> client_;
};

// A value of /proc/PID/status in megabytes.
double memoryOf(pid_t id, const std::string& key) {
  std::ifstream status("/proc/" + std::to_string(id) + "/status");
  for (std::string word; status >> word;)
    if (double kilobytes = 0; word == key + ":" && status >> kilobytes) return kilobytes * 1024 / 1e6;
  return 0;
}

struct Result {
  std::string answer;
  Victim::Seen before, during;
  double startMegabytes = 0, peakMegabytes = 0, endSeconds = 0;
  bool ended = false;

  bool reached() const {
    return during.framesPerSecond >= kMinFrames * before.framesPerSecond &&
           during.longestGap <= kMaxGapSeconds && peakMegabytes - startMegabytes <= kMaxMegabytes && ended;
  }
};

Result run(const std::string& self, const std::string& server, const Attack& attack, int attackSeconds) {
  const e2e::TemporaryDirectory directory;
  std::vector<std::string> command{server, "--port", "0", "--grpc-port", "0", "--log-level", "off"};
  if (*attack.serverArguments != '\0')
    command.insert(command.end(), {attack.serverArguments, directory.path().string()});
  Process process(command);
  const auto page = process.waitForLine("page ", kPatience), grpc = process.waitForLine("gRPC ", kPatience);
  if (!page || !grpc) throw std::runtime_error("the server did not start: " + process.errors());
  const std::size_t host = page->find("//") + 2;
  const std::string web = page->substr(host, page->find('/', host) - host);
  const std::string address = grpc->substr(grpc->find_first_not_of(' '));

  Result result;
  {
    Victim victim(address);
    std::this_thread::sleep_for(2s);
    victim.begin();
    std::this_thread::sleep_for(4s);
    result.before = victim.seen();
    result.startMegabytes = memoryOf(process.id(), "VmRSS");
    std::ofstream("/proc/" + std::to_string(process.id()) + "/clear_refs") << 5;  // resets VmHWM
    victim.begin();
    Process attacker({self, "--perform", attack.name, "--grpc", address, "--web", web, "--seconds",
                      std::to_string(attackSeconds)});
    const auto begun = Clock::now();
    attacker.waitForEnd(kPatience);
    // An attack that ends at once may have effects later.
    std::this_thread::sleep_until(begun + std::chrono::seconds(attackSeconds));
    result.during = victim.seen();
    result.peakMegabytes = memoryOf(process.id(), "VmHWM");
    result.answer = attacker.output() + attacker.errors();
    std::ranges::replace(result.answer, '\n', ' ');
    process.signal(SIGTERM);
    const auto asked = Clock::now();
    result.ended = process.waitForEnd(std::chrono::seconds(static_cast<int>(kMaxEndSeconds))) == 0;
    result.endSeconds = seconds(Clock::now() - asked);
  }
  return result;
}

void print(const Attack& attack, const Result& result) {
  fmt::print(
      "{:<18} {} frames/s {:5.1f} -> {:5.1f}  gap {:.3f} s  memory {:4.0f} + {:3.0f} MB  end {:.1f} s\n    "
      "{}\n",
      attack.name, result.reached() ? "ok    " : "FAILED", result.before.framesPerSecond,
      result.during.framesPerSecond, result.during.longestGap, result.startMegabytes,
      std::max(0.0, result.peakMegabytes - result.startMegabytes), result.endSeconds, result.answer);
  std::fflush(stdout);
}

}  // namespace
}  // namespace clothstream::attack

int main(int argc, char** argv) {
  using namespace clothstream;
  CLI::App app{
      "Attacks a server that it starts, and prints what an honest client sees meanwhile. Exit code 1 if a "
      "goal is "
      "missed: 90 % of the frames, no gap above 0.25 s, at most 256 MiB more memory, an end within 10 s."};
  std::string server, perform, grpc, web;
  std::vector<std::string> only;
  int seconds = 6;
  std::vector<std::string> names;
  std::string list = "Attacks to run (default: all):";
  for (const attack::Attack& each : attack::attacks()) {
    names.emplace_back(each.name);
    list += fmt::format("\n  {}: {}", each.name, each.description);
  }
  app.add_option("attacks", only, list)->check(CLI::IsMember(names));
  app.add_option("--server", server, "Program of the server");
  app.add_option("--seconds", seconds, "Seconds of each attack")
      ->check(CLI::Range(1, 600))
      ->capture_default_str();
  // The program runs itself to attack, so that the honest client has a process of its own.
  app.add_option("--perform", perform)->group("");
  app.add_option("--grpc", grpc)->group("");
  app.add_option("--web", web)->group("");
  CLI11_PARSE(app, argc, argv);

  bool reached = true;
  try {
    for (const attack::Attack& each : attack::attacks()) {
      if (!perform.empty()) {
        if (each.name != perform) continue;
        // The attacker's own work must not slow down the server.
        ::setpriority(PRIO_PROCESS, 0, 19);
        fmt::print("{}\n", each.perform({.grpc = grpc, .web = web, .time = std::chrono::seconds(seconds)}));
        continue;
      }
      if (!only.empty() && std::ranges::find(only, each.name) == only.end()) continue;
      const attack::Result result =
          attack::run(std::filesystem::canonical("/proc/self/exe"), server, each, seconds);
      attack::print(each, result);
      reached = reached && result.reached();
    }
  } catch (const std::exception& failure) {
    fmt::print(stderr, "clothstream-attack: {}\n", failure.what());
    return 2;
  }
  return reached ? 0 : 1;
}

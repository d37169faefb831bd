// SPDX-License-Identifier: MIT
// clothstream-attack: attacks a server that it starts, while an honest client watches a scene of it.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/resource.h>

#include "clients/grpc/address.h"
#include "clients/grpc/grpc_client.h"
#include "clients/grpc/identity.h"
#include "tests/attack/attacks.h"
#include "tests/attack/measured_server.h"
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
  explicit Victim(const ServerAddress& address) {
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

// Runs the server's command `token` and returns its output without the line end.
std::string tokenCommand(const std::string& server, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {server, "token"});
  Process process(arguments);
  if (process.waitForEnd(kPatience) != 0) throw std::runtime_error("no token: " + process.errors());
  return process.output().substr(0, process.output().find('\n'));
}

Result run(const std::string& self, const std::string& server, const Attack& attack, int attackSeconds) {
  const e2e::TemporaryDirectory directory;
  std::vector<std::string> options;
  std::istringstream further(attack.serverArguments);
  for (std::string word; further >> word;)
    options.push_back(word == "DIRECTORY" ? directory.path().string() : word);
  std::string token;
  if (attack.access == Access::tokens) {
    const std::string key = directory.path() / "attack.pem";
    tokenCommand(server, {"--new-key", key});
    token = tokenCommand(server, {"--key", key, "--subject", "victim"});
    options.insert(options.end(), {"--token-keys", directory.path().string()});
  } else if (attack.access == Access::pairing) {
    options.insert(options.end(), {"--pairing", "--state-dir", directory.path().string()});
  }
  MeasuredServer target(server, options);
  ServerAddress trusted(target.grpc());
  if (trusted.isEncrypted()) {
    const auto key = target.process().waitForLine("key ", kPatience);
    if (!key) throw std::runtime_error("the server has no key: " + target.process().errors());
    trusted.fingerprint = key->substr(key->find_first_not_of(' '));
  }

  if (attack.access == Access::pairing) {
    const auto code = target.process().waitForLine("pair    ", kPatience);
    const auto paired = pair(trusted, code.value_or("").substr(0, 6));
    if (!paired) throw std::runtime_error("the victim cannot pair: " + paired.error().text);
    token = *paired;
  }
  trusted.token = token;

  Result result;
  {
    Victim victim(trusted);
    std::this_thread::sleep_for(2s);
    victim.begin();
    std::this_thread::sleep_for(4s);
    result.before = victim.seen();
    result.startMegabytes = target.megabytes();
    target.forgetPeak();
    victim.begin();
    Process attacker({self, "--perform", attack.name, "--grpc", trusted.hostAndPort(), "--web", target.web(),
                      "--seconds", std::to_string(attackSeconds)});
    const auto begun = Clock::now();
    attacker.waitForEnd(kPatience);
    // An attack that ends at once may have effects later.
    std::this_thread::sleep_until(begun + std::chrono::seconds(attackSeconds));
    result.during = victim.seen();
    result.peakMegabytes = target.peakMegabytes();
    result.answer = attacker.output() + attacker.errors();
    std::ranges::replace(result.answer, '\n', ' ');
    const std::optional<double> end = target.end(std::chrono::seconds(static_cast<int>(kMaxEndSeconds)));
    result.ended = end.has_value();
    result.endSeconds = end.value_or(kMaxEndSeconds);
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
  // The program runs itself to attack, so that the honest client has a separate process.
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

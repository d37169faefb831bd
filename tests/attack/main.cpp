// SPDX-License-Identifier: MIT
// clothstream-attack: attacks a server that it starts, while an honest client watches a scene of it.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/resource.h>

#include "clients/grpc/identity.h"
#include "clients/native/address.h"
#include "tests/attack/attacks.h"
#include "tests/attack/measured_server.h"
#include "tests/attack/victim.h"
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

struct Result {
  std::string answer;
  Victim::Seen before, during;
  double startMegabytes = 0, peakMegabytes = 0, endSeconds = 0;
  bool ended = false;
  bool expected = false;   // Attack::expected
  bool printable = false;  // the log has no control characters

  bool reached() const {
    return expected && printable && during.framesPerSecond >= kMinFrames * before.framesPerSecond &&
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

// Whether a text has no control characters other than line ends.
bool isPrintable(const std::string& text) {
  // U+0080 to U+009F are C2 80 to C2 9F in UTF-8.
  char before = ' ';
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x20 && c != '\n') || byte == 0x7f || (before == '\xc2' && byte < 0xa0)) return false;
    before = c;
  }
  return true;
}

// The honest client joins the web endpoint if `web` and the server has no TLS.
Result run(const std::string& self, const std::string& server, const Attack& attack, int attackSeconds,
           bool web) {
  const e2e::TemporaryDirectory directory;
  std::vector<std::string> options{"--scene", kVictimScene};
  std::istringstream further(attack.serverArguments);
  for (std::string word; further >> word;)
    options.push_back(word == "DIRECTORY" ? directory.path().string() : word);
  std::string token, othersToken;
  if (attack.access == Access::tokens) {
    const std::string key = directory.path() / "attack.pem";
    tokenCommand(server, {"--new-key", key});
    token = tokenCommand(server, {"--key", key, "--subject", "victim"});
    othersToken = tokenCommand(
        server, {"--key", key, "--subject", "other", "--tenant", "others", "--role", "participant"});
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
    ServerAddress page(target.web());
    page.token = token;
    Victim victim(web && !trusted.isEncrypted() ? page : trusted,
                  web && !trusted.isEncrypted() ? Victim::Endpoint::web : Victim::Endpoint::grpc,
                  attack.datagrams);
    std::this_thread::sleep_for(2s);
    victim.begin();
    std::this_thread::sleep_for(4s);
    result.before = victim.seen();
    result.startMegabytes = target.megabytes();
    target.forgetPeak();
    victim.begin();
    Process attacker({self, "--perform", attack.name, "--grpc", trusted.hostAndPort(), "--web", target.web(),
                      "--seconds", std::to_string(attackSeconds), "--token", othersToken, "--metrics",
                      target.metrics(), "--directory", directory.path().string(), "--process",
                      std::to_string(target.process().id())});
    const auto begun = Clock::now();
    if (!attack.endsDuring) attacker.waitForEnd(std::chrono::seconds(attackSeconds) + kPatience);
    // An attack that ends at once may have effects later.
    std::this_thread::sleep_until(begun + std::chrono::seconds(attackSeconds));
    result.during = victim.seen();
    result.peakMegabytes = target.peakMegabytes();
    const std::optional<double> end = target.end(std::chrono::seconds(static_cast<int>(kMaxEndSeconds)));
    const bool attacked = attacker.waitForEnd(kPatience) == 0;
    result.answer = attacker.output() + attacker.errors();
    std::ranges::replace(result.answer, '\n', ' ');
    if (result.answer.ends_with(' ')) result.answer.pop_back();
    result.expected = attacked && std::regex_match(result.answer, std::regex(attack.expected));
    result.printable = isPrintable(target.process().errors());
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
  if (attack.datagrams)
    fmt::print("    frames in datagrams {:.0f} % -> {:.0f} %\n", 100 * result.before.inDatagrams,
               100 * result.during.inDatagrams);
  if (!result.expected) fmt::print("    expected: {}\n", attack.expected);
  if (!result.printable) fmt::print("    the log has control characters\n");
  std::fflush(stdout);
}

}  // namespace
}  // namespace clothstream::attack

int main(int argc, char** argv) {
  using namespace clothstream;
  CLI::App app{
      "Attacks a server that it starts, and prints what an honest client sees meanwhile. Exit code 1 if a "
      "goal is missed: 90 % of the frames, no gap above 0.25 s, at most 256 MiB more memory, an end within "
      "10 s, the expected answer, and a log without control characters."};
  std::string server, perform;
  attack::Target given{};
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
  app.add_option("--grpc", given.grpc)->group("");
  app.add_option("--web", given.web)->group("");
  app.add_option("--token", given.token)->group("");
  app.add_option("--metrics", given.metrics)->group("");
  app.add_option("--directory", given.directory)->group("");
  app.add_option("--process", given.process)->group("");
  CLI11_PARSE(app, argc, argv);

  // Alternates, so that honest clients of both endpoints are attacked.
  bool reached = true, joinsWeb = false;
  try {
    for (const attack::Attack& each : attack::attacks()) {
      if (!perform.empty()) {
        if (each.name != perform) continue;
        // The attacker's own work must not slow down the server.
        ::setpriority(PRIO_PROCESS, 0, 19);
        std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to connections that the server has closed
        given.time = std::chrono::seconds(seconds);
        fmt::print("{}\n", each.perform(given));
        continue;
      }
      joinsWeb = !joinsWeb;
      if (!only.empty() && std::ranges::find(only, each.name) == only.end()) continue;
      const attack::Result result =
          attack::run(std::filesystem::canonical("/proc/self/exe"), server, each, seconds, joinsWeb);
      attack::print(each, result);
      reached = reached && result.reached();
    }
  } catch (const std::exception& failure) {
    fmt::print(stderr, "clothstream-attack: {}\n", failure.what());
    return 2;
  }
  return reached ? 0 : 1;
}

// SPDX-License-Identifier: MIT
// clothstream-link: two network namespaces with a bad link between them, for tests and benchmarks.
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/prctl.h>
#include <sys/signalfd.h>

#include "tests/link/end.h"
#include "tests/link/forward.h"

namespace clothstream::link {
namespace {

constexpr int kFailure = 1, kWrongArguments = 2, kNotPermitted = 3;
constexpr double kMaxMs = 10'000;  // longer delays would need much memory

// A value for each direction.
struct Both {
  double down, up;
};

struct Options {
  Both delayMs{0, 0}, jitterMs{0, 0}, lossPercent{0, 0}, burstPackets{0, 0}, burstMs{0, 0}, rateMbit{0, 0},
      queueBytes{0, 0}, queueMs{100, 100};
  bool reorder = false;
  std::uint64_t seed = 1;
  std::uint32_t mtu = 1500;
  std::string congestion;
};

double numberOf(const std::string& option, std::string_view text, double least, double most) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= least && value <= most))
    throw CLI::ValidationError(option, fmt::format("'{}' is not a number from {} to {}", text, least, most));
  return value;
}

// Adds an option with one value for both directions, or with two: DOWN:UP.
CLI::Option* addBoth(CLI::App& app, const std::string& name, Both& values, double least, double most,
                     const std::string& description) {
  const auto read = [&values, name, least, most](const std::string& text) {
    const std::size_t colon = text.find(':');
    values.down = numberOf(name, text.substr(0, colon), least, most);
    values.up =
        colon == std::string::npos ? values.down : numberOf(name, text.substr(colon + 1), least, most);
  };
  return app.add_option_function<std::string>(name, read, description)
      ->type_name(fmt::format("{:g}..{:g}[:UP]", least, most));
}

Clock::duration inMs(double ms) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(ms));
}

Conditions conditionsOf(const Options& options, double Both::*way) {
  const double bytesPerSecond = options.rateMbit.*way * 1e6 / 8;
  const bool inBytes = options.queueBytes.*way > 0;
  return {.delay = inMs(options.delayMs.*way),
          .jitter = inMs(options.jitterMs.*way),
          .reorders = options.reorder,
          .loss = options.lossPercent.*way / 100,
          .burstPackets = options.burstPackets.*way,
          .burstTime = inMs(options.burstMs.*way),
          .bytesPerSecond = bytesPerSecond,
          .queueBytes = inBytes ? options.queueBytes.*way : bytesPerSecond * options.queueMs.*way / 1000,
          .seed = options.seed};
}

// Returns the algorithms that this kernel has, with spaces between them.
std::string algorithms() {
  std::ifstream file("/proc/sys/net/ipv4/tcp_available_congestion_control");
  std::string names;
  std::getline(file, names);
  return names;
}

// Throws CLI::ValidationError for options that do not fit together, or not this machine.
void check(const Options& options) {
  for (double Both::*const way : {&Both::down, &Both::up}) {
    const Conditions conditions = conditionsOf(options, way);
    if (const auto error = errorOf(conditions)) throw CLI::ValidationError("--loss, --rate", *error);
    if (conditions.bytesPerSecond > 0 && conditions.queueBytes < options.mtu)
      throw CLI::ValidationError("--queue-bytes, --queue-ms",
                                 "the queue is shorter than one packet of --mtu bytes");
  }
  const std::string names = algorithms();
  if (!options.congestion.empty() &&
      (' ' + names + ' ').find(' ' + options.congestion + ' ') == std::string::npos)
    throw CLI::ValidationError("--congestion",
                               fmt::format("this kernel has no '{}'; it has {}", options.congestion, names));
}

void print(const nlohmann::ordered_json& object) {
  fmt::print("{}\n", object.dump());
  std::fflush(stdout);
}

nlohmann::ordered_json toJson(const End& end) {
  return {{"pid", end.pid()}, {"addresses", end.addresses()}};
}

nlohmann::ordered_json toJson(const Way& way, const End& from) {
  const Statistics& statistics = way.direction.statistics();
  return {{"packets", statistics.packets},
          {"bytes", statistics.bytes},
          {"lost", statistics.lost},
          {"dropped", statistics.dropped},
          {"reordered", statistics.reordered},
          {"queueMsP50", statistics.queue.percentile(50)},
          {"queueMsP99", statistics.queue.percentile(99)},
          {"lateMsP99", way.late.percentile(99)},
          {"overflowed", from.overflowed()},
          {"refused", way.refused}};
}

int run(const Options& options) {
  sigset_t endings;
  sigemptyset(&endings);
  sigaddset(&endings, SIGINT);
  sigaddset(&endings, SIGTERM);
  sigprocmask(SIG_BLOCK, &endings, nullptr);
  const Descriptor signals(signalfd(-1, &endings, SFD_CLOEXEC));
  prctl(PR_SET_TIMERSLACK, 1);  // ns; delays are as exact as sleeps

  const End server({.number = 1, .mtu = options.mtu, .congestion = options.congestion});
  const End client({.number = 2, .mtu = options.mtu, .congestion = options.congestion});
  Way down{
      .from = server.device(), .to = client.device(), .direction = {conditionsOf(options, &Both::down), 0}};
  Way up{.from = client.device(), .to = server.device(), .direction = {conditionsOf(options, &Both::up), 1}};
  print({{"server", toJson(server)}, {"client", toJson(client)}});
  forward(down, up, *signals);
  print({{"down", toJson(down, server)}, {"up", toJson(up, client)}});
  return 0;
}

void addOptions(CLI::App& app, Options& options) {
  addBoth(app, "--delay", options.delayMs, 0, kMaxMs, "Delay of every packet, ms. Default: 0");
  addBoth(app, "--jitter", options.jitterMs, 0, kMaxMs,
          "Added to the delay, uniform from 0 to this, ms. Default: 0");
  app.add_flag("--reorder", options.reorder,
               "Jitter may change the order of packets. Default: they keep their order");
  addBoth(app, "--loss", options.lossPercent, 0, 99, "Percentage of packets that are lost. Default: 0");
  addBoth(app, "--burst-packets", options.burstPackets, 1, 1000,
          "Mean length of bursts, in which all packets are lost. Default: losses are independent");
  addBoth(app, "--burst-ms", options.burstMs, 0.1, kMaxMs, "The same in time, ms; not with --burst-packets");
  addBoth(app, "--rate", options.rateMbit, 0.01, 10'000, "Mbit/s of IP packets. Default: unlimited");
  addBoth(app, "--queue-bytes", options.queueBytes, 1500, 1e9,
          "With --rate: bytes that may wait, the packet that is being sent included; packets without room "
          "are dropped");
  addBoth(app, "--queue-ms", options.queueMs, 1, kMaxMs,
          "With --rate: the same as the time to send them, ms; not used with --queue-bytes. Default: 100");
  app.add_option("--seed", options.seed, "Chooses the losses and the jitter")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53))
      ->capture_default_str();
  app.add_option("--mtu", options.mtu, "Bytes of the largest IP packet")
      ->check(CLI::Range(1280, 9000))
      ->capture_default_str();
  app.add_option(
      "--congestion", options.congestion,
      "Congestion control of TCP at both ends, for example bbr or cubic. Default: that of the kernel");
}

}  // namespace
}  // namespace clothstream::link

int main(int argc, char** argv) {
  using namespace clothstream::link;
  CLI::App app{
      "Joins two network namespaces, server (10.77.0.1, fd77::1) and client (10.77.0.2, fd77::2), by a link "
      "that "
      "delays, loses, reorders and limits IP packets. Prints a line of JSON with a process in each namespace "
      "when the "
      "link is ready, and one with statistics of both directions, down (server to client) and up, after "
      "SIGINT or "
      "SIGTERM. Run a program in a namespace with\n"
      "  nsenter --preserve-credentials --user --net --target PID PROGRAM\n"
      "Needs neither root nor privileges, where user namespaces and /dev/net/tun may be used. The same seed "
      "loses the same packets, by their number in each direction. Exit codes: 0 success; 1 failure; 2 wrong "
      "arguments; 3 namespaces or TUN devices are not permitted here."};
  Options options;
  addOptions(app, options);
  app.final_callback([&] { check(options); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "clothstream-link: {}\n", error.what());
    return kWrongArguments;
  }
  try {
    return run(options);
  } catch (const NotPermitted& error) {
    fmt::print(stderr, "clothstream-link: network namespaces with virtual links are not permitted here: {}\n",
               error.what());
    return kNotPermitted;
  } catch (const std::exception& error) {
    fmt::print(stderr, "clothstream-link: {}\n", error.what());
    return kFailure;
  }
}

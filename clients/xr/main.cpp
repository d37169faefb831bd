// SPDX-License-Identifier: MIT
// `clothstream-xr`: shows a scene of clothstream-server in a headset, or flat.
#include <chrono>
#include <csignal>
#include <ctime>
#include <exception>
#include <stdexcept>
#include <string>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "clients/xr/program_options.h"

namespace {

using namespace clothstream::xr;
using namespace std::chrono_literals;

sigset_t endingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

// Whether the program is asked to end, once or before. Waits for this time.
bool isEnding(std::chrono::nanoseconds wait = 0ns) {
  static bool ends = false;
  const sigset_t signals = endingSignals();
  const timespec timeout{.tv_sec = 0, .tv_nsec = wait.count()};
  ends = ends || sigtimedwait(&signals, nullptr, &timeout) > 0;
  return ends;
}

// Logs the cost of frames once a second.
void logCosts(const Visit& visit, std::uint64_t nowUs) {
  static std::uint64_t nextUs = 0;
  if (nowUs < nextUs || !spdlog::should_log(spdlog::level::debug)) return;
  nextUs = nowUs + 1'000'000;
  const FrameTimes::Summary costs = visit.frameTimes().summary(nowUs);
  if (costs.frames > 0)
    spdlog::debug("{:.1f} frames/s; a frame takes {:.2f} ms of the processor, at most {:.2f} ms",
                  costs.framesPerSecond, costs.cpuMedianMs, costs.cpuMostMs);
}

// Shows frames until the runtime is lost (true) or the program ends (false). Throws an XrError if it is lost
// in a call. Adds 1 to the number of sessions when there is one.
bool showUntilLost(const HeadsetOptions& options, Visit& visit, std::uint64_t& sessions) {
  Headset headset(options, visit);
  if (sessions++ > 0) visit.say("The OpenXR runtime has started again", clothstream_now_us());
  // The runtime ends the session in its own time, but not for longer than this.
  constexpr std::uint64_t kLongestExitUs = 2'000'000;
  std::uint64_t exitUs = 0;
  while (true) {
    switch (headset.step()) {
      case HeadsetStep::restarts:
        return true;
      case HeadsetStep::exits:
        return false;
      case HeadsetStep::runs:
        break;
    }
    const std::uint64_t nowUs = clothstream_now_us();
    logCosts(visit, nowUs);
    if (exitUs == 0 && (isEnding() || visit.leaves())) {
      exitUs = nowUs + kLongestExitUs;
      headset.requestExit();
    }
    if (exitUs != 0 && nowUs > exitUs) return false;
  }
}

// Returns the exit status.
int showInHeadsets(const ProgramOptions& options, Visit& visit) {
  std::string said;
  std::uint64_t lostUs = clothstream_now_us(), sessions = 0;
  while (!isEnding() && !visit.leaves()) {
    const std::uint64_t framesBefore = visit.frameTimes().total(), sessionsBefore = sessions;
    std::string error;
    try {
      if (!showUntilLost(options.headset, visit, sessions)) return 0;
      error = "The OpenXR session is lost";
    } catch (const XrError& lost) {
      error = lost.what();
    } catch (const std::runtime_error& lost) {
      // A device that has drawn frames may do so again; else something is missing.
      if (visit.frameTimes().total() == framesBefore) throw;
      error = lost.what();
    }
    const std::uint64_t nowUs = clothstream_now_us();
    if (sessions > sessionsBefore) {
      spdlog::warn("{}. A new session follows as soon as the OpenXR runtime answers", error);
      lostUs = nowUs;
      said.clear();
    } else if (said != error) {
      spdlog::warn("{}", error);
      said = error;
    }
    if (options.waitForRuntime >= 0 && static_cast<double>(nowUs - lostUs) > options.waitForRuntime * 1e6) {
      spdlog::error("No headset within {} s (--wait)", options.waitForRuntime);
      return 1;
    }
    // The scene goes on without a headset.
    while (clothstream_now_us() - nowUs < 1'000'000 && !isEnding(50ms)) visit.hidden(clothstream_now_us());
  }
  return 0;
}

int showFlat(const ProgramOptions& options, Visit& visit) {
  Flat flat(options.flat, visit);
  while (!isEnding() && flat.step()) logCosts(visit, clothstream_now_us());
  spdlog::info("{}", flat.summary());
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  const sigset_t signals = endingSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  int exitCode = 0;
  const auto options = readOptions(count, arguments, exitCode);
  if (!options) return exitCode;
  spdlog::set_default_logger(spdlog::stderr_color_mt("clothstream-xr"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_level(options->isVerbose ? spdlog::level::debug : spdlog::level::info);
  try {
    openVulkanLoader();
    TextPainter painter(options->font);
    Visit visit(options->connection, painter);
    exitCode = options->isFlat ? showFlat(*options, visit) : showInHeadsets(*options, visit);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    exitCode = 1;
  }
  const std::uint64_t messages = validationMessages() + openXrValidationMessages();
  if (messages > 0) {
    spdlog::error("{} messages of validation layers", messages);
    exitCode = 1;
  }
  return exitCode;
}

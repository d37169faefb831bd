// SPDX-License-Identifier: MIT
// `clothstream-xr`: shows a scene of clothstream-server in a headset, or flat.
#include <chrono>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "clients/xr/ending.h"
#include "clients/xr/program_options.h"

namespace {

using namespace clothstream::xr;
using namespace std::chrono_literals;

constexpr int kFailed = 1, kInvalidOptions = 2;  // exit statuses

// libclothstream does not allow the options; the log says why.
struct OptionsNotAllowed {};

void checkOptions(const Visit& visit) {
  if (visit.connection().isInvalid()) throw OptionsNotAllowed();
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
bool showUntilLost(const HeadsetOptions& options, Visit& visit, const Ending& ending,
                   std::uint64_t& sessions) {
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
    checkOptions(visit);
    if (exitUs == 0 && (ending.isWanted() || visit.leaves())) {
      if (!headset.requestExit()) return false;
      exitUs = nowUs + kLongestExitUs;
    }
    if (exitUs != 0 && nowUs > exitUs) return false;
  }
}

// Returns the exit status.
int showInHeadsets(const ProgramOptions& options, Visit& visit, Ending& ending) {
  std::string said;
  std::uint64_t lostUs = clothstream_now_us(), sessions = 0;
  while (!ending.isWanted() && !visit.leaves()) {
    const std::uint64_t sessionsBefore = sessions;
    std::string error;
    try {
      if (!showUntilLost(options.headset, visit, ending, sessions)) return 0;
      error = "The OpenXR session is lost";
    } catch (const XrError& lost) {
      error = lost.what();
    } catch (const std::runtime_error& lost) {
      // A machine that has drawn frames may do so again; else something is missing.
      if (visit.frameTimes().total() == 0) throw;
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
      return kFailed;
    }
    // The scene goes on without a headset.
    while (clothstream_now_us() - nowUs < 1'000'000 && !ending.wait(50ms)) {
      visit.hidden(clothstream_now_us());
      checkOptions(visit);
    }
  }
  return 0;
}

// Returns the exit status.
int showFlat(const ProgramOptions& options, Visit& visit, const Ending& ending) {
  Flat flat(options.flat, visit);
  for (bool goesOn = true; goesOn && !ending.isWanted();) {
    goesOn = flat.step();
    checkOptions(visit);
    logCosts(visit, clothstream_now_us());
  }
  spdlog::info("{}", flat.summary());
  const Connection& connection = visit.connection();
  if (connection.clientNumber() > 0 || ending.isWanted() || visit.leaves()) return 0;
  spdlog::error("No scene was shown. {}", connection.trouble().title.empty() ? "The server has not answered"
                                                                             : connection.trouble().title);
  return kFailed;
}

// Returns the exit status.
int show(const ProgramOptions& options, Visit& visit, Ending& ending) {
  try {
    return options.isFlat ? showFlat(options, visit, ending) : showInHeadsets(options, visit, ending);
  } catch (const OptionsNotAllowed&) {
    return kInvalidOptions;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kFailed;
  }
}

// Returns the exit status of the program, whose parts have given another one.
int statusOf(int exitCode) {
  const std::uint64_t messages = validationMessages() + openXrValidationMessages();
  if (messages == 0) return exitCode;
  spdlog::error("{} messages of validation layers", messages);
  return kFailed;
}

}  // namespace

int main(int count, char** arguments) {
  Ending ending;
  int exitCode = 0;
  const auto options = readOptions(count, arguments, exitCode);
  if (!options) return exitCode;
  spdlog::set_default_logger(spdlog::stderr_color_mt("clothstream-xr"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_level(options->isVerbose ? spdlog::level::debug : spdlog::level::info);
  // Without a runtime, the loader of OpenXR would explain it in five lines at each attempt.
  if (!options->isVerbose) setenv("XR_LOADER_DEBUG", "none", 0);
  try {
    openVulkanLoader();
    TextPainter painter(options->font);
    Visit visit(options->connection, painter);
    exitCode = show(*options, visit, ending);
    // An attempt to join may wait for the network for seconds, and has nothing to leave.
    if (visit.leave()) std::_Exit(statusOf(exitCode));
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    exitCode = kFailed;
  }
  return statusOf(exitCode);
}

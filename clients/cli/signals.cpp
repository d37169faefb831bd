// SPDX-License-Identifier: MIT
#include "clients/cli/signals.h"

#include <csignal>
#include <ctime>

namespace clothstream::cli {
namespace {

sigset_t endingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

}  // namespace

void blockEndingSignals() {
  const sigset_t signals = endingSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

bool interrupted(std::chrono::milliseconds time) {
  const sigset_t signals = endingSignals();
  const timespec timeout{.tv_sec = time.count() / 1000,
                         .tv_nsec = std::chrono::nanoseconds(time % std::chrono::seconds(1)).count()};
  return sigtimedwait(&signals, nullptr, &timeout) > 0;
}

}  // namespace clothstream::cli

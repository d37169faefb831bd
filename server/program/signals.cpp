// SPDX-License-Identifier: MIT
#include "server/program/signals.h"

#include <algorithm>
#include <ctime>

namespace clothstream::program {
namespace {

int waitFor(const sigset_t& set, std::chrono::nanoseconds timeout) {
  const auto wholeSeconds = std::chrono::duration_cast<std::chrono::seconds>(timeout);
  const timespec limit{static_cast<std::time_t>(wholeSeconds.count()),
                       static_cast<long>((timeout - wholeSeconds).count())};
  return std::max(0, sigtimedwait(&set, nullptr, &limit));
}

}  // namespace

Signals::Signals() {
  sigemptyset(&set_);
  sigemptyset(&ending_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2}) sigaddset(&set_, signal);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&ending_, signal);
  pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a closed peer is reported as an error of its socket
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is reported like a full disk
}

int Signals::wait() const {
  return std::max(0, sigwaitinfo(&set_, nullptr));
}

int Signals::wait(std::chrono::nanoseconds timeout) const {
  return waitFor(set_, timeout);
}

bool Signals::waitForEnd(std::chrono::nanoseconds timeout) const {
  return waitFor(ending_, timeout) != 0;
}

bool Signals::interrupted() const {
  const int signal = wait(std::chrono::nanoseconds(0));
  return signal == SIGINT || signal == SIGTERM;
}

}  // namespace clothstream::program

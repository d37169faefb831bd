// SPDX-License-Identifier: MIT
#include "clients/xr/ending.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <ctime>

#include <spdlog/spdlog.h>

namespace clothstream::xr {
namespace {

sigset_t endingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

}  // namespace

Ending::Ending() {
  const sigset_t signals = endingSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  thread_ = std::thread([this] { watch(); });
}

Ending::~Ending() {
  isOver_ = true;
  pthread_kill(thread_.native_handle(), SIGTERM);
  thread_.join();
}

bool Ending::wait(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, time, [this] { return isWanted_.load(); });
}

void Ending::watch() {
  const sigset_t signals = endingSignals();
  int signal = 0;
  sigwait(&signals, &signal);
  if (isOver_) return;
  {
    const std::lock_guard lock(mutex_);
    isWanted_ = true;
  }
  changed_.notify_all();
  constexpr timespec kLimit{.tv_sec = kLongest.count(), .tv_nsec = 0};
  do {
    signal = sigtimedwait(&signals, nullptr, &kLimit);
  } while (signal < 0 && errno == EINTR);
  if (isOver_) return;
  if (signal < 0)
    spdlog::error(
        "The program is stopped: {} s after a signal, a call of the runtime, a driver or the network "
        "has not returned",
        kLongest.count());
  std::_Exit(signal < 0 ? 1 : 128 + signal);
}

}  // namespace clothstream::xr

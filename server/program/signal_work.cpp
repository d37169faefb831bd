// SPDX-License-Identifier: MIT
#include "server/program/signal_work.h"

#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include <spdlog/spdlog.h>

namespace clothstream::program {

struct SignalWork::State {
  std::mutex mutex;  // protects all
  std::condition_variable changed;
  std::map<int, std::function<void()>> waiting;  // by signal
  bool runs = false, ended = false;

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return ended || !waiting.empty(); });
      if (ended) return;
      std::function<void()> work = std::move(waiting.extract(waiting.begin()).mapped());
      runs = true;
      lock.unlock();
      try {
        work();
      } catch (const std::exception& failure) {  // such as an output that is closed
        spdlog::error("what a signal asked for failed: {}", failure.what());
      }
      work = nullptr;
      lock.lock();
      runs = false;
      changed.notify_all();
    }
  }
};

SignalWork::SignalWork() : state_(std::make_shared<State>()) {
  std::thread([state = state_] { state->run(); }).detach();
}

SignalWork::~SignalWork() {
  std::unique_lock lock(state_->mutex);
  state_->ended = true;
  state_->waiting.clear();
  state_->changed.notify_all();
  state_->changed.wait_for(lock, kPatience, [this] { return !state_->runs; });
}

void SignalWork::post(int signal, std::function<void()> work) {
  {
    const std::lock_guard lock(state_->mutex);
    state_->waiting.insert_or_assign(signal, std::move(work));
  }
  state_->changed.notify_all();
}

}  // namespace clothstream::program

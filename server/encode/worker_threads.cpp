// SPDX-License-Identifier: MIT
#include "server/encode/worker_threads.h"

#include <algorithm>

#include "server/telemetry/thread_name.h"

namespace clothstream::encode {

WorkerThreads::WorkerThreads(std::uint32_t threads) {
  try {
    for (std::uint32_t i = 1; i < threads; ++i) threads_.emplace_back([this] { help(); });
  } catch (...) {
    stop();
    throw;
  }
}

WorkerThreads::~WorkerThreads() {
  stop();
}

void WorkerThreads::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  called_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerThreads::run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) {
  Call call{.piece = piece, .pieces = pieces};
  if (pieces < 2 || threads_.empty()) return call.work();
  {
    const std::lock_guard lock(mutex_);
    calls_.push_back(&call);
  }
  if (pieces > threads_.size())
    called_.notify_all();
  else
    for (std::uint32_t i = 1; i < pieces; ++i) called_.notify_one();
  call.work();
  std::unique_lock lock(mutex_);
  std::erase(calls_, &call);
  helped_.wait(lock, [&] { return call.helpers == 0; });
}

void WorkerThreads::help() {
  telemetry::nameThread("worker");
  std::unique_lock lock(mutex_);
  for (;;) {
    called_.wait(lock, [&] { return !calls_.empty() || stopping_; });
    if (calls_.empty()) return;
    Call& call = *calls_.front();
    ++call.helpers;
    lock.unlock();
    call.work();
    lock.lock();
    std::erase(calls_, &call);
    if (--call.helpers == 0) helped_.notify_all();
  }
}

std::uint32_t WorkerThreads::suitedTo(std::uint32_t processors) {
  return std::clamp(processors / 4, 1u, 8u);
}

}  // namespace clothstream::encode

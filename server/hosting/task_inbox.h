// SPDX-License-Identifier: MIT
// Tasks and wake-ups for a thread that waits until its work is due.
#pragma once

#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <utility>
#include <vector>

#include "server/schedule/clock.h"

namespace clothstream::hosting {

using schedule::Clock;

// Thread-safe. The second half belongs to the thread that runs the tasks.
class TaskInbox {
 public:
  // The future throws what the task throws, or std::future_error if the inbox ends first.
  std::future<void> post(std::packaged_task<void()> task) {
    std::future<void> done = task.get_future();
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    wake();
    return done;
  }
  // Ends the present or the next waitForWork().
  void wake() {
    {
      const std::lock_guard lock(mutex_);
      woken_ = true;
    }
    changed_.notify_all();
  }
  // The thread must end.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
  }

  // Waits until this time, wake() or stop(). Returns false when the thread must end.
  bool waitForWork(Clock::time_point due) {
    const auto something = [&] { return stopping_ || woken_; };
    std::unique_lock lock(mutex_);
    if (due != Clock::time_point::max())
      changed_.wait_until(lock, due, something);
    else
      changed_.wait(lock, something);
    woken_ = false;
    return !stopping_;
  }
  // Waits until this time or stop(). Returns false when the thread must end.
  bool pauseUntil(Clock::time_point time) {
    std::unique_lock lock(mutex_);
    return !changed_.wait_until(lock, time, [&] { return stopping_; });
  }
  // Runs the tasks that were posted before this call.
  void runTasks() {
    std::vector<std::packaged_task<void()>> tasks;
    {
      const std::lock_guard lock(mutex_);
      tasks.swap(tasks_);
    }
    for (std::packaged_task<void()>& task : tasks) task();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  bool woken_ = true;  // the thread first looks for work
  std::vector<std::packaged_task<void()>> tasks_;
};

}  // namespace clothstream::hosting

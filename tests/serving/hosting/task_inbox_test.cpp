// SPDX-License-Identifier: MIT
#include "server/hosting/task_inbox.h"

#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>

#include <gtest/gtest.h>

namespace clothstream::hosting {
namespace {

using namespace std::chrono_literals;

TEST(TaskInbox, FirstWaitEndsAtOnce) {
  TaskInbox inbox;
  EXPECT_TRUE(inbox.waitForWork(Clock::time_point::max()));
}

TEST(TaskInbox, WaitsUntilWorkIsDue) {
  TaskInbox inbox;
  inbox.waitForWork({});
  const Clock::time_point due = Clock::now() + 10ms;
  EXPECT_TRUE(inbox.waitForWork(due));
  EXPECT_GE(Clock::now(), due);
}

TEST(TaskInbox, TaskEndsTheWaitAndRuns) {
  TaskInbox inbox;
  inbox.waitForWork({});
  std::promise<std::thread::id> ran;
  std::future<void> done, failed;
  std::jthread other([&] {
    done = inbox.post(std::packaged_task<void()>([&] { ran.set_value(std::this_thread::get_id()); }));
    failed = inbox.post(std::packaged_task<void()>([] { throw std::runtime_error("problem"); }));
  });
  EXPECT_TRUE(inbox.waitForWork(Clock::time_point::max()));
  other.join();
  inbox.runTasks();
  done.get();
  EXPECT_EQ(ran.get_future().get(), std::this_thread::get_id());
  EXPECT_THROW(failed.get(), std::runtime_error);
}

TEST(TaskInbox, RunsLaterTasksAtTheNextCall) {
  TaskInbox inbox;
  std::future<void> second;
  const std::future<void> first =
      inbox.post(std::packaged_task<void()>([&] { second = inbox.post(std::packaged_task<void()>([] {})); }));
  inbox.runTasks();
  EXPECT_EQ(second.wait_for(0s), std::future_status::timeout);
  inbox.runTasks();
  EXPECT_EQ(second.wait_for(0s), std::future_status::ready);
}

TEST(TaskInbox, StopEndsEveryWait) {
  TaskInbox inbox;
  inbox.wake();
  EXPECT_TRUE(inbox.pauseUntil(Clock::now() + 1ms)) << "no wake-up ends a pause";
  inbox.stop();
  EXPECT_FALSE(inbox.pauseUntil(Clock::now() + 1h));
  EXPECT_FALSE(inbox.waitForWork(Clock::time_point::max()));
}

TEST(TaskInbox, UnrunTaskBreaksItsPromise) {
  std::future<void> done;
  {
    TaskInbox inbox;
    done = inbox.post(std::packaged_task<void()>([] {}));
  }
  EXPECT_THROW(done.get(), std::future_error);
}

}  // namespace
}  // namespace clothstream::hosting

// SPDX-License-Identifier: MIT
// Work that signals ask for.
#include "server/program/signal_work.h"

#include <csignal>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

namespace clothstream::program {
namespace {

TEST(SignalWork, RunsWorkAndContinuesAfterAFailure) {
  SignalWork work;
  work.post(SIGHUP, [] { throw std::runtime_error("as in a test"); });
  std::promise<void> done;
  work.post(SIGUSR1, [&] { done.set_value(); });
  done.get_future().wait();
}

// Reading a file of a disk that hangs does not return. Work that waits is dropped.
TEST(SignalWork, ItsEndDoesNotWaitForWorkThatBlocks) {
  const auto answer = std::make_shared<std::promise<void>>();
  std::promise<void> blocks, returned;
  std::weak_ptr<int> waiting;
  {
    std::optional<SignalWork> work;
    work.emplace();
    work->post(SIGHUP, [answer, &blocks, &returned] {
      blocks.set_value();
      answer->get_future().wait();
      returned.set_value();
    });
    blocks.get_future().wait();
    auto owned = std::make_shared<int>();
    waiting = owned;
    work->post(SIGUSR1, [owned = std::move(owned)] {});
    work.reset();
  }
  EXPECT_TRUE(waiting.expired());
  answer->set_value();
  returned.get_future().wait();
}

TEST(SignalWork, NewerWorkOfASignalReplacesWhatWaits) {
  SignalWork work;
  std::promise<void> blocks, answer, done;
  int runs = 0;
  work.post(SIGHUP, [&] {
    blocks.set_value();
    answer.get_future().wait();
  });
  blocks.get_future().wait();
  for (int i = 0; i < 3; ++i) work.post(SIGUSR1, [&] { ++runs; });
  work.post(SIGUSR2, [&] { done.set_value(); });  // runs after work of SIGUSR1, whose number is lower
  answer.set_value();
  done.get_future().wait();
  EXPECT_EQ(runs, 1);
}

}  // namespace
}  // namespace clothstream::program

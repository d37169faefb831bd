// SPDX-License-Identifier: MIT
#include "server/telemetry/thread_name.h"

#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>

namespace clothstream::telemetry {
namespace {

TEST(ThreadName, IsThatOfTheCallingThread) {
  std::string seen;
  std::thread([&] {
    nameThread("scene loader");
    char name[16];
    ASSERT_EQ(pthread_getname_np(pthread_self(), name, sizeof name), 0);
    seen = name;
  }).join();
  EXPECT_EQ(seen, "scene loader");
}

}  // namespace
}  // namespace clothstream::telemetry

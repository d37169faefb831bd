// SPDX-License-Identifier: MIT
// clothstream-server on a device that a Vulkan layer lets it lose.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "tests/e2e/server_test.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

using LostDevice = ServerTest;

TEST_F(LostDevice, TheStreamGoesOnFromTheLastCheckpoint) {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "lose";
  setenv("VK_ADD_LAYER_PATH", CLOTHSTREAM_LAYERS, 1);
  setenv("VK_INSTANCE_LAYERS", "VK_LAYER_CLOTHSTREAM_lost_device", 1);
  setenv("CLOTHSTREAM_LOSE_DEVICE", file.c_str(), 1);
  startServer();
  for (const char* name : {"VK_ADD_LAYER_PATH", "VK_INSTANCE_LAYERS", "CLOTHSTREAM_LOSE_DEVICE"})
    unsetenv(name);
  if (address_.empty()) return;

  std::atomic<std::uint64_t> tick{0}, frames{0}, mismatches{0};
  std::atomic<int> cuts{0}, notices{0}, stepsBack{0};
  auto joined = GrpcClient::join(address_, {}, [&](cs_client* client, std::uint32_t events) {
    if (events == 0) ++cuts;
    if ((events & CS_EVENT_NOTICE) != 0) ++notices;
    if ((events & CS_EVENT_FRAME) == 0) return;
    cs_statistics now;
    cs_get_statistics(client, GrpcClient::nowUs(), &now);
    if (now.tick <= tick) ++stepsBack;
    tick = now.tick;
    mismatches = now.hash_mismatches;
    frames = now.frames;
  });
  ASSERT_TRUE(joined.has_value()) << joined.error().text;
  // More than once: what is made anew can be lost, too.
  for (int loss = 1; loss <= 2; ++loss) {
    const std::uint64_t before = frames;
    ASSERT_TRUE(eventually([&] { return frames >= before + 90; }));
    std::ofstream(file).flush();
    const auto lost = Clock::now();
    ASSERT_TRUE(eventually([&] { return notices >= loss; }));
    const std::uint64_t then = frames;
    ASSERT_TRUE(eventually([&] { return frames > then; }));
    std::printf("device lost: the stream goes on after %.0f ms\n",
                std::chrono::duration<double, std::milli>(Clock::now() - lost).count());
  }
  EXPECT_EQ(mismatches, 0u);
  EXPECT_EQ(stepsBack, 0);
  EXPECT_EQ(cuts, 0);
  joined->reset();
  stopServer();
  EXPECT_THAT(server_->errors() + server_->output(), HasSubstr("VK_ERROR_DEVICE_LOST"));
  EXPECT_THAT(server_->output(), ::testing::ContainsRegex("device rebuilds 2"));
}

}  // namespace
}  // namespace clothstream::e2e

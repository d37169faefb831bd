// SPDX-License-Identifier: MIT
// Fixture of the tests that run the real clothstream-server.
#pragma once

#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/e2e/process.h"
#include "tests/support/eventually.h"

namespace clothstream::e2e {

// Enough for sanitizers, validation and software Vulkan on a busy machine.
inline constexpr std::chrono::seconds kPatience{60};

using tests::eventually;

class RunningServer : public ::testing::Test {
 protected:
  using Arguments = std::vector<std::string>;
  static inline const Arguments kSmallScene{"--scene", "small", "--scene-file", "tests/e2e/small.json"};

  // Uses free ports unless `grpcPort` is given. Leaves address_ empty if the server does not start; then the
  // test is skipped (no Vulkan) or has failed.
  void startServer(const Arguments& more = kSmallScene, const std::string& grpcPort = "0") {
    Arguments command{CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", grpcPort};
    command.insert(command.end(), more.begin(), more.end());
    server_ = std::make_unique<Process>(command);
    const auto page = server_->waitForLine("page ", kPatience),
               grpc = server_->waitForLine("gRPC ", kPatience);
    if (page && grpc) {
      const std::size_t host = page->find("//") + 2;
      web_ = page->substr(host, page->find('/', host) - host);
      address_ = grpc->substr(grpc->find_first_not_of(' '));
      return;
    }
    server_->waitForEnd(kPatience);
    if (server_->errors().find("no Vulkan") != std::string::npos) GTEST_SKIP() << server_->errors();
    FAIL() << "the server did not start: " << server_->errors();
  }
  void stopServer() {
    server_->signal(SIGTERM);
    EXPECT_TRUE(server_->waitForEnd(kPatience).has_value());
    EXPECT_THAT(server_->errors(), ::testing::Not(::testing::HasSubstr("Validation")));
  }
  void TearDown() override {
    if (!server_) return;
    stopServer();
    if (HasFailure()) std::cerr << "Output of the server:\n" << server_->output() << server_->errors();
  }

  static std::uint16_t portIn(const std::string& address) {
    return static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  }

  std::unique_ptr<Process> server_;
  std::string address_, web_;  // HOST:PORT of gRPC and of the page
};

}  // namespace clothstream::e2e

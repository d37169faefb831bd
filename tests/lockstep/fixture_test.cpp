// SPDX-License-Identifier: MIT
// <clothstream/testing.h>: how it starts and ends the server. examples/testing has its usual use.
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include <clothstream/testing.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::testing {
namespace {

using ::testing::HasSubstr;

class ServerFixture : public ::testing::Test {
 protected:
  void SetUp() override { ::setenv("CLOTHSTREAM_SERVER", CLOTHSTREAM_SERVER_PROGRAM, 1); }
  static std::string whyNot(const std::vector<std::string>& arguments) {
    try {
      const Server server(arguments);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "it started";
  }
};

TEST_F(ServerFixture, ShowsTheLogOfAProgramThatDoesNotStart) {
  const std::string why = whyNot({"play", "missing.mcap"});
  EXPECT_THAT(why, HasSubstr("ended; set CLOTHSTREAM_SERVER to the program. Its log:"));
  EXPECT_THAT(why, HasSubstr("missing.mcap"));
}

TEST_F(ServerFixture, SaysWhatToSetIfThereIsNoProgram) {
  ::setenv("CLOTHSTREAM_SERVER", "/nowhere/clothstream-server", 1);
  EXPECT_THAT(whyNot({}), HasSubstr("/nowhere/clothstream-server"));
  EXPECT_THAT(whyNot({}), HasSubstr("set CLOTHSTREAM_SERVER"));
}

TEST_F(ServerFixture, EndsTheServerAndReturnsItsExitCode) {
  const auto server = Server::playing("examples/testing/cloth.mcap");
  EXPECT_THAT(server->address(), HasSubstr("http://127.0.0.1:"));
  EXPECT_EQ(server->stop(), 0);
  EXPECT_THAT(server->log(), HasSubstr("stopping"));
  EXPECT_EQ(server->stop(), 0);
}

TEST_F(ServerFixture, KillsAServerThatDoesNotEnd) {
  const auto server = Server::playing("examples/testing/cloth.mcap");
  server->signal(SIGSTOP);
  EXPECT_EQ(server->stop(std::chrono::milliseconds(100)), -SIGKILL);
}

}  // namespace
}  // namespace clothstream::testing

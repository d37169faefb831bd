// SPDX-License-Identifier: MIT
// Joining, refusals and leaving, with a server and with a silent port.
#include "clients/xr/connection/connection.h"

#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/e2e/server_process.h"
#include "tests/xr/drawn.h"

namespace clothstream::xr {
namespace {

using clothstream::tests::ServerProcess;
using testing::HasSubstr;

ConnectionOptions optionsFor(const std::string& address, const std::string& scene = "",
                             std::uint32_t timeoutMs = 10'000) {
  ConnectionOptions options;
  options.address = address;
  options.scene = scene;
  options.joinTimeoutMs = timeoutMs;
  return options;
}

// Updates the connection as a program does until it is as wanted. Returns whether this happens within 30 s.
bool follow(Connection& connection, const std::function<bool()>& isWanted) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!isWanted()) {
    if (std::chrono::steady_clock::now() > end) return false;
    connection.update(clothstream_now_us());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

// Accepts connections on a port, and says nothing.
class SilentPort {
 public:
  SilentPort() : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    const bool listens =
        bind(socket_, any, size) == 0 && listen(socket_, 8) == 0 && getsockname(socket_, any, &size) == 0;
    EXPECT_TRUE(listens);
    name_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~SilentPort() {
    close(socket_);
    if (client_ >= 0) close(client_);
  }
  SilentPort(const SilentPort&) = delete;
  SilentPort& operator=(const SilentPort&) = delete;
  const std::string& name() const { return name_; }
  // Waits for a client.
  void accept() { client_ = ::accept(socket_, nullptr, nullptr); }

 private:
  int socket_, client_ = -1;
  std::string name_;
};

TEST(XrConnection, OptionsThatCannotSucceedAreFinal) {
  Connection connection(optionsFor("no host:here"));
  ASSERT_TRUE(follow(connection, [&] { return connection.isInvalid(); }));
  EXPECT_EQ(connection.phase(), Phase::refused);
  EXPECT_THAT(connection.trouble().advice, HasSubstr("no host:here"));
}

TEST(XrConnection, LeavingDoesNotWaitForASilentServer) {
  SilentPort port;
  Connection connection(optionsFor(port.name(), "", 500));
  port.accept();
  // It would return false after the attempt has ended.
  EXPECT_TRUE(connection.leave());
}

TEST(XrConnection, SilentServerIsTriedAgain) {
  const SilentPort port;
  Connection connection(optionsFor(port.name(), "", 100));
  ASSERT_TRUE(follow(connection, [&] { return connection.phase() == Phase::waiting; }));
  EXPECT_THAT(connection.trouble().advice, HasSubstr(port.name()));
  EXPECT_FALSE(connection.isInvalid());
}

class XrConnectionWithServer : public testing::Test {
 protected:
  // A server takes a second to start, most of which is its device.
  static void SetUpTestSuite() {
    const tests::Device device;
    why_ = device.why();
    if (!device.get()) return;
    server_ = std::make_unique<ServerProcess>(
        std::vector<std::string>{"--port", "0", "--grpc-port", "0", "--scene", "solver_mass_spring"});
    address_ = "127.0.0.1:" + std::to_string(server_->portIn(server_->lineWith("page    http")));
  }
  static void TearDownTestSuite() { server_.reset(); }
  void SetUp() override {
    if (!server_) GTEST_SKIP() << "no Vulkan device: " << why_;
  }

  static inline std::unique_ptr<ServerProcess> server_;
  static inline std::string address_, why_;
};

TEST_F(XrConnectionWithServer, RefusedChoiceLeavesTheUserInTheScene) {
  Connection connection(optionsFor(address_));
  ASSERT_TRUE(follow(connection, [&] { return connection.phase() == Phase::live; }));
  connection.join("nowhere");
  std::string notice;
  ASSERT_TRUE(follow(connection, [&] { return !(notice = connection.takeNotice()).empty(); }));
  EXPECT_THAT(notice, HasSubstr("nowhere"));
  ASSERT_TRUE(follow(connection, [&] { return connection.phase() == Phase::live; }));
  EXPECT_EQ(connection.trouble(), Trouble{});
  EXPECT_EQ(connection.clientNumber(), 1U);
  EXPECT_EQ(connection.options().scene, "");
  EXPECT_EQ(connection.takeNotice(), "");
  EXPECT_FALSE(connection.leave());
}

TEST_F(XrConnectionWithServer, RefusedStartWaitsForAnotherChoice) {
  Connection connection(optionsFor(address_, "nowhere"));
  ASSERT_TRUE(follow(connection, [&] { return connection.phase() == Phase::refused; }));
  EXPECT_EQ(connection.trouble().title, "The server refused to let you in");
  EXPECT_THAT(connection.trouble().advice, HasSubstr("nowhere"));
  EXPECT_FALSE(connection.isInvalid());
  connection.join("");
  ASSERT_TRUE(follow(connection, [&] { return connection.phase() == Phase::live; }));
  EXPECT_EQ(connection.trouble(), Trouble{});
}

}  // namespace
}  // namespace clothstream::xr

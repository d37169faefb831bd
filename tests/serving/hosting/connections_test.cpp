// SPDX-License-Identifier: MIT
// The number of peers, and their end.
#include "server/hosting/connections.h"

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "server/delivery/envelope.h"

namespace clothstream::hosting {
namespace {

struct CountingPeer : Peer {
  void close(delivery::SharedBytes /*last*/) override { ++closed; }
  void checkSilence(schedule::Clock::time_point /*now*/) override {}
  int closed = 0;
};

class ConnectionsTest : public ::testing::Test {
 protected:
  static ServerOptions limited() {
    ServerOptions options;
    options.maxConnections = 2;
    options.maxConnectionsPerToken = 2;
    return options;
  }
  static Identity verified(const std::string& name) {
    Identity identity;
    identity.verified = true;
    identity.subject.name = name;
    return identity;
  }

  const ServerOptions options_ = limited();
  telemetry::ServerMetrics metrics_;
  Connections connections_{options_, metrics_};
};

TEST_F(ConnectionsTest, EndedPeersMakeRoom) {
  const auto first = std::make_shared<CountingPeer>();
  auto second = std::make_shared<CountingPeer>();
  EXPECT_FALSE(connections_.admit(first));
  EXPECT_FALSE(connections_.admit(second));
  EXPECT_TRUE(connections_.admit(std::make_shared<CountingPeer>())) << "the last message of a refused peer";
  second.reset();
  EXPECT_EQ(connections_.peers().size(), 1u);
  EXPECT_FALSE(connections_.admit(std::make_shared<CountingPeer>()));
  EXPECT_EQ(metrics_.connections.value(), 3u);
}

TEST_F(ConnectionsTest, CloseEndsPresentAndFuturePeers) {
  const auto early = std::make_shared<CountingPeer>(), late = std::make_shared<CountingPeer>();
  EXPECT_FALSE(connections_.admit(early));
  connections_.close();
  EXPECT_EQ(early->closed, 1);
  EXPECT_TRUE(connections_.admit(late));
  EXPECT_EQ(connections_.peers().size(), 1u);
}

TEST_F(ConnectionsTest, CountsConnectionsOfEachSubject) {
  auto first = connections_.count(verified("ann"));
  const auto second = connections_.count(verified("ann"));
  EXPECT_TRUE(first && second);
  EXPECT_FALSE(connections_.count(verified("ann")));
  EXPECT_TRUE(connections_.count(verified("bob")));
  first.reset();
  EXPECT_TRUE(connections_.count(verified("ann")));
}

TEST_F(ConnectionsTest, UnverifiedPeersAreNotCounted) {
  std::shared_ptr<const void> counted[3];
  for (auto& one : counted) {
    one = connections_.count(identity::local());
    EXPECT_TRUE(one);
  }
}

}  // namespace
}  // namespace clothstream::hosting

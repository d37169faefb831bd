// SPDX-License-Identifier: MIT
// Host fields of the server's own names, and of names that rebinding attacks use.
#include "server/endpoint/web/host_names.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace clothstream::endpoint {
namespace {

TEST(HostNames, ContainAddressesAndNamesOfTheMachine) {
  const HostNames names({"Cloth.Example.org"});
  char machine[256] = {};
  ASSERT_EQ(gethostname(machine, sizeof machine - 1), 0);
  for (const std::string& host :
       {std::string("127.0.0.1:8080"), std::string("192.168.1.7"), std::string("[::1]:8080"),
        std::string("[fe80::1]"), std::string("localhost"), std::string("LOCALHOST:8080"),
        std::string("localhost.:8080"), std::string("cloth.example.org"),
        std::string("cloth.example.org:443"), std::string(machine), machine + std::string(".local:8080"),
        std::string()})
    EXPECT_TRUE(names.contains(host)) << host;
}

TEST(HostNames, LackForeignNames) {
  const HostNames names({"cloth.example.org"});
  for (const char* host :
       {"evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example",
        "example.org", "xcloth.example.org", "[evil]", "[", ":8080", "127.0.0.1@evil.example"})
    EXPECT_FALSE(names.contains(host)) << host;
}

TEST(HostNames, ContainEveryNameWithAStar) {
  EXPECT_TRUE(HostNames({"*"}).contains("evil.example:8080"));
}

}  // namespace
}  // namespace clothstream::endpoint

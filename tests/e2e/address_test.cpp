// SPDX-License-Identifier: MIT
// Server addresses as users write them.
#include "clients/native/address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream {
namespace {

using ::testing::HasSubstr;

TEST(Address, WithoutPortGets50051) {
  EXPECT_EQ(completeAddress("localhost"), "localhost:50051");
  EXPECT_EQ(completeAddress("10.0.0.7"), "10.0.0.7:50051");
  EXPECT_EQ(completeAddress("::1"), "[::1]:50051");
  EXPECT_EQ(completeAddress("[::1]"), "[::1]:50051");
}

TEST(Address, KeepsItsPort) {
  EXPECT_EQ(completeAddress("cloth.example:6000"), "cloth.example:6000");
  EXPECT_EQ(completeAddress("[fe80::1]:6000"), "[fe80::1]:6000");
  EXPECT_EQ(completeAddress("https://cloth.example"), "https://cloth.example:50051");
  EXPECT_EQ(completeAddress("https://[::1]:6000/"), "https://[::1]:6000");
}

TEST(Address, HasOtherPortAndSchemesForWebEndpoint) {
  const auto complete = [](const char* text) { return completeAddress(text, Endpoint::web); };
  EXPECT_EQ(complete("localhost"), "localhost:8080");
  EXPECT_EQ(complete("ws://localhost/"), "localhost:8080");
  EXPECT_EQ(complete("http://localhost:81/"), "localhost:81");
  EXPECT_EQ(complete("wss://cloth.example"), "https://cloth.example:8080");
  EXPECT_EQ(complete("https://[::1]:6000/"), "https://[::1]:6000");
  for (const char* text : {"ftp://host", "ws://", "wss://host:80/stream", "ws://host:0"})
    EXPECT_FALSE(complete(text)) << text;
  EXPECT_FALSE(completeAddress("wss://host"));
}

TEST(Address, IsSplitIntoHostAndPort) {
  const ServerAddress v6("https://[fe80::1]:6000"), name("cloth.example:80");
  EXPECT_EQ(v6.host() + " " + v6.port(), "fe80::1 6000");
  EXPECT_EQ(name.host() + " " + name.port(), "cloth.example 80");
}

TEST(Address, IsLoopbackOnThisMachineOnly) {
  for (const char* text : {"localhost", "127.0.0.1", "127.1.2.3:60", "::1", "https://localhost:6000"})
    EXPECT_TRUE(ServerAddress(*completeAddress(text)).isLoopback()) << text;
  for (const char* text : {"10.0.0.7", "127.example.org", "127.1.2", "127.1.2.256", "localhost.example.org",
                           "https://[fe80::1]:6000"})
    EXPECT_FALSE(ServerAddress(*completeAddress(text)).isLoopback()) << text;
}

TEST(Address, IsRefusedWithReason) {
  for (const char* text : {"", ":50051", "http://host", "https://", "a b", "[::1", "[]:1"}) {
    const auto address = completeAddress(text);
    ASSERT_FALSE(address) << text;
    EXPECT_THAT(address.error(), HasSubstr("the address"));
  }
  for (const char* text : {"host:", "host:0", "host:65536", "host:x", "host:1x", "[::1]50051"}) {
    const auto address = completeAddress(text);
    ASSERT_FALSE(address) << text;
    EXPECT_THAT(address.error(), HasSubstr("1 to 65535")) << text;
  }
}

}  // namespace
}  // namespace clothstream

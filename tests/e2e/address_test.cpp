// SPDX-License-Identifier: MIT
// Server addresses as users write them.
#include "clients/grpc/address.h"

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

TEST(Address, IsLoopbackOnThisMachineOnly) {
  for (const char* text : {"localhost", "127.0.0.1", "127.1.2.3:60", "::1", "https://localhost:6000"})
    EXPECT_TRUE(ServerAddress(*completeAddress(text)).isLoopback()) << text;
  for (const char* text : {"10.0.0.7", "127.example.org", "localhost.example.org", "https://[fe80::1]:6000"})
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

// SPDX-License-Identifier: MIT
// Addresses of webhooks.
#include "server/events/url.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::events {
namespace {

TEST(EventsUrl, HasHostPortAndTarget) {
  const auto whole = parseUrl("https://hooks.example.org:8443/cloth/in?key=1");
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->encrypted);
  EXPECT_EQ(whole->host, "hooks.example.org");
  EXPECT_EQ(whole->port, "8443");
  EXPECT_EQ(whole->target, "/cloth/in?key=1");
  EXPECT_EQ(whole->authority, "hooks.example.org:8443");

  const auto shortest = parseUrl("http://backend");
  ASSERT_TRUE(shortest);
  EXPECT_FALSE(shortest->encrypted);
  EXPECT_EQ(shortest->host, "backend");
  EXPECT_EQ(shortest->port, "80");
  EXPECT_EQ(shortest->target, "/");
  EXPECT_EQ(shortest->authority, "backend");

  EXPECT_EQ(parseUrl("https://a.b")->port, "443");
  EXPECT_EQ(parseUrl("http://a?b=c")->target, "/?b=c");
}

TEST(EventsUrl, AcceptsAddresses) {
  const auto v6 = parseUrl("http://[::1]:9000/x");
  ASSERT_TRUE(v6);
  EXPECT_EQ(v6->host, "::1");
  EXPECT_EQ(v6->port, "9000");
  EXPECT_EQ(v6->authority, "[::1]:9000");
  EXPECT_EQ(parseUrl("http://[fe80::2]/")->port, "80");
  EXPECT_EQ(parseUrl("http://10.0.0.5:1/")->host, "10.0.0.5");
}

TEST(EventsUrl, ErrorsSayWhatIsWrongAndWhatToUse) {
  const auto refuses = [](const std::string& text, const char* why) {
    const auto url = parseUrl(text);
    ASSERT_FALSE(url) << text;
    EXPECT_THAT(url.error(), testing::HasSubstr(why));
    EXPECT_THAT(url.error(), testing::HasSubstr("; use http://HOST:PORT/PATH or https://HOST/PATH"));
  };
  refuses("", "begins with neither http:// nor https://");
  refuses("backend:9000", "begins with neither");
  refuses("ftp://backend/", "begins with neither");
  refuses("http://", "has no valid host");
  refuses("http:///x", "has no valid host");
  refuses("http://:80/", "has no valid host");
  refuses("http://a,b/", "has no valid host");
  refuses("http://[::1/", "has no valid host");
  refuses("http://[]:1/", "has no valid host");
  refuses("http://a:/", "has a port that is not 1 to 65535");
  refuses("http://a:0/", "has a port");
  refuses("http://a:70000/", "has a port");
  refuses("http://a:80x/", "has a port");
  refuses("http://[::1]x:80/", "has no valid host");
  refuses("http://me:word@a/", "has a user name or a password");
  refuses("http://a/#b", "has a fragment");
  refuses("http://a/b c", "has a character that a URL cannot have");
  refuses("http://a/\r\nx: y", "has a character");
  refuses("http://\xc3\xa9/", "has a character");
}

}  // namespace
}  // namespace clothstream::events

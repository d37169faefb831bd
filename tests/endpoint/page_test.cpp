// SPDX-License-Identifier: MIT
// Page::find(): files of the directory are found, and nothing else is.
#include "server/endpoint/web/page.h"

#include <fstream>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/endpoint/page_directory.h"

namespace clothstream::endpoint {
namespace {

using tests::PageDirectory;

TEST(Page, FindsFileWithContentTypeAndEntityTag) {
  const PageDirectory directory;
  directory.write("index.html", "<html>");
  directory.write("assets/core.wasm", "wasm");
  const Page page(directory.path());
  ASSERT_NE(page.find("/index.html"), nullptr);
  EXPECT_EQ(page.find("/index.html")->contentType, "text/html; charset=utf-8");
  ASSERT_NE(page.find("/assets/core.wasm"), nullptr);
  EXPECT_EQ(page.find("/assets/core.wasm")->content, "wasm");
  EXPECT_EQ(page.find("/assets/core.wasm")->contentType, "application/wasm");
  EXPECT_NE(page.find("/assets/core.wasm")->entityTag, page.find("/index.html")->entityTag);
}

TEST(Page, FindsIndexOfDirectoryAndIgnoresQuery) {
  const PageDirectory directory;
  directory.write("index.html", "root");
  directory.write("help/index.html", "help");
  const Page page(directory.path());
  for (const char* target : {"/", "/?scene=flag", "/index.html?x#y"}) {
    ASSERT_NE(page.find(target), nullptr) << target;
    EXPECT_EQ(page.find(target)->content, "root") << target;
  }
  ASSERT_NE(page.find("/help/"), nullptr);
  EXPECT_EQ(page.find("/help/")->content, "help");
}

TEST(Page, FindsHtmlWithoutItsEnding) {
  const PageDirectory directory;
  directory.write("index.html", "root");
  directory.write("selftest.html", "test");
  directory.write("about", "file");
  directory.write("about.html", "page");
  const Page page(directory.path());
  for (const char* target : {"/selftest", "/selftest?seconds=10", "/selftest.html"}) {
    ASSERT_NE(page.find(target), nullptr) << target;
    EXPECT_EQ(page.find(target)->content, "test") << target;
  }
  ASSERT_NE(page.find("/about"), nullptr);
  EXPECT_EQ(page.find("/about")->content, "file");
  for (const char* target : {"/selftest/", "/self", "/selftest.htm", "/.html"})
    EXPECT_EQ(page.find(target), nullptr) << target;
}

TEST(Page, DecodesPercentEncodedNames) {
  const PageDirectory directory;
  directory.write("a file.txt", "spaced");
  const Page page(directory.path());
  ASSERT_NE(page.find("/a%20file.txt"), nullptr);
  EXPECT_EQ(page.find("/%61%20file.txt"), page.find("/a%20file.txt"));
}

TEST(Page, FindsNothingOutsideTheDirectory) {
  const PageDirectory directory;
  directory.write("index.html", "root");
  directory.write("assets/app.js", "app");
  directory.writeOutside("secret.txt", "secret");
  const Page page(directory.path());
  for (const char* target :
       {"/../secret.txt", "/assets/../../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt",
        "/..%5csecret.txt", "/./index.html", "//index.html", "/assets", "/%00", "/index.html%00.png", "/%",
        "/%2", "/%zz", "", "*", "index.html", "/etc/passwd", "//etc/passwd", "file:///etc/passwd"})
    EXPECT_EQ(page.find(target), nullptr) << target;
}

TEST(Page, FollowsLinksInsideTheDirectoryOnly) {
  const PageDirectory directory;
  directory.write("index.html", "root");
  directory.writeOutside("secret.txt", "secret");
  std::filesystem::create_symlink("index.html", directory.path() / "start.html");
  std::filesystem::create_symlink("../secret.txt", directory.path() / "leak.txt");
  std::filesystem::create_directory_symlink("..", directory.path() / "up");
  std::filesystem::create_symlink("nowhere", directory.path() / "dangling.txt");
  const Page page(directory.path());
  ASSERT_NE(page.find("/start.html"), nullptr);
  EXPECT_EQ(page.find("/start.html")->content, "root");
  EXPECT_EQ(page.find("/leak.txt"), nullptr);
  EXPECT_EQ(page.find("/up/secret.txt"), nullptr);
  EXPECT_EQ(page.find("/dangling.txt"), nullptr);
}

TEST(Page, SkipsHiddenFiles) {
  const PageDirectory directory;
  directory.write(".env", "secret");
  directory.write(".git/config", "secret");
  const Page page(directory.path());
  EXPECT_TRUE(page.empty());
}

TEST(Page, NamesMissingDirectory) {
  EXPECT_THAT(
      [] { Page("/nonexistent/page"); },
      testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("/nonexistent/page is not a directory")));
}

TEST(Page, IsEmptyWithoutDirectory) {
  EXPECT_TRUE(Page("").empty());
}

}  // namespace
}  // namespace clothstream::endpoint

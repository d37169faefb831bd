// SPDX-License-Identifier: MIT
// What earlier runs have left, and which calls a pass of the writer serves.
#include "server/saved_state/earlier_scenes.h"

#include <cstdint>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "server/saved_state/flush_requests.h"

namespace clothstream::saved_state {
namespace {

scene::SavedScene named(const std::string& name) {
  scene::SavedScene saved;
  saved.start.name = name;
  return saved;
}

TEST(EarlierScenesTest, ScenesAreTakenOnce) {
  EarlierScenes earlier;
  earlier.addOfServer("veil", {});
  EXPECT_TRUE(earlier.takeOfServer("veil"));
  EXPECT_FALSE(earlier.takeOfServer("veil"));
  earlier.addCreated("mine", named("mine"));
  EXPECT_FALSE(earlier.isRestored("mine"));
  EXPECT_EQ(earlier.takeCreated().size(), 1U);
  EXPECT_TRUE(earlier.isRestored("mine"));
  EXPECT_TRUE(earlier.takeCreated().empty());
}

TEST(EarlierScenesTest, ScenesNotTakenAreUnused) {
  EarlierScenes earlier;
  earlier.addOfServer("veil", {});
  earlier.addOfServer("flag", {});
  EXPECT_TRUE(earlier.takeOfServer("veil"));
  EXPECT_FALSE(earlier.isUnused("flag"));
  EXPECT_TRUE(earlier.takeCreated().empty());
  EXPECT_FALSE(earlier.isUnused("veil"));
  EXPECT_TRUE(earlier.isUnused("flag"));
  EXPECT_FALSE(earlier.takeOfServer("flag"));
  earlier.eraseUnused("flag");
  EXPECT_FALSE(earlier.isUnused("flag"));
}

TEST(EarlierScenesTest, RemovedNamesAreFree) {
  EarlierScenes earlier;
  earlier.addCreated("mine", named("mine"));
  EXPECT_EQ(earlier.takeCreated().size(), 1U);
  EXPECT_TRUE(earlier.isCreated("mine"));
  earlier.remove("mine");
  EXPECT_FALSE(earlier.isCreated("mine"));
  EXPECT_FALSE(earlier.isRestored("mine"));
}

TEST(FlushRequestsTest, APassServesWhatCameBefore) {
  FlushRequests flushes;
  EXPECT_FALSE(flushes.waits());
  const std::uint64_t first = flushes.add("veil");
  const std::uint64_t began = flushes.newest();
  EXPECT_EQ(flushes.takeNames(), std::set<std::string>{"veil"});
  const std::uint64_t second = flushes.add("flag");
  flushes.serve(began, true);
  EXPECT_TRUE(flushes.failed());
  EXPECT_TRUE(flushes.isServed(first));
  EXPECT_FALSE(flushes.isServed(second));
  EXPECT_TRUE(flushes.waits());
  EXPECT_EQ(flushes.takeNames(), std::set<std::string>{"flag"});
}

}  // namespace
}  // namespace clothstream::saved_state

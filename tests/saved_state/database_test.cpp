// SPDX-License-Identifier: MIT
// The database of kept scenes: power loss at every sync, full disks, damage and newer schemas.
#include "server/saved_state/database.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include "tests/e2e/temporary_directory.h"
#include "tests/saved_state/cut_disk.h"

namespace clothstream::saved_state {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using tests::CutDisk;

constexpr const char* kFile = "state/scenes.sqlite";

std::string contentOf(int step, std::size_t bytes) {
  std::string content(bytes, '\0');
  std::mt19937 random(static_cast<unsigned>(step));
  for (char& c : content) c = static_cast<char>(random());
  return content;
}

// Contents of all scenes.
using Contents = std::map<std::string, std::vector<std::optional<std::string>>>;

Contents contentsOf(const Database& database) {
  Contents contents;
  for (const Database::Row& row : database.rows()) {
    const auto read = database.read(row.name);
    EXPECT_TRUE(read.has_value()) << row.name << ": " << read.error();
    if (read) contents[row.name] = {read->scene, read->session, read->checkpoint};
  }
  return contents;
}

// Changes that follow each other: scenes are created, run, and are deleted. Each is one transaction.
constexpr int kSteps = 14;
bool change(Database& database, int step, Contents& expected) {
  const std::string name = step % 3 == 0 ? "curtain" : "flag";
  auto& row = expected[name];
  if (row.empty()) row.resize(3);
  SceneContents contents;
  if (!row[0]) contents.scene = contentOf(step, 3000), contents.created = true;
  if (step % 2 == 0) contents.session = contentOf(100 + step, 200);
  contents.checkpoint = contentOf(200 + step, 9000);
  if (step == 9) {
    expected.erase(name);
    return database.remove(name).has_value();
  }
  if (contents.scene) row[0] = contents.scene;
  if (contents.session) row[1] = contents.session;
  row[2] = contents.checkpoint;
  return database.write(name, contents).has_value();
}

// The program runs until the power fails at a sync. After each way to lose the writes that were not synced,
// the database has every change that was confirmed, and at most the one that was under way.
TEST(StateDatabase, LosesNothingConfirmedWhenThePowerFailsAtAnySync) {
  std::mt19937 random(5);
  std::uint64_t cuts = 0;
  for (const CutDisk::Loss loss :
       {CutDisk::Loss::all, CutDisk::Loss::none, CutDisk::Loss::torn, CutDisk::Loss::reordered}) {
    for (std::uint64_t sync = 1;; ++sync) {
      CutDisk disk;
      disk.cutAtSync(sync);
      Contents confirmed, next;
      try {
        Database database({.directory = "state", .vfs = disk.name()});
        for (int step = 0; step < kSteps && !disk.isCut(); ++step) {
          next = confirmed;
          if (change(database, step, next)) confirmed = next;
        }
      } catch (const std::runtime_error&) {
        ASSERT_TRUE(disk.isCut()) << "the database opens unless the power fails";
      }
      if (!disk.isCut()) break;
      ++cuts;
      disk.restart(loss, random);
      const Database database({.directory = "state", .vfs = disk.name()});
      EXPECT_THAT(contentsOf(database), AnyOf(confirmed, next)) << "sync " << sync;
    }
  }
  EXPECT_GT(cuts, 4u * kSteps);
}

// Both processes lose power: the first while it writes, the second while it reads what the first left.
TEST(StateDatabase, SurvivesAPowerFailureDuringItsRepair) {
  std::mt19937 random(6);
  std::uint64_t cuts = 0;
  for (std::uint64_t second = 1;; ++second) {
    CutDisk disk;
    disk.cutAtSync(9);
    Contents confirmed, next;
    {
      Database database({.directory = "state", .vfs = disk.name()});
      for (int step = 0; step < kSteps && !disk.isCut(); ++step) {
        next = confirmed;
        if (change(database, step, next)) confirmed = next;
      }
    }
    ASSERT_TRUE(disk.isCut());
    disk.restart(CutDisk::Loss::torn, random);
    disk.cutAtSync(disk.syncs() + second);
    Contents seen;
    try {
      Database database({.directory = "state", .vfs = disk.name()});
      seen = contentsOf(database);
      Contents after = seen;
      // Enough for the log to be written back.
      for (int step = 20; step < 60 && !disk.isCut(); ++step) {
        next = after;
        if (change(database, step, next)) after = next;
      }
      confirmed = after;
    } catch (const std::runtime_error&) {
      ASSERT_TRUE(disk.isCut());
      next = confirmed;
    }
    if (!disk.isCut()) break;
    ++cuts;
    disk.restart(CutDisk::Loss::reordered, random);
    const Database database({.directory = "state", .vfs = disk.name()});
    if (seen.empty()) continue;  // the second process did not come to write
    EXPECT_THAT(contentsOf(database), AnyOf(confirmed, next)) << "sync " << second;
  }
  EXPECT_GT(cuts, 20u);
}

TEST(StateDatabase, KeepsEverythingWhenTheDiskIsFull) {
  CutDisk disk;
  Database database({.directory = "state", .vfs = disk.name()});
  Contents expected;
  for (int step = 0; step < 3; ++step) ASSERT_TRUE(change(database, step, expected));
  const Contents before = expected;
  disk.setCapacity(0);
  const auto written = database.write("flag", {.checkpoint = contentOf(1, 50'000)});
  ASSERT_FALSE(written.has_value());
  EXPECT_THAT(written.error(), HasSubstr("full"));
  EXPECT_EQ(contentsOf(database), before);
  disk.setCapacity(UINT64_MAX);
  EXPECT_TRUE(database.write("flag", {.checkpoint = contentOf(1, 50'000)}).has_value());
}

TEST(StateDatabase, StaysWithinItsLimit) {
  CutDisk disk;
  Database database({.directory = "state", .maxBytes = 400'000, .vfs = disk.name()});
  int written = 0;
  while (written < 100 && database.write(std::to_string(written), {.scene = contentOf(written, 20'000)}))
    ++written;
  EXPECT_GT(written, 10);
  EXPECT_LT(written, 20);
  EXPECT_LE(disk.sizeOf(kFile), 400'000u);
  EXPECT_TRUE(database.remove("1").has_value());
  EXPECT_TRUE(database.write("small", {.scene = contentOf(1, 10'000)}).has_value());
}

// A real file, and the limit that the kernel enforces.
TEST(StateDatabase, KeepsEverythingWhenTheKernelRefusesLargerFiles) {
  const e2e::TemporaryDirectory directory;
  Contents expected;
  Database database({.directory = directory.path() / "scenes"});
  for (int step = 0; step < 3; ++step) ASSERT_TRUE(change(database, step, expected));
  const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit limit{database.bytes(), before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  const auto written = database.write("flag", {.checkpoint = contentOf(1, 5'000'000)});
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, ignored);
  EXPECT_FALSE(written.has_value());
  EXPECT_EQ(contentsOf(database), expected);
  EXPECT_TRUE(database.write("flag", {.checkpoint = contentOf(1, 5'000'000)}).has_value());
}

TEST(StateDatabase, OthersCannotReadItsFiles) {
  const e2e::TemporaryDirectory directory;
  const Database database({.directory = directory.path() / "new" / "scenes"});
  const auto modeOf = [](const std::filesystem::path& path) {
    return std::filesystem::status(path).permissions() & std::filesystem::perms::all;
  };
  using std::filesystem::perms;
  EXPECT_EQ(modeOf(directory.path() / "new" / "scenes"), perms::owner_all);
  EXPECT_EQ(modeOf(database.file()), perms::owner_read | perms::owner_write);
  EXPECT_EQ(modeOf(database.file().string() + "-wal"), perms::owner_read | perms::owner_write);
}

TEST(StateDatabase, DoesNotFollowLinksOutOfTheStateDirectory) {
  const e2e::TemporaryDirectory state, elsewhere;
  const auto problem = [&] {
    try {
      const Database database({.directory = state.path() / "scenes"});
      return std::string("opened");
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  std::filesystem::create_directory_symlink(elsewhere.path(), state.path() / "scenes");
  EXPECT_THAT(problem(), HasSubstr("scenes: is a symbolic link"));
  EXPECT_TRUE(std::filesystem::is_empty(elsewhere.path()));
  std::filesystem::remove(state.path() / "scenes");
  std::filesystem::create_directory(state.path() / "scenes");
  const auto target = elsewhere.path() / "of_others";
  for (const bool exists : {false, true}) {
    if (exists) std::ofstream(target) << "x";
    std::filesystem::create_symlink(target, state.path() / "scenes/scenes.sqlite");
    EXPECT_THAT(problem(), HasSubstr("scenes.sqlite: is a symbolic link"));
    EXPECT_EQ(std::filesystem::exists(target), exists);
    std::filesystem::remove(state.path() / "scenes/scenes.sqlite");
  }
  EXPECT_EQ(std::filesystem::file_size(target), 1u);
  EXPECT_EQ(problem(), "opened");
  // The state directory itself may be reached by a link.
  std::filesystem::create_directory_symlink(state.path(), elsewhere.path() / "state");
  const Database linked({.directory = elsewhere.path() / "state/scenes"});
}

TEST(StateDatabase, IsNotSharedByTwoServers) {
  const e2e::TemporaryDirectory directory;
  const Database database({.directory = directory.path() / "scenes"});
  try {
    const Database second({.directory = directory.path() / "scenes"});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("in use by another server"));
  }
}

// Changes the file with SQLite itself.
void execute(const std::filesystem::path& file, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK) << error;
  sqlite3_free(error);
  sqlite3_close(database);
}

std::string problemOf(const std::filesystem::path& directory) {
  try {
    const Database database({.directory = directory});
    static_cast<void>(database.rows());
    return {};
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(StateDatabase, RefusesNewerSchemasAndOtherPrograms) {
  const e2e::TemporaryDirectory directory;
  const std::filesystem::path scenes = directory.path() / "scenes";
  const std::filesystem::path file = Database({.directory = scenes}).file();
  execute(file, "PRAGMA user_version = 7");
  EXPECT_THAT(problemOf(scenes), HasSubstr("newer release (schema 7, this one knows 1)"));
  execute(file, "PRAGMA user_version = 1");
  EXPECT_EQ(problemOf(scenes), "");
  execute(file, "PRAGMA application_id = 5");
  EXPECT_THAT(problemOf(scenes), HasSubstr("another program"));
}

TEST(StateDatabase, RefusesADamagedFileAndLeavesItAsItIs) {
  const e2e::TemporaryDirectory directory;
  const std::filesystem::path scenes = directory.path() / "scenes";
  std::filesystem::path file;
  {
    Database database({.directory = scenes});
    file = database.file();
    ASSERT_TRUE(database.write("flag", {.scene = contentOf(1, 3000)}).has_value());
  }
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary) << "no database at all";
  const auto size = std::filesystem::file_size(file);
  EXPECT_THAT(problemOf(scenes), HasSubstr("is damaged, and nothing in it was changed"));
  EXPECT_EQ(std::filesystem::file_size(file), size);
}

TEST(StateDatabase, ADamagedRowCostsOnlyItsScene) {
  const e2e::TemporaryDirectory directory;
  const std::filesystem::path scenes = directory.path() / "scenes";
  std::filesystem::path file;
  {
    Database database({.directory = scenes});
    file = database.file();
    for (const char* name : {"curtain", "flag", "swing"})
      ASSERT_TRUE(database
                      .write(name, {.scene = contentOf(1, 3000),
                                    .session = contentOf(2, 100),
                                    .checkpoint = contentOf(3, 30'000)})
                      .has_value());
  }
  execute(file, "UPDATE checkpoint SET content = zeroblob(30000) WHERE name = 'flag'");
  const Database database({.directory = scenes});
  EXPECT_EQ(database.rows().size(), 3u);
  EXPECT_TRUE(database.read("curtain").has_value());
  EXPECT_TRUE(database.read("swing").has_value());
  const auto damaged = database.read("flag");
  ASSERT_FALSE(damaged.has_value());
  EXPECT_EQ(damaged.error(), "its checkpoint is damaged");
}

}  // namespace
}  // namespace clothstream::saved_state

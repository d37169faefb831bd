// SPDX-License-Identifier: MIT
// Database of the scenes that a server keeps, in SQLite.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

struct sqlite3;

namespace clothstream::saved_state {

struct DatabaseOptions {
  std::filesystem::path directory;  // created with mode 0700 if it does not exist
  // Limit of the database in bytes. Its log takes at most as much again while it is written. 0: no limit.
  std::uint64_t maxBytes = 0;
  // Name of an SQLite VFS; empty: that of the system. For tests.
  std::string vfs = {};
};

// Serialised messages of a scene (proto/clothstream/v1/saved_state.proto). Absent ones are left as they are,
// except that `scene` replaces everything that was kept under its name.
struct SceneContents {
  std::optional<std::string> scene = {}, session = {}, checkpoint = {};
  bool created = false;  // belongs to `scene`
};

// Belongs to one thread at a time. A change is on the disk when its function returns: the database uses a
// write-ahead log and synchronous=FULL. Only one process may have it open.
class Database {
 public:
  // Newest schema that this release knows, which it writes.
  static constexpr int kSchema = 1;

  // Opens or creates DIRECTORY/scenes.sqlite, with mode 0600. Throws std::runtime_error, which names the file
  // and says what to do, if it is damaged, in use, of a newer release, or cannot be written. Deletes nothing.
  explicit Database(const DatabaseOptions& options);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  using Done = tl::expected<void, std::string>;  // the error says why nothing changed

  // One transaction each. A scene without a row needs `scene`.
  [[nodiscard]] Done write(const std::string& name, const SceneContents& contents);
  [[nodiscard]] Done removeCheckpoint(const std::string& name);
  [[nodiscard]] Done remove(const std::string& name);

  struct Row {
    std::string name;
    bool created = false;
    std::uint64_t sceneBytes = 0, sessionBytes = 0, checkpointBytes = 0;  // of the contents
    std::int64_t order = 0;  // smaller for a scene whose definition was written earlier

    std::uint64_t bytes() const { return sceneBytes + sessionBytes + checkpointBytes; }
  };
  // All scenes, in the order of their names. Throws std::runtime_error if the database is damaged.
  std::vector<Row> rows() const;
  // Returns an error if a content of the scene is damaged.
  [[nodiscard]] tl::expected<SceneContents, std::string> read(const std::string& name) const;

  const std::filesystem::path& file() const { return file_; }
  // Size of the files of the database.
  std::uint64_t bytes() const;

 private:
  void open(const DatabaseOptions& options);
  void setUp(const DatabaseOptions& options);
  [[noreturn]] void refuse(const std::string& problem) const;

  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace clothstream::saved_state

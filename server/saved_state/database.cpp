// SPDX-License-Identifier: MIT
#include "server/saved_state/database.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/files/state_directory.h"
#include "server/saved_state/crc.h"

namespace clothstream::saved_state {
namespace {

// "CLST", in the header of the file.
constexpr int kApplicationId = 0x434C5354;
constexpr std::uint64_t kPageBytes = 4096;
constexpr const char* kTables[] = {"scene", "session", "checkpoint"};

constexpr const char* kCreateTables =
    "CREATE TABLE scene(name TEXT PRIMARY KEY NOT NULL, created INTEGER NOT NULL, content BLOB NOT NULL,"
    " crc INTEGER NOT NULL);"
    "CREATE TABLE session(name TEXT PRIMARY KEY NOT NULL, content BLOB NOT NULL, crc INTEGER NOT NULL);"
    "CREATE TABLE checkpoint(name TEXT PRIMARY KEY NOT NULL, content BLOB NOT NULL, crc INTEGER NOT NULL);";

struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

// A prepared statement. Results are SQLite's codes.
class Statement {
 public:
  Statement(sqlite3* database, const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    code_ = sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);
    statement_.reset(statement);
  }
  void bind(int place, const std::string& text) {
    check(sqlite3_bind_text64(statement_.get(), place, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8));
  }
  void bindBlob(int place, const std::string& bytes) {
    check(sqlite3_bind_blob64(statement_.get(), place, bytes.data(), bytes.size(), SQLITE_STATIC));
  }
  void bind(int place, std::int64_t number) { check(sqlite3_bind_int64(statement_.get(), place, number)); }
  // SQLITE_ROW, SQLITE_DONE or an error.
  int step() { return code_ == SQLITE_OK ? sqlite3_step(statement_.get()) : code_; }
  std::int64_t number(int column) { return sqlite3_column_int64(statement_.get(), column); }
  std::string bytes(int column) {
    const void* const from = sqlite3_column_blob(statement_.get(), column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
    return from == nullptr ? std::string() : std::string(static_cast<const char*>(from), size);
  }

 private:
  void check(int code) {
    if (code_ == SQLITE_OK) code_ = code;
  }

  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int code_ = SQLITE_OK;
};

int run(sqlite3* database, const std::string& sql) {
  return sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr);
}

std::int64_t numberOf(sqlite3* database, const char* pragma, int& code) {
  Statement statement(database, pragma);
  code = statement.step();
  return code == SQLITE_ROW ? statement.number(0) : 0;
}

// Runs statements as one transaction, which is on the disk when this returns SQLITE_OK.
template <typename Work>
int transaction(sqlite3* database, const Work& work) {
  int code = run(database, "BEGIN IMMEDIATE");
  if (code == SQLITE_OK) code = work();
  if (code == SQLITE_OK || code == SQLITE_DONE) code = run(database, "COMMIT");
  if (code != SQLITE_OK && sqlite3_get_autocommit(database) == 0) run(database, "ROLLBACK");
  return code;
}

int put(sqlite3* database, const char* table, const std::string& name, const std::string& content) {
  Statement statement(
      database, fmt::format("INSERT INTO {}(name, content, crc) VALUES(?1, ?2, ?3) ON CONFLICT(name) DO "
                            "UPDATE SET content = ?2, crc = ?3",
                            table));
  statement.bind(1, name);
  statement.bindBlob(2, content);
  statement.bind(3, std::int64_t{crcOf(content)});
  return statement.step();
}

int putScene(sqlite3* database, const std::string& name, const std::string& content, bool created) {
  Statement statement(database, "INSERT INTO scene(name, created, content, crc) VALUES(?, ?, ?, ?)");
  statement.bind(1, name);
  statement.bind(2, std::int64_t{created});
  statement.bindBlob(3, content);
  statement.bind(4, std::int64_t{crcOf(content)});
  return statement.step();
}

int erase(sqlite3* database, const char* table, const std::string& name) {
  Statement statement(database, fmt::format("DELETE FROM {} WHERE name = ?", table));
  statement.bind(1, name);
  return statement.step();
}

bool isGood(int code) {
  return code == SQLITE_OK || code == SQLITE_DONE || code == SQLITE_ROW;
}

tl::unexpected<std::string> failed(sqlite3* database, int code) {
  const int system = sqlite3_system_errno(database);
  std::string text = sqlite3_errstr(code);
  if ((code & 0xff) == SQLITE_IOERR && system != 0) text += fmt::format(" ({})", std::strerror(system));
  return tl::unexpected(std::move(text));
}

// Creates the file with mode 0600. SQLite gives its log the same mode. Returns what is wrong, or nothing.
std::string createFile(const std::filesystem::path& file) {
  const int opened =
      ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, S_IRUSR | S_IWUSR);
  if (opened < 0)
    return errno == ELOOP ? files::kIsLink : fmt::format("cannot be created: {}", std::strerror(errno));
  std::string problem;
  if (::fchmod(opened, S_IRUSR | S_IWUSR) != 0)
    problem = fmt::format("cannot be created: {}", std::strerror(errno));
  ::close(opened);
  return problem;
}

}  // namespace

void Database::Close::operator()(sqlite3* database) const {
  sqlite3_close_v2(database);
}

Database::Database(const DatabaseOptions& options) : file_(options.directory / "scenes.sqlite") {
  if (options.vfs.empty()) {
    const auto fail = [](const std::filesystem::path& path, const std::string& problem) {
      throw std::runtime_error(fmt::format("{}: {}; or use another --state-dir", path.string(), problem));
    };
    if (const auto made = files::makeStateDirectory(options.directory); !made)
      fail(options.directory, made.error());
    if (const std::string problem = createFile(file_); !problem.empty()) fail(file_, problem);
  }
  open(options);
  setUp(options);
}

Database::~Database() = default;

void Database::refuse(const std::string& problem) const {
  throw std::runtime_error(fmt::format("{}: {}", file_.string(), problem));
}

void Database::open(const DatabaseOptions& options) {
  sqlite3* opened = nullptr;
  const int code = sqlite3_open_v2(
      file_.c_str(), &opened,
      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE,
      options.vfs.empty() ? nullptr : options.vfs.c_str());
  database_.reset(opened);
  if (code != SQLITE_OK) refuse(fmt::format("cannot be opened: {}", sqlite3_errstr(code)));
}

void Database::setUp(const DatabaseOptions& options) {
  sqlite3* const database = database_.get();
  const auto check = [&](int code) {
    if (isGood(code)) return;
    const int kind = code & 0xff;
    if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED)
      refuse("is in use by another server; stop it, or use another --state-dir");
    if (kind == SQLITE_NOTADB || kind == SQLITE_CORRUPT)
      refuse(
          "is damaged, and nothing in it was changed; restore it from a copy, or move it away to start "
          "without saved scenes");
    refuse(fmt::format("cannot be used: {}", failed(database, code).value()));
  };
  // The exclusive lock needs no shared memory. It is taken by the first read.
  check(run(database, "PRAGMA locking_mode = EXCLUSIVE"));
  int code = SQLITE_OK;
  const std::int64_t schema = numberOf(database, "PRAGMA user_version", code);
  check(code);
  const std::int64_t application = numberOf(database, "PRAGMA application_id", code);
  check(code);
  const std::int64_t tables = numberOf(database, "SELECT count(*) FROM sqlite_master", code);
  check(code);
  const bool isNew = schema == 0 && application == 0 && tables == 0;
  if (!isNew && application != kApplicationId)
    refuse("is a database of another program; use another --state-dir");
  if (schema > kSchema)
    refuse(
        fmt::format("was written by a newer release (schema {}, this one knows {}); use that release, or "
                    "another --state-dir",
                    schema, kSchema));
  check(run(database, fmt::format("PRAGMA page_size = {}", kPageBytes)));
  check(run(database, "PRAGMA journal_mode = WAL"));
  check(run(database, "PRAGMA synchronous = FULL"));
  check(run(database, "PRAGMA wal_autocheckpoint = 256"));
  // The log is truncated to this size after its content was copied into the database.
  check(run(database, "PRAGMA journal_size_limit = 4194304"));
  if (options.maxBytes > 0)
    check(run(database, fmt::format("PRAGMA max_page_count = {}",
                                    std::max<std::uint64_t>(16, options.maxBytes / kPageBytes))));
  if (!isNew) return;
  check(transaction(database, [&] {
    int created = run(database, kCreateTables);
    if (created == SQLITE_OK)
      created = run(database, fmt::format("PRAGMA application_id = {}", kApplicationId));
    if (created == SQLITE_OK) created = run(database, fmt::format("PRAGMA user_version = {}", kSchema));
    return created;
  }));
}

Database::Done Database::write(const std::string& name, const SceneContents& contents) {
  sqlite3* const database = database_.get();
  const int code = transaction(database, [&] {
    int done = SQLITE_DONE;
    if (contents.scene) {
      for (const char* table : kTables)
        if (done == SQLITE_DONE) done = erase(database, table, name);
      if (done == SQLITE_DONE) done = putScene(database, name, *contents.scene, contents.created);
    }
    if (done == SQLITE_DONE && contents.session) done = put(database, "session", name, *contents.session);
    if (done == SQLITE_DONE && contents.checkpoint)
      done = put(database, "checkpoint", name, *contents.checkpoint);
    return done;
  });
  if (code != SQLITE_OK) return failed(database, code);
  return {};
}

Database::Done Database::removeCheckpoint(const std::string& name) {
  sqlite3* const database = database_.get();
  const int code = transaction(database, [&] { return erase(database, "checkpoint", name); });
  if (code != SQLITE_OK) return failed(database, code);
  return {};
}

Database::Done Database::remove(const std::string& name) {
  sqlite3* const database = database_.get();
  const int code = transaction(database, [&] {
    int done = SQLITE_DONE;
    for (const char* table : kTables)
      if (done == SQLITE_DONE) done = erase(database, table, name);
    return done;
  });
  if (code != SQLITE_OK) return failed(database, code);
  return {};
}

std::vector<Database::Row> Database::rows() const {
  Statement statement(
      database_.get(),
      "SELECT s.name, s.created, length(s.content), coalesce(length(n.content), 0), "
      "coalesce(length(c.content), 0), s.rowid FROM scene s LEFT JOIN checkpoint c USING(name) LEFT JOIN "
      "session n USING(name) ORDER BY s.name");
  std::vector<Row> rows;
  int code = statement.step();
  for (; code == SQLITE_ROW; code = statement.step())
    rows.push_back({.name = statement.bytes(0),
                    .created = statement.number(1) != 0,
                    .sceneBytes = static_cast<std::uint64_t>(statement.number(2)),
                    .sessionBytes = static_cast<std::uint64_t>(statement.number(3)),
                    .checkpointBytes = static_cast<std::uint64_t>(statement.number(4)),
                    .order = statement.number(5)});
  if (code != SQLITE_DONE)
    refuse(
        fmt::format("its list of scenes cannot be read: {}; nothing in it was changed; restore it from a "
                    "copy, or move it away to start without saved scenes",
                    sqlite3_errstr(code)));
  return rows;
}

tl::expected<SceneContents, std::string> Database::read(const std::string& name) const {
  SceneContents contents;
  const std::array<std::optional<std::string>*, 3> places{&contents.scene, &contents.session,
                                                          &contents.checkpoint};
  for (std::size_t i = 0; i < places.size(); ++i) {
    Statement statement(database_.get(), fmt::format("SELECT content, crc{} FROM {} WHERE name = ?",
                                                     i == 0 ? ", created" : "", kTables[i]));
    statement.bind(1, name);
    const int code = statement.step();
    if (code == SQLITE_DONE) continue;
    if (code != SQLITE_ROW)
      return tl::unexpected(fmt::format("its {} cannot be read: {}", kTables[i], sqlite3_errstr(code)));
    std::string content = statement.bytes(0);
    if (crcOf(content) != statement.number(1))
      return tl::unexpected(fmt::format("its {} is damaged", kTables[i]));
    if (i == 0) contents.created = statement.number(2) != 0;
    *places[i] = std::move(content);
  }
  return contents;
}

std::uint64_t Database::bytes() const {
  std::uint64_t bytes = 0;
  for (const char* ending : {"", "-wal"}) {
    std::error_code none;
    const std::uintmax_t size = std::filesystem::file_size(file_.string() + ending, none);
    if (!none) bytes += size;
  }
  return bytes;
}

}  // namespace clothstream::saved_state

// SPDX-License-Identifier: MIT
// A disk in memory that loses its power: an SQLite VFS for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

struct sqlite3_vfs;

namespace clothstream::tests {

// Files with what is on the disk, and the writes that were not synced. While it lives, SQLite knows it under
// name(). Belongs to one thread.
class CutDisk {
 public:
  CutDisk();
  ~CutDisk();
  CutDisk(const CutDisk&) = delete;
  CutDisk& operator=(const CutDisk&) = delete;

  const std::string& name() const { return name_; }

  // The disk fails from this sync on, counted from 1: that sync and all later accesses return an error. 0:
  // never.
  void cutAtSync(std::uint64_t number) { cutAt_ = number; }
  std::uint64_t syncs() const { return syncs_; }
  bool isCut() const { return cut_; }

  // Fate of the writes that were not synced: lost, or kept. `torn` keeps a random part of each in sectors of
  // 512 bytes. `reordered` keeps some of them, whichever came first.
  enum class Loss { all, none, torn, reordered };
  // The power comes back.
  void restart(Loss loss, std::mt19937& random);

  // Size that all files together may have; further writes fail as on a full disk.
  void setCapacity(std::uint64_t bytes) { capacity_ = bytes; }

  // Changes a byte of a file on the disk.
  void damage(const std::string& file, std::size_t offset);
  std::size_t sizeOf(const std::string& file) const;

  // Only for the functions of the VFS.
  struct Write {
    std::size_t offset = 0;
    std::string bytes;
    bool truncates = false;  // to `offset`
  };
  struct File {
    std::string present;  // as the program sees it
    std::string durable;
    std::vector<Write> pending;
  };
  bool refuses() const { return cut_; }
  bool sync(File& file);
  bool fits(std::size_t more) const;
  std::map<std::string, File> files;

 private:
  static void apply(const Write& write, std::string& content);

  std::string name_;
  sqlite3_vfs* vfs_ = nullptr;
  std::uint64_t cutAt_ = 0, syncs_ = 0, capacity_ = UINT64_MAX;
  bool cut_ = false;
};

}  // namespace clothstream::tests

// SPDX-License-Identifier: MIT
#include "tests/saved_state/cut_disk.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <sqlite3.h>

namespace clothstream::tests {
namespace {

constexpr std::size_t kSector = 512;

// SQLite allocates this; the first member must be its own.
struct OpenFile {
  sqlite3_file base;
  CutDisk* disk;
  CutDisk::File* file;
};

CutDisk& diskOf(sqlite3_vfs* vfs) {
  return *static_cast<CutDisk*>(vfs->pAppData);
}
OpenFile& open(sqlite3_file* file) {
  return *reinterpret_cast<OpenFile*>(file);
}

int close(sqlite3_file*) {
  return SQLITE_OK;
}
int read(sqlite3_file* handle, void* to, int count, sqlite3_int64 from) {
  if (open(handle).disk->refuses()) return SQLITE_IOERR_READ;
  const std::string& content = open(handle).file->present;
  const auto offset = static_cast<std::size_t>(from), wanted = static_cast<std::size_t>(count);
  const std::size_t there = offset < content.size() ? std::min(wanted, content.size() - offset) : 0;
  std::memcpy(to, content.data() + std::min(offset, content.size()), there);
  std::memset(static_cast<char*>(to) + there, 0, wanted - there);
  return there == wanted ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}
int write(sqlite3_file* handle, const void* from, int count, sqlite3_int64 at) {
  CutDisk& disk = *open(handle).disk;
  if (disk.refuses()) return SQLITE_IOERR_WRITE;
  CutDisk::File& file = *open(handle).file;
  const auto offset = static_cast<std::size_t>(at), size = static_cast<std::size_t>(count);
  if (offset + size > file.present.size()) {
    if (!disk.fits(offset + size - file.present.size())) return SQLITE_FULL;
    file.present.resize(offset + size);
  }
  std::memcpy(file.present.data() + offset, from, size);
  file.pending.push_back({.offset = offset, .bytes = {static_cast<const char*>(from), size}});
  return SQLITE_OK;
}
int truncate(sqlite3_file* handle, sqlite3_int64 size) {
  if (open(handle).disk->refuses()) return SQLITE_IOERR_TRUNCATE;
  CutDisk::File& file = *open(handle).file;
  file.present.resize(static_cast<std::size_t>(size));
  file.pending.push_back({.offset = static_cast<std::size_t>(size), .bytes = {}, .truncates = true});
  return SQLITE_OK;
}
int sync(sqlite3_file* handle, int) {
  return open(handle).disk->sync(*open(handle).file) ? SQLITE_OK : SQLITE_IOERR_FSYNC;
}
int fileSize(sqlite3_file* handle, sqlite3_int64* size) {
  if (open(handle).disk->refuses()) return SQLITE_IOERR_FSTAT;
  *size = static_cast<sqlite3_int64>(open(handle).file->present.size());
  return SQLITE_OK;
}
int lock(sqlite3_file*, int) {
  return SQLITE_OK;
}
int isLocked(sqlite3_file*, int* result) {
  *result = 0;
  return SQLITE_OK;
}
int control(sqlite3_file*, int, void*) {
  return SQLITE_NOTFOUND;
}
int sectorSize(sqlite3_file*) {
  return kSector;
}
int characteristics(sqlite3_file*) {
  return 0;
}

const sqlite3_io_methods kMethods{.iVersion = 1,
                                  .xClose = close,
                                  .xRead = read,
                                  .xWrite = write,
                                  .xTruncate = truncate,
                                  .xSync = sync,
                                  .xFileSize = fileSize,
                                  .xLock = lock,
                                  .xUnlock = lock,
                                  .xCheckReservedLock = isLocked,
                                  .xFileControl = control,
                                  .xSectorSize = sectorSize,
                                  .xDeviceCharacteristics = characteristics,
                                  .xShmMap = nullptr,
                                  .xShmLock = nullptr,
                                  .xShmBarrier = nullptr,
                                  .xShmUnmap = nullptr,
                                  .xFetch = nullptr,
                                  .xUnfetch = nullptr};

int openFile(sqlite3_vfs* vfs, const char* path, sqlite3_file* handle, int flags, int* result) {
  CutDisk& disk = diskOf(vfs);
  OpenFile& opened = open(handle);
  opened.base.pMethods = nullptr;
  if (disk.refuses()) return SQLITE_CANTOPEN;
  const std::string key = path == nullptr ? fmt::format("temporary {}", disk.files.size()) : path;
  if ((flags & SQLITE_OPEN_CREATE) == 0 && !disk.files.contains(key)) return SQLITE_CANTOPEN;
  opened = {.base = {.pMethods = &kMethods}, .disk = &disk, .file = &disk.files[key]};
  if (result != nullptr) *result = flags;
  return SQLITE_OK;
}
// A directory is written at once: losing that is a matter of the file system's journal.
int deleteFile(sqlite3_vfs* vfs, const char* path, int) {
  CutDisk& disk = diskOf(vfs);
  if (disk.refuses()) return SQLITE_IOERR_DELETE;
  disk.files.erase(path);
  return SQLITE_OK;
}
int access(sqlite3_vfs* vfs, const char* path, int, int* result) {
  if (diskOf(vfs).refuses()) return SQLITE_IOERR_ACCESS;
  *result = diskOf(vfs).files.contains(path) ? 1 : 0;
  return SQLITE_OK;
}
int fullPath(sqlite3_vfs*, const char* path, int size, char* out) {
  if (static_cast<int>(std::strlen(path)) >= size) return SQLITE_CANTOPEN;
  std::strcpy(out, path);
  return SQLITE_OK;
}
int randomness(sqlite3_vfs*, int count, char* out) {
  std::memset(out, 7, static_cast<std::size_t>(count));
  return count;
}
int sleep(sqlite3_vfs*, int microseconds) {
  return microseconds;
}
int currentTime(sqlite3_vfs*, double* out) {
  *out = 2461000;
  return SQLITE_OK;
}
int lastError(sqlite3_vfs*, int, char*) {
  return 0;
}

}  // namespace

CutDisk::CutDisk() : name_(fmt::format("cut-{}", static_cast<const void*>(this))) {
  vfs_ = new sqlite3_vfs{};
  vfs_->iVersion = 1;
  vfs_->szOsFile = sizeof(OpenFile);
  vfs_->mxPathname = 256;
  vfs_->zName = name_.c_str();
  vfs_->pAppData = this;
  vfs_->xOpen = openFile;
  vfs_->xDelete = deleteFile;
  vfs_->xAccess = access;
  vfs_->xFullPathname = fullPath;
  vfs_->xRandomness = randomness;
  vfs_->xSleep = sleep;
  vfs_->xCurrentTime = currentTime;
  vfs_->xGetLastError = lastError;
  sqlite3_vfs_register(vfs_, 0);
}

CutDisk::~CutDisk() {
  sqlite3_vfs_unregister(vfs_);
  delete vfs_;
}

void CutDisk::apply(const Write& write, std::string& content) {
  if (write.truncates) {
    content.resize(write.offset);
    return;
  }
  content.resize(std::max(content.size(), write.offset + write.bytes.size()));
  std::memcpy(content.data() + write.offset, write.bytes.data(), write.bytes.size());
}

bool CutDisk::sync(File& file) {
  if (cut_) return false;
  if (++syncs_ == cutAt_) {
    cut_ = true;
    return false;
  }
  file.durable = file.present;
  file.pending.clear();
  return true;
}

bool CutDisk::fits(std::size_t more) const {
  std::uint64_t all = more;
  for (const auto& [path, file] : files) all += file.present.size();
  return all <= capacity_;
}

void CutDisk::restart(Loss loss, std::mt19937& random) {
  const auto coin = [&] { return random() % 2 == 0; };
  for (auto& [path, file] : files) {
    std::vector<Write> writes = std::move(file.pending);
    file.pending.clear();
    if (loss == Loss::reordered) std::ranges::shuffle(writes, random);
    for (const Write& write : writes) {
      if (loss == Loss::all || (loss == Loss::reordered && coin())) continue;
      if (loss != Loss::torn || write.truncates) {
        if (loss != Loss::torn || coin()) apply(write, file.durable);
        continue;
      }
      for (std::size_t from = 0; from < write.bytes.size(); from += kSector)
        if (coin())
          apply({.offset = write.offset + from, .bytes = write.bytes.substr(from, kSector)}, file.durable);
    }
    file.present = file.durable;
  }
  cut_ = false;
  cutAt_ = 0;
}

void CutDisk::damage(const std::string& file, std::size_t offset) {
  char& byte = files.at(file).durable.at(offset);
  byte = static_cast<char>(byte ^ 0x55);
  files.at(file).present = files.at(file).durable;
}

std::size_t CutDisk::sizeOf(const std::string& file) const {
  return files.at(file).present.size();
}

}  // namespace clothstream::tests

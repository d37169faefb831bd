// SPDX-License-Identifier: MIT
// Implementation with mkostemp, write, fsync and rename.
#include "clients/files/new_file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace clothstream::files {
namespace {

tl::unexpected<std::string> problem(const std::string& path, const char* what) {
  return tl::unexpected(fmt::format("cannot write {}: {}", path, what));
}

tl::unexpected<std::string> problem(const std::string& path) {
  return problem(path, std::strerror(errno));
}

}  // namespace

tl::expected<NewFile, std::string> NewFile::create(const std::string& path) {
  struct stat present {};
  if (::stat(path.c_str(), &present) == 0) {
    if (S_ISDIR(present.st_mode)) return problem(path, std::strerror(EISDIR));
    if (!S_ISREG(present.st_mode)) return problem(path, "it is not a regular file");
  }
  std::string temporary = path + ".XXXXXX";
  const int file = ::mkostemp(temporary.data(), O_CLOEXEC);
  if (file < 0) return problem(path);
  // mkostemp lets only the owner access the file. Set the usual permissions.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(file, 0666 & ~mask);
  return NewFile(path, std::move(temporary), file);
}

NewFile::NewFile(NewFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      file_(std::exchange(other.file_, -1)),
      bytes_(other.bytes_) {}

NewFile::~NewFile() {
  if (file_ < 0) return;
  ::close(file_);
  ::unlink(temporary_.c_str());
}

tl::expected<void, std::string> NewFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file_, bytes.data(), bytes.size());
    if (count < 0 && errno != EINTR) return problem(path_);
    if (count <= 0) continue;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    bytes_ += static_cast<std::uint64_t>(count);
  }
  return {};
}

tl::expected<void, std::string> NewFile::finish() {
  if (::fsync(file_) != 0 || ::rename(temporary_.c_str(), path_.c_str()) != 0) return problem(path_);
  ::close(std::exchange(file_, -1));
  return {};
}

}  // namespace clothstream::files

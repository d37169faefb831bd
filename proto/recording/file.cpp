// SPDX-License-Identifier: MIT
// Files that are written, by open and write.
#include "proto/recording/file.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace clothstream::recording {
namespace {

tl::unexpected<std::string> problem(const char* what, const std::string& path) {
  return tl::unexpected(fmt::format("cannot {} {}: {}", what, path, std::strerror(errno)));
}

}  // namespace

tl::expected<OutputFile, std::string> OutputFile::create(const std::string& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) return problem("write", path);
  return OutputFile(path, file);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

OutputFile::~OutputFile() {
  if (file_ >= 0) ::close(file_);
}

tl::expected<void, std::string> OutputFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(file_, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return problem("write", path_);
    bytes.remove_prefix(static_cast<std::size_t>(done));
  }
  return {};
}

tl::expected<void, std::string> OutputFile::sync() {
  if (::fsync(file_) != 0) return problem("write", path_);
  return {};
}

}  // namespace clothstream::recording

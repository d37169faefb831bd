// SPDX-License-Identifier: MIT
#include "server/files/regular_file.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace clothstream::files {
namespace {

constexpr std::size_t kPieceBytes = 64 * 1024;

tl::unexpected<FileError> unreadable(int error) {
  return tl::unexpected(FileError{fmt::format("cannot be read: {}", std::strerror(error))});
}

// Reads one byte more than `most` if there is one, so that the caller notices it.
int readAll(int descriptor, std::uint64_t most, std::string& content) {
  while (content.size() <= most) {
    const std::size_t before = content.size();
    content.resize(before + std::min<std::uint64_t>(kPieceBytes, most + 1 - before));
    const ssize_t count = ::read(descriptor, content.data() + before, content.size() - before);
    const int error = errno;
    content.resize(before + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return 0;
    if (count < 0 && error != EINTR) return error;
  }
  return 0;
}

tl::expected<std::string, FileError> read(const std::filesystem::path& path, std::uint64_t most,
                                          bool mayBeFifo) {
  // Without O_NONBLOCK, opening a FIFO waits for its writer.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | (mayBeFifo ? 0 : O_NONBLOCK));
  if (descriptor < 0) return unreadable(errno);
  struct stat status {};
  int error = ::fstat(descriptor, &status) == 0 ? 0 : errno;
  const bool isAllowed = error == 0 && (S_ISREG(status.st_mode) || (mayBeFifo && S_ISFIFO(status.st_mode)));
  std::string content;
  if (isAllowed) {
    content.reserve(static_cast<std::size_t>(
        std::min<std::uint64_t>(static_cast<std::uint64_t>(status.st_size), most) + 1));
    error = readAll(descriptor, most, content);
  }
  ::close(descriptor);
  if (error != 0) return unreadable(error);
  if (!isAllowed)
    return tl::unexpected(FileError{
        fmt::format("is not a regular file{}", mayBeFifo ? " or FIFO: folders and devices cannot be used"
                                                         : ": folders, devices and FIFOs cannot be used")});
  if (content.size() > most)
    return tl::unexpected(FileError{fmt::format("is too large: at most {} bytes are allowed", most), true});
  return content;
}

}  // namespace

tl::expected<std::string, FileError> readRegularFile(const std::filesystem::path& path, std::uint64_t most) {
  return read(path, most, false);
}

tl::expected<std::string, FileError> readFileOrFifo(const std::filesystem::path& path, std::uint64_t most) {
  return read(path, most, true);
}

}  // namespace clothstream::files

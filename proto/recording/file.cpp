// SPDX-License-Identifier: MIT
// File access by open, write and pread.
#include "proto/recording/file.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/recording/byte_source.h"

namespace clothstream::recording {
namespace {

tl::unexpected<std::string> problem(const char* what, const std::string& path) {
  return tl::unexpected(fmt::format("cannot {} {}: {}", what, path, std::strerror(errno)));
}

class FileSource : public ByteSource {
 public:
  FileSource(int file, std::uint64_t size) : file_(file), size_(size) {}
  ~FileSource() override { ::close(file_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.resize(count);
    for (std::uint64_t done = 0; done < count;) {
      const ssize_t got = ::pread(file_, out.data() + done, count - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      done += static_cast<std::uint64_t>(got);
    }
    return true;
  }

 private:
  int file_;
  std::uint64_t size_;
};

}  // namespace

tl::expected<std::unique_ptr<ByteSource>, std::string> openFile(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return problem("read", path);
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    return tl::unexpected(fmt::format("cannot read {}: it is no regular file", path));
  }
  return std::make_unique<FileSource>(file, static_cast<std::uint64_t>(status.st_size));
}

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

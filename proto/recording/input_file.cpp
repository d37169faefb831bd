// SPDX-License-Identifier: MIT
// Files as sources of a reader, through streams of the standard library.
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "proto/recording/byte_source.h"

namespace clothstream::recording {
namespace {

class FileSource : public ByteSource {
 public:
  FileSource(std::ifstream file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.resize(count);
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    file_.read(out.data(), static_cast<std::streamsize>(count));
    return file_.good();
  }

 private:
  mutable std::ifstream file_;
  std::uint64_t size_;
};

}  // namespace

tl::expected<std::unique_ptr<ByteSource>, std::string> openFile(const std::string& path) {
  const auto problem = [&](const std::string& reason) {
    return tl::unexpected("cannot read " + path + ": " + reason);
  };
  const std::filesystem::path name(std::u8string(path.begin(), path.end()));
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(name, error);
  if (error) return problem(error.message());
  // Opening a pipe would wait for its writer.
  if (!std::filesystem::is_regular_file(status)) return problem("not a regular file");
  const std::uintmax_t size = std::filesystem::file_size(name, error);
  if (error) return problem(error.message());
  std::ifstream file;
  file.rdbuf()->pubsetbuf(nullptr, 0);  // chunks are read as a whole
  file.open(name, std::ios::binary);
  if (!file) return problem(std::strerror(errno));
  return std::make_unique<FileSource>(std::move(file), static_cast<std::uint64_t>(size));
}

}  // namespace clothstream::recording

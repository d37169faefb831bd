// SPDX-License-Identifier: MIT
// Writes arrays with libzip.
#include "clients/files/npz_writer.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>
#include <zip.h>

#include "clients/files/npy_header.h"

namespace clothstream::files {
namespace {

// Room for the header in front of the rows. It is written last, since the number of rows is known then.
constexpr std::size_t kHeaderBytes = 256;
// Time of all entries, so that equal arrays make equal files: the first one that a zip file can hold.
constexpr std::time_t kEntryTime = 315'619'200;  // 1980-01-02

}  // namespace

tl::unexpected<std::string> NpzWriter::failed(const std::string& why) const {
  return tl::unexpected(fmt::format("cannot write {}: {}", path_, why));
}

tl::expected<NpzWriter, std::string> NpzWriter::create(const std::string& path) {
  NpzWriter writer(path);
  std::error_code none;
  if (std::filesystem::exists(std::filesystem::symlink_status(path, none)))
    return writer.failed("it exists already");
  return writer;
}

tl::expected<std::size_t, std::string> NpzWriter::add(std::string name, std::string type,
                                                      std::vector<std::uint64_t> rowShape) {
  std::string temporary = path_ + ".XXXXXX";
  const int descriptor = ::mkstemp(temporary.data());
  if (descriptor < 0) return failed(std::strerror(errno));
  ::unlink(temporary.c_str());
  std::FILE* const file = ::fdopen(descriptor, "w+b");
  if (file == nullptr) {
    ::close(descriptor);
    return failed(std::strerror(errno));
  }
  Array& array = arrays_.emplace_back(Array{std::move(name), std::move(type), std::move(rowShape), {}});
  array.file.reset(file);
  const std::string room(kHeaderBytes, ' ');
  if (std::fwrite(room.data(), 1, room.size(), file) != room.size()) return failed(std::strerror(errno));
  return arrays_.size() - 1;
}

tl::expected<void, std::string> NpzWriter::append(std::size_t index, std::span<const std::byte> rows) {
  Array& array = arrays_[index];
  if (std::fwrite(rows.data(), 1, rows.size(), array.file.get()) != rows.size())
    return failed(std::strerror(errno));
  array.bytes += rows.size();
  return {};
}

tl::expected<void, std::string> NpzWriter::finish() {
  int code = 0;
  zip_t* const zip = zip_open(path_.c_str(), ZIP_CREATE | ZIP_EXCL, &code);
  if (zip == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    return failed(why);
  }
  const auto failedInZip = [&] {
    const std::string why = zip_strerror(zip);
    zip_discard(zip);
    return failed(why);
  };
  for (Array& array : arrays_) {
    NpyHeader header{array.type, array.rowShape};
    header.shape.insert(header.shape.begin(), 1);
    header.shape[0] = array.bytes / header.bytes();
    const std::string text = npyHeader(header, kHeaderBytes);
    std::FILE* const file = array.file.get();
    // The source reads from the place of the file when it is made.
    if (std::fseek(file, 0, SEEK_SET) != 0 || std::fwrite(text.data(), 1, text.size(), file) != text.size() ||
        std::fseek(file, 0, SEEK_SET) != 0) {
      const int problem = errno;
      zip_discard(zip);
      return failed(std::strerror(problem));
    }
    zip_source_t* const source = zip_source_filep(zip, file, 0, -1);
    if (source == nullptr) return failedInZip();
    static_cast<void>(array.file.release());  // the source closes it
    const zip_int64_t entry = zip_file_add(zip, (array.name + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (entry < 0) {
      zip_source_free(source);
      return failedInZip();
    }
    const auto place = static_cast<zip_uint64_t>(entry);
    if (zip_set_file_compression(zip, place, ZIP_CM_STORE, 0) != 0 ||
        zip_file_set_mtime(zip, place, kEntryTime, 0) != 0)
      return failedInZip();
  }
  if (zip_close(zip) != 0) return failedInZip();
  return {};
}

}  // namespace clothstream::files

// SPDX-License-Identifier: MIT
// Writes arrays of any length to a .npz file, which numpy.load reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

namespace clothstream::files {

// Rows go to unnamed temporary files in the directory of the path, so memory does not grow with them, and the
// disk needs twice the size of the file until finish() returns. The file exists completely or not at all.
// Arrays are not compressed; files beyond 4 GiB use zip64. Errors name the path and the reason.
class NpzWriter {
 public:
  // Fails if the path exists.
  [[nodiscard]] static tl::expected<NpzWriter, std::string> create(const std::string& path);

  // Adds an array of rows of this shape, which is empty for rows of one element. `type` is that of numpy, for
  // example "<f4". Returns the number of the array.
  [[nodiscard]] tl::expected<std::size_t, std::string> add(std::string name, std::string type,
                                                           std::vector<std::uint64_t> rowShape);
  // Appends one or more rows. The bytes must be a whole number of them.
  [[nodiscard]] tl::expected<void, std::string> append(std::size_t array, std::span<const std::byte> rows);
  template <typename T>
  [[nodiscard]] tl::expected<void, std::string> append(std::size_t array, std::span<const T> values) {
    return append(array, std::as_bytes(values));
  }
  // Adds an array with all of its rows. With `rowShape` {3}, every three values are a row.
  template <typename T>
  [[nodiscard]] tl::expected<void, std::string> addWhole(std::string name, std::string type,
                                                         std::vector<std::uint64_t> rowShape,
                                                         std::span<const T> values) {
    return add(std::move(name), std::move(type), std::move(rowShape)).and_then([&](std::size_t array) {
      return append(array, std::as_bytes(values));
    });
  }
  // Moves the file to its path. Must be the last call.
  [[nodiscard]] tl::expected<void, std::string> finish();

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct Array {
    std::string name, type;
    std::vector<std::uint64_t> rowShape;
    std::unique_ptr<std::FILE, CloseFile> file;
    std::uint64_t bytes = 0;  // of the rows
  };

  explicit NpzWriter(std::string path) : path_(std::move(path)) {}
  tl::unexpected<std::string> failed(const std::string& why) const;

  std::string path_;
  std::vector<Array> arrays_;
};

}  // namespace clothstream::files

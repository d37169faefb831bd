// SPDX-License-Identifier: MIT
// The static files that the endpoint serves, read once when the server starts.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace clothstream::endpoint {

struct PageFile {
  std::string content;
  std::string_view contentType;
  std::string entityTag;  // quoted, as in the ETag field; the same content has the same tag
};

inline constexpr std::size_t kMaxPageBytes = 64 * 1024 * 1024;

// Immutable once made. Because a request can only name a key of this map, no request reaches a file that was
// not in the directory, whatever its path looks like; and no frame ever waits for a disk.
class Page {
 public:
  // An empty path gives a page without files. Hidden files, and links that lead out of the directory, are
  // left out. Throws std::runtime_error if it is no directory, a file cannot be read, or all is more than
  // kMaxPageBytes.
  explicit Page(const std::filesystem::path& directory);

  // `target` is a request's: percent-encoded, perhaps with a query; a directory stands for its index.html.
  // nullptr if there is no such file.
  const PageFile* find(std::string_view target) const;

  bool empty() const { return files_.empty(); }

 private:
  std::map<std::string, PageFile, std::less<>> files_;  // by path from the root: "/assets/core.wasm"
};

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
// Static files that the endpoint serves, read once when the server starts.
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
  std::string entityTag;  // quoted as in the ETag field; equal content has equal tags
};

inline constexpr std::size_t kMaxPageBytes = 64 * 1024 * 1024;

// Immutable while it is served. A request can only name a key of the map, so no path leads outside the
// directory. No request waits for a disk.
class Page {
 public:
  // Reads the files of the directory; an empty path gives a page without files. Skips hidden files and links
  // that lead outside. Throws std::runtime_error if the path is not a directory, a file cannot be read, or
  // the files exceed kMaxPageBytes.
  explicit Page(const std::filesystem::path& directory);

  // Adds a file that is not in the directory. Does nothing if there is a file with this path.
  void add(const std::string& path, std::string content);

  // `target` comes from a request: percent-encoded, with an optional query. A directory means its index.html,
  // and a name without a file means that name with ".html".
  // Returns nullptr if there is no such file.
  const PageFile* find(std::string_view target) const;

  bool empty() const { return files_.empty(); }

 private:
  std::map<std::string, PageFile, std::less<>> files_;  // by path, such as "/assets/core.wasm"
};

}  // namespace clothstream::endpoint

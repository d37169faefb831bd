// SPDX-License-Identifier: MIT
#include "server/endpoint/web/page.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace clothstream::endpoint {
namespace {

namespace fs = std::filesystem;

std::string_view contentTypeOf(const fs::path& file) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 19> kTypes{{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".webmanifest", "application/manifest+json"},
      {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".jpeg", "image/jpeg"},
      {".webp", "image/webp"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".glb", "model/gltf-binary"},
      {".gltf", "model/gltf+json"},
      {".hdr", "image/vnd.radiance"},
  }};
  const std::string extension = file.extension().string();
  const auto* type =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& t) { return t.first == extension; });
  return type == kTypes.end() ? "application/octet-stream" : type->second;
}

std::string readFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in) throw std::runtime_error(fmt::format("cannot read the page's file {}", file.string()));
  return content;
}

bool isInside(const fs::path& canonicalFile, const fs::path& canonicalRoot) {
  return std::mismatch(canonicalRoot.begin(), canonicalRoot.end(), canonicalFile.begin(), canonicalFile.end())
             .first == canonicalRoot.end();
}

bool isHidden(const fs::path& path) {
  return path.filename().string().starts_with('.');
}

// Returns nullopt if a percent sign is not followed by two hexadecimal digits.
std::optional<std::string> percentDecoded(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    if (text.size() - i < 3) return std::nullopt;
    unsigned char value = 0;
    const char* const first = text.data() + i + 1;
    if (std::from_chars(first, first + 2, value, 16).ptr != first + 2) return std::nullopt;
    decoded += static_cast<char>(value);
    i += 2;
  }
  return decoded;
}

}  // namespace

Page::Page(const fs::path& directory) {
  if (directory.empty()) return;
  if (!fs::is_directory(directory))
    throw std::runtime_error(fmt::format("the page's directory {} is not a directory", directory.string()));
  const fs::path root = fs::canonical(directory);
  std::size_t total = 0;
  for (auto entry = fs::recursive_directory_iterator(root); entry != fs::recursive_directory_iterator();
       ++entry) {
    if (isHidden(entry->path())) {
      entry.disable_recursion_pending();
      continue;
    }
    std::error_code unreachable;  // such as a broken or circular link
    if (!entry->is_regular_file(unreachable)) continue;
    if (entry->is_symlink() && !isInside(fs::canonical(entry->path()), root)) continue;
    total += entry->file_size();
    if (total > kMaxPageBytes)
      throw std::runtime_error(
          fmt::format("the page's directory {} holds more than {} MiB: is it the right one?",
                      directory.string(), kMaxPageBytes >> 20));
    add((fs::path("/") / entry->path().lexically_relative(root)).generic_string(), readFile(entry->path()));
  }
}

void Page::add(const std::string& path, std::string content) {
  PageFile file{std::move(content), contentTypeOf(path), {}};
  file.entityTag = fmt::format("\"{:016x}\"", std::hash<std::string_view>{}(file.content));
  files_.emplace(path, std::move(file));
}

const PageFile* Page::find(std::string_view target) const {
  std::optional<std::string> path = percentDecoded(target.substr(0, target.find_first_of("?#")));
  if (!path) return nullptr;
  if (path->ends_with('/')) *path += "index.html";
  auto file = files_.find(*path);
  if (file == files_.end()) file = files_.find(*path + ".html");
  return file == files_.end() ? nullptr : &file->second;
}

}  // namespace clothstream::endpoint

// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_container.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "proto/text/excerpt.h"
#include "server/meshes/gltf_primitive.h"

namespace clothstream::meshes {
namespace {

using nlohmann::json;

// A .glb file is a header (magic, version, length) and chunks (length, type, bytes), of which the first is
// JSON.
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
constexpr int kMaxDepth = 100;  // writing JSON needs stack for each level

std::uint32_t wordAt(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));
  return word;
}

void putWord(std::string& bytes, std::size_t at, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  std::memcpy(bytes.data() + at, &word, sizeof(word));
}

// Empty if the header is broken.
std::string_view jsonOf(std::string_view bytes, bool binary) {
  if (!binary) return bytes;
  constexpr std::size_t kFirst = kHeaderBytes + kChunkHeaderBytes;
  if (bytes.size() < kFirst) return {};
  const std::uint32_t length = wordAt(bytes, kHeaderBytes);
  return length <= bytes.size() - kFirst ? bytes.substr(kFirst, length) : std::string_view();
}

// Discarded if the text is not JSON, or nested too deeply.
json parsed(std::string_view text) {
  bool isTooDeep = false;
  json root = json::parse(
      text,
      [&](int depth, json::parse_event_t, json&) {
        isTooDeep = isTooDeep || depth > kMaxDepth;
        return !isTooDeep;
      },
      false);
  return isTooDeep ? json(json::value_t::discarded) : root;
}

// Null if the value is not an object, or has no such member.
const json& member(const json& value, const char* name) {
  static const json kNull;
  if (!value.is_object()) return kNull;
  const auto found = value.find(name);
  return found != value.end() ? *found : kNull;
}

std::string versionError(std::string_view version) {
  return fmt::format(
      "is glTF {}, which is not supported: convert it to glTF 2.0, or export it again as glTF 2.0", version);
}

// Gives the accessor of the primitive's indices a buffer view if it has none.
void addView(const json& primitive, json& accessors) {
  const json& view = member(member(member(primitive, "extensions"), kDracoExtension), "bufferView");
  const json& indices = member(primitive, "indices");
  if (!view.is_number_unsigned() || !indices.is_number_unsigned() || !accessors.is_array()) return;
  const std::uint64_t index = indices.get<std::uint64_t>();
  if (index >= accessors.size() || !accessors[index].is_object()) return;
  accessors[index].emplace("bufferView", view);
}

bool isData(std::string_view uri) {
  return uri.starts_with("data:");
}

// Whether the JSON has a URI that tinygltf reads in another way than RFC 3986 defines it, or an image in a
// format that it does not know.
bool hasUnusualUri(std::string_view text) {
  constexpr std::string_view kKey = "\"uri\"";
  constexpr std::string_view kImages[] = {"jpeg;base64,", "png;base64,", "bmp;base64,", "gif;base64,"};
  for (std::size_t at = text.find(kKey); at != text.npos; at = text.find(kKey, at + 1)) {
    std::string_view uri = text.substr(at + kKey.size());
    uri.remove_prefix(std::min(uri.find_first_not_of(" \t\r\n:"), uri.size()));
    if (!uri.starts_with('"')) continue;
    uri.remove_prefix(1);
    constexpr std::string_view kImage = "data:image/";
    if (uri.starts_with(kImage)) {
      const auto isKind = [&](std::string_view kind) { return uri.substr(kImage.size()).starts_with(kind); };
      if (!std::ranges::any_of(kImages, isKind)) return true;
    } else if (!isData(uri) && uri.substr(0, uri.find('"')).find_first_of("%+\\") != uri.npos) {
      return true;
    }
  }
  return false;
}

int hexValue(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

// Replaces %HH by the byte that it means. A percent sign without two hexadecimal digits stays.
std::string percentDecoded(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const int high = uri[i] == '%' && i + 2 < uri.size() ? hexValue(uri[i + 1]) : -1;
    const int low = high >= 0 ? hexValue(uri[i + 2]) : -1;
    text += low >= 0 ? static_cast<char>(16 * high + low) : uri[i];
    if (low >= 0) i += 2;
  }
  return text;
}

// Gives the buffer a URI that tinygltf reads as the name of its file. If there is no file with the name that
// the URI means, but one that is named like the URI itself, that one is meant.
void setFileName(json& buffer, const FileExists& exists) {
  const json& uri = member(buffer, "uri");
  if (!uri.is_string() || isData(uri.get_ref<const std::string&>())) return;
  const std::string& written = uri.get_ref<const std::string&>();
  const std::string decoded = percentDecoded(written);
  std::string encoded;
  for (const char c : !exists(decoded) && exists(written) ? written : decoded) {
    if (c == '%' || c == '+')
      encoded += c == '%' ? "%25" : "%2B";
    else
      encoded += c;
  }
  buffer["uri"] = encoded;
}

std::string withJson(const std::string& bytes, bool binary, std::string text) {
  if (!binary) return text;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t rest = kHeaderBytes + kChunkHeaderBytes + jsonOf(bytes, true).size();
  std::string changed = bytes.substr(0, kHeaderBytes + kChunkHeaderBytes) + text + bytes.substr(rest);
  putWord(changed, kHeaderBytes, text.size());
  // Bytes after the stated length stay where they are.
  putWord(changed, kHeaderBytes - 4, wordAt(bytes, kHeaderBytes - 4) + changed.size() - bytes.size());
  return changed;
}

}  // namespace

std::optional<std::string> unsupportedGltf(const std::string& bytes, bool binary) {
  if (binary && bytes.size() >= kHeaderBytes && bytes.starts_with("glTF") && wordAt(bytes, 4) == 1)
    return versionError("1.0");
  const json root = parsed(jsonOf(bytes, binary));
  const json& version = member(member(root, "asset"), "version");
  // Lists of glTF 1.0 are objects.
  const bool isOld = member(root, "meshes").is_object() || member(root, "accessors").is_object();
  if (version.is_string() && version.get_ref<const std::string&>().starts_with("1."))
    return versionError(version.get_ref<const std::string&>().substr(0, 8));
  if (isOld) return versionError("1.0");
  for (const char* list : {"extensionsRequired", "extensionsUsed"})
    for (const json& extension : member(root, list))
      if (extension == kMeshoptExtension) return meshoptError();
  return std::nullopt;
}

std::optional<std::string> missingFile(const std::string& bytes, bool binary, const FileExists& exists) {
  const json root = parsed(jsonOf(bytes, binary));
  const json& buffers = member(root, "buffers");
  for (std::size_t i = 0; buffers.is_array() && i < buffers.size(); ++i) {
    const json& uri = member(buffers[i], "uri");
    if (!uri.is_string() || isData(uri.get_ref<const std::string&>())) continue;
    const std::string name = percentDecoded(uri.get_ref<const std::string&>());
    if (!exists(name))
      return fmt::format(
          "buffer {} is the file \"{}\", which is not a file in the folder of this one or below: copy it "
          "there",
          i, excerpt(name, 200));
  }
  return std::nullopt;
}

tl::expected<std::string, std::string> prepareGltf(std::string bytes, bool binary, const FileExists& exists) {
  const std::string_view text = jsonOf(bytes, binary);
  const bool isCompressed = text.find(kDracoExtension) != text.npos, hasUris = hasUnusualUri(text);
  if (!isCompressed && !hasUris) return bytes;
  json root = parsed(text);
  if (root.is_discarded())
    return tl::unexpected(
        fmt::format("is not glTF 2.0: its JSON is broken, or nested more than {} levels deep", kMaxDepth));
  if (!root.is_object()) return bytes;
  if (isCompressed && root.contains("accessors")) {
    json& accessors = root["accessors"];
    for (const json& mesh : member(root, "meshes"))
      for (const json& primitive : member(mesh, "primitives")) addView(primitive, accessors);
  }
  if (hasUris) {
    root.erase("images");  // they are not needed
    if (root.contains("buffers"))
      for (json& buffer : root["buffers"]) setFileName(buffer, exists);
  }
  return withJson(bytes, binary, root.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace clothstream::meshes

// SPDX-License-Identifier: MIT
// Reads Wavefront OBJ with tinyobjloader.
#include <istream>
#include <streambuf>

#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include "server/meshes/mesh_file.h"

namespace clothstream::meshes {
namespace {

// Stream over a text without a copy.
class TextBuffer : public std::streambuf {
 public:
  explicit TextBuffer(std::string_view text) {
    char* begin = const_cast<char*>(text.data());  // a stream never writes to its get area
    setg(begin, begin, begin + text.size());
  }
};

// Whether the text contains an exponent that the loader cannot hold in an int.
bool hasLongExponent(std::string_view text) {
  constexpr std::size_t kMaxDigits = 8;
  for (std::size_t at = text.find_first_of("eE"); at != text.npos; at = text.find_first_of("eE", at + 1)) {
    std::size_t first = at + 1;
    if (first < text.size() && (text[first] == '+' || text[first] == '-')) ++first;
    const std::size_t end = std::min(text.find_first_not_of("0123456789", first), text.size());
    if (first < end && end - first > kMaxDigits) return true;
  }
  return false;
}

// The loader silently reads text that is not a number as 0.
tl::expected<void, std::string> checkVertexLines(std::string_view text) {
  std::size_t line = 1;
  for (std::size_t start = 0; start < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string_view content = text.substr(start, end - start);
    const std::size_t word = std::min(content.find_first_not_of(" \t"), content.size());
    const bool isVertex = content.substr(word, 2) == "v " || content.substr(word, 2) == "v\t";
    if (isVertex && content.find_first_not_of("0123456789+-.eE \t\r", word + 2) != content.npos)
      return tl::unexpected(fmt::format("line {} is \"{}\": a vertex's coordinates must be finite numbers",
                                        line, content.substr(0, 60)));
    const bool hasNumbers = content.substr(word, 1) == "v";  // v, vt, vn
    if (hasNumbers && hasLongExponent(content))
      return tl::unexpected(fmt::format("line {} is \"{}\": an exponent must have at most eight digits", line,
                                        content.substr(0, 60)));
    start = end + 1;
  }
  return {};
}

// Callbacks of the loader, one for each kind of statement.
class ObjReader {
 public:
  tl::expected<MeshSource, std::string> read(std::string_view text) {
    TextBuffer buffer(text);
    std::istream stream(&buffer);
    tinyobj::callback_t callbacks;
    callbacks.vertex_cb = [](void* self, float x, float y, float z, float) { of(self).vertex(x, y, z); };
    callbacks.texcoord_cb = [](void* self, float u, float v, float) {
      of(self).source_.uvs.emplace_back(u, v);
    };
    callbacks.index_cb = [](void* self, tinyobj::index_t* corners, int count) {
      of(self).face(std::span(corners, static_cast<std::size_t>(count)));
    };
    callbacks.usemtl_cb = [](void* self, const char* name, int) { of(self).enter(of(self).material_, name); };
    callbacks.object_cb = [](void* self, const char* name) { of(self).enter(of(self).object_, name); };
    callbacks.group_cb = [](void* self, const char** names, int count) {
      of(self).enter(of(self).object_, count > 0 ? names[0] : "");
    };
    std::string warning, error;
    const bool read = tinyobj::LoadObjWithCallback(stream, callbacks, this, nullptr, &warning, &error);
    if (!read) return tl::unexpected(fmt::format("is not OBJ: {}", error));
    if (!everyCornerHasUv_) source_.uvs.clear();
    return std::move(source_);
  }

 private:
  static ObjReader& of(void* self) { return *static_cast<ObjReader*>(self); }

  void vertex(float x, float y, float z) { source_.vertices.emplace_back(x, y, z); }

  void enter(std::string& name, const char* value) {
    name = value;
    partOpen_ = false;
  }

  void face(std::span<const tinyobj::index_t> corners) {
    if (!partOpen_) source_.parts.push_back({material_.empty() ? object_ : material_, source_.faces.size()});
    partOpen_ = true;
    SourceFace& face = source_.faces.emplace_back();
    face.cornerCount = static_cast<std::uint32_t>(corners.size());
    if (!face.isInline()) face.vertices[0] = static_cast<std::uint32_t>(source_.corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const SourceCorner corner{absolute(corners[i].vertex_index, source_.vertices.size()),
                                absolute(corners[i].texcoord_index, source_.uvs.size())};
      if (face.isInline())
        face.vertices[i] = corner.vertex, face.uvs[i] = corner.uv;
      else
        source_.corners.push_back(corner);
      everyCornerHasUv_ = everyCornerHasUv_ && corners[i].texcoord_index != 0;
    }
  }

  // Indices count from 1, or backwards from the newest element if negative. Any other index becomes too
  // large, and buildMesh() refuses it.
  static std::uint32_t absolute(int index, std::size_t count) {
    return static_cast<std::uint32_t>(index > 0    ? index - 1
                                      : index == 0 ? -1
                                                   : static_cast<int>(count) + index);
  }

  MeshSource source_;
  std::string object_, material_;
  bool partOpen_ = false, everyCornerHasUv_ = true;
};

}  // namespace

tl::expected<MeshSource, std::string> parseObj(std::string_view text) {
  if (const auto checked = checkVertexLines(text); !checked) return tl::unexpected(checked.error());
  return ObjReader().read(text);
}

}  // namespace clothstream::meshes

// SPDX-License-Identifier: MIT
// Reads Wavefront OBJ with tinyobjloader.
#include <algorithm>
#include <istream>
#include <span>
#include <streambuf>

#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include "proto/text/excerpt.h"
#include "proto/text/lines.h"
#include "proto/text/utf8.h"
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

constexpr std::string_view kSpace = " \t\r";

std::string_view firstWord(std::string_view line) {
  line.remove_prefix(std::min(line.find_first_not_of(kSpace), line.size()));
  return line.substr(0, line.find_first_of(kSpace));
}

// Removes a whole number, as short as one that an int holds, from the start of the text. A corner has no
// element 0.
bool takeIndex(std::string_view& text) {
  constexpr std::size_t kMaxDigits = 9;
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  const bool isZero = text.substr(0, digits).find_first_not_of('0') == text.npos;
  text.remove_prefix(digits);
  return digits > 0 && digits <= kMaxDigits && !isZero;
}

// Whether the word is V, V/VT, V//VN or V/VT/VN.
bool isCorner(std::string_view word) {
  if (!takeIndex(word)) return false;
  for (int more = 0; more < 2 && word.starts_with('/'); ++more) {
    word.remove_prefix(1);
    if (!word.empty() && !word.starts_with('/') && !takeIndex(word)) return false;
  }
  return word.empty();
}

bool hasOnlyCorners(std::string_view words) {
  for (std::string_view word = firstWord(words); !word.empty(); word = firstWord(words)) {
    if (!isCorner(word)) return false;
    words.remove_prefix(static_cast<std::size_t>(word.data() - words.data()) + word.size());
  }
  return true;
}

// Problem of a line that the loader would read as something else, or null. The loader takes text that is not
// a number for 0.
const char* problemOf(std::string_view line) {
  const std::string_view keyword = firstWord(line);
  if (keyword.empty()) return nullptr;
  const std::string_view values =
      line.substr(static_cast<std::size_t>(keyword.data() - line.data()) + keyword.size());
  const bool isVertex = keyword == "v", isCoordinate = keyword == "vt";
  if ((isVertex || isCoordinate) && values.find_first_not_of("0123456789+-.eE \t\r") != values.npos)
    return isVertex ? "a vertex's coordinates must be finite numbers"
                    : "texture coordinates must be finite numbers";
  if ((isVertex || isCoordinate || keyword == "vn") && hasLongExponent(values))
    return "an exponent must have at most eight digits";
  if (keyword == "f" && !hasOnlyCorners(values))
    return "a corner of a face must be V, V/VT, V//VN or V/VT/VN, with whole numbers that count from 1, or "
           "from -1 backwards";
  if ((keyword == "usemtl" || keyword == "o" || keyword == "g") && !isUtf8(values))
    return "a name must be UTF-8, and this one has another encoding: save the file as UTF-8, or rename it";
  return nullptr;
}

// Text for the loader, which knows no continued lines. `storage` holds the result if it is another text.
tl::expected<std::string_view, std::string> checkedText(std::string_view text, std::string& storage) {
  const bool mayContinue = text.find('\\') != text.npos;
  for (ContinuedLines lines(text); lines.next();) {
    if (lines.text().find('\0') != text.npos)
      return tl::unexpected(
          fmt::format("line {} has a zero byte, which no OBJ file has: export it again", lines.number()));
    if (const char* problem = problemOf(lines.text()))
      return tl::unexpected(
          fmt::format("line {} is \"{}\": {}", lines.number(), excerpt(lines.text()), problem));
    if (mayContinue) storage.append(lines.text()) += '\n';
  }
  return mayContinue ? std::string_view(storage) : text;
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
    if (!problem_.empty()) return tl::unexpected(std::move(problem_));
    if (!everyCornerHasUv_) source_.uvs.clear();
    return std::move(source_);
  }

 private:
  static ObjReader& of(void* self) { return *static_cast<ObjReader*>(self); }

  void vertex(float x, float y, float z) { source_.vertices.emplace_back(x, y, z); }

  void enter(std::string& name, const char* value) {
    name = value;
    name.erase(name.find_last_not_of(kSpace) + 1);
    partOpen_ = false;
  }

  void face(std::span<const tinyobj::index_t> corners) {
    if (!partOpen_) source_.parts.push_back({material_.empty() ? object_ : material_, source_.faces.size()});
    partOpen_ = true;
    SourceFace& face = source_.faces.emplace_back();
    face.cornerCount = static_cast<std::uint32_t>(corners.size());
    if (!face.isInline()) face.vertices[0] = static_cast<std::uint32_t>(source_.corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const SourceCorner corner{
          absolute("vertex", corners[i].vertex_index, source_.vertices.size()),
          absolute("texture coordinate", corners[i].texcoord_index, source_.uvs.size())};
      if (face.isInline())
        face.vertices[i] = corner.vertex, face.uvs[i] = corner.uv;
      else
        source_.corners.push_back(corner);
      everyCornerHasUv_ = everyCornerHasUv_ && corners[i].texcoord_index != 0;
    }
  }

  // Indices count from 1, or backwards from the newest element if negative. No index (0) becomes too large.
  std::uint32_t absolute(std::string_view what, int index, std::size_t count) {
    if (index >= 0) return static_cast<std::uint32_t>(index - 1);
    const std::int64_t element = static_cast<std::int64_t>(count) + index;
    if (element < 0 && problem_.empty())
      problem_ = fmt::format("face {} names {} {}, but only {} come before it", source_.faces.size() - 1,
                             what, index, count);
    return static_cast<std::uint32_t>(element);
  }

  MeshSource source_;
  std::string object_, material_;
  std::string problem_;  // first face that names nothing
  bool partOpen_ = false, everyCornerHasUv_ = true;
};

}  // namespace

tl::expected<MeshSource, std::string> parseObj(std::string_view text) {
  if (isWideText(text))
    return tl::unexpected(
        std::string("is text in UTF-16 or UTF-32, which is not supported: save it as UTF-8"));
  std::string storage;
  const auto checked = checkedText(withoutByteOrderMark(text), storage);
  if (!checked) return tl::unexpected(checked.error());
  return ObjReader().read(*checked);
}

}  // namespace clothstream::meshes

// SPDX-License-Identifier: MIT
// Reads line by line. Numbers must be complete, unlike in readers that take unreadable text for 0.
#include "clients/files/obj_surface.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "clients/files/regular_file.h"
#include "proto/codec/stream_layout.h"
#include "proto/text/excerpt.h"
#include "proto/text/lines.h"

namespace clothstream::files {
namespace {

// Removes and returns the next word; "" at the end of the line.
std::string_view takeWord(std::string_view& line) {
  constexpr std::string_view kSpace = " \t\r";
  line.remove_prefix(std::min(line.find_first_not_of(kSpace), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kSpace));
  line.remove_prefix(word.size());
  return word;
}

template <typename T>
bool parse(std::string_view text, T& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

class ObjParser {
 public:
  // Returns what is wrong with the line; "" if nothing is.
  std::string take(std::string_view line) {
    const std::string_view keyword = takeWord(line);
    if (keyword == "v") return takeVertex(line);
    if (keyword == "f") return takeFace(line);
    return {};
  }
  ObjSurface surface;

 private:
  std::string takeVertex(std::string_view line) {
    for (int axis = 0; axis < 3; ++axis) {
      double coordinate = 0;
      if (!parse(takeWord(line), coordinate) || !std::isfinite(static_cast<float>(coordinate)))
        return "a vertex needs three finite numbers";
      surface.positions.push_back(static_cast<float>(coordinate));
    }
    if (surface.positions.size() / 3 > codec::kMaxVertices)
      return fmt::format("there are more than {} vertices", codec::kMaxVertices);
    return {};
  }

  std::string takeFace(std::string_view line) {
    const auto vertices = static_cast<std::int64_t>(surface.positions.size() / 3);
    std::uint32_t first = 0, before = 0;
    std::size_t corners = 0;
    for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line), ++corners) {
      std::int64_t index = 0;
      if (!parse(word.substr(0, word.find('/')), index))
        return "a corner of a face needs the number of a vertex";
      // Numbers count from 1, or backwards from the newest vertex.
      const std::int64_t vertex = index < 0 ? vertices + index : index - 1;
      if (vertex < 0 || vertex >= vertices)
        return fmt::format("a face has vertex {}, but {} vertices come before it", index, vertices);
      const auto corner = static_cast<std::uint32_t>(vertex);
      if (corners == 0) first = corner;
      if (corners >= 2) surface.triangles.push_back({first, before, corner});
      before = corner;
    }
    return corners < 3 ? "a face needs three corners or more" : std::string();
  }
};

}  // namespace

tl::expected<ObjSurface, std::string> readObjSurface(const std::string& path) {
  auto file = openRegularFile(path);
  if (!file) return tl::unexpected(file.error());
  const std::string content(std::istreambuf_iterator<char>(file->stream), {});
  if (isWideText(content))
    return tl::unexpected(
        fmt::format("{} is text in UTF-16 or UTF-32, which is not supported: save it as UTF-8", path));
  ObjParser parser;
  for (ContinuedLines lines(withoutByteOrderMark(content)); lines.next();)
    if (const std::string wrong = parser.take(lines.text()); !wrong.empty())
      return tl::unexpected(
          fmt::format("{}: line {} is \"{}\": {}", path, lines.number(), excerpt(lines.text()), wrong));
  if (parser.surface.positions.empty() || parser.surface.triangles.empty())
    return tl::unexpected(fmt::format("{} is not an OBJ file with vertices and faces", path));
  return std::move(parser.surface);
}

}  // namespace clothstream::files

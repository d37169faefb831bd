// SPDX-License-Identifier: MIT
// Vertices, normals, and faces in groups.
#include "clients/cli/obj_file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace clothstream::cli {
namespace {

std::string problem(const std::string& path) {
  return fmt::format("cannot write {}: {}", path, std::strerror(errno));
}

void appendTriples(std::string& text, const char* keyword, const float* values, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i)
    fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", keyword, values[3 * i], values[3 * i + 1],
                   values[3 * i + 2]);
}

// OBJ counts from 1; a vertex and its normal have the same number.
void appendFaces(std::string& text, const std::uint32_t* indices, std::uint32_t count) {
  for (std::uint32_t i = 0; i + 2 < count; i += 3)
    fmt::format_to(std::back_inserter(text), "f {0}//{0} {1}//{1} {2}//{2}\n", indices[i] + 1,
                   indices[i + 1] + 1, indices[i + 2] + 1);
}

std::string objText(const cs_client* client) {
  std::string text;
  const std::uint32_t vertices = cs_vertex_count(client);
  std::uint32_t indexCount = 0;
  const std::uint32_t* indices = cs_triangles(client, &indexCount);
  cs_statistics statistics;
  cs_get_statistics(client, 0, &statistics);
  fmt::format_to(std::back_inserter(text), "# scene {}, tick {}; metres, +Y up\n", cs_scene_name(client),
                 statistics.tick);
  appendTriples(text, "v", cs_positions(client), vertices);
  appendTriples(text, "vn", cs_normals(client), vertices);
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i) {
    fmt::format_to(std::back_inserter(text), "g {}\n", cloth.name);
    appendFaces(text, indices + cloth.first_index, cloth.index_count);
  }
  return text;
}

bool writeWhole(int file, const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = ::write(file, text.data() + written, text.size() - written);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) written += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace

tl::expected<ObjFile, std::string> ObjFile::create(const std::string& path) {
  struct stat present {};
  if (::stat(path.c_str(), &present) == 0 && S_ISDIR(present.st_mode)) {
    errno = EISDIR;
    return tl::unexpected(problem(path));
  }
  std::string temporary = path + ".XXXXXX";
  const int file = ::mkostemp(temporary.data(), O_CLOEXEC);
  if (file < 0) return tl::unexpected(problem(path));
  // mkostemp makes files for their owner alone: this one is to be like any other.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(file, 0666 & ~mask);
  return ObjFile(path, std::move(temporary), file);
}

ObjFile::ObjFile(ObjFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      file_(std::exchange(other.file_, -1)) {}

ObjFile::~ObjFile() {
  if (file_ < 0) return;
  ::close(file_);
  ::unlink(temporary_.c_str());
}

tl::expected<void, std::string> ObjFile::write(const cs_client* client) {
  if (!writeWhole(file_, objText(client)) || ::fsync(file_) != 0) return tl::unexpected(problem(path_));
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) return tl::unexpected(problem(path_));
  ::close(std::exchange(file_, -1));
  return {};
}

}  // namespace clothstream::cli

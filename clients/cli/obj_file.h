// SPDX-License-Identifier: MIT
// The cloths of a client as a Wavefront OBJ file.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clients/core/core.h"

namespace clothstream::cli {

// Written beside its place and then moved there: whoever reads the path sees a whole file or the former one.
class ObjFile {
 public:
  // Opens the file that is written; the error names the path and what the system said of it.
  [[nodiscard]] static tl::expected<ObjFile, std::string> create(const std::string& path);
  ~ObjFile();
  ObjFile(ObjFile&& other) noexcept;
  ObjFile& operator=(ObjFile&&) = delete;

  // Positions and normals of the newest frame, a group for each cloth. Once.
  [[nodiscard]] tl::expected<void, std::string> write(const cs_client* client);

 private:
  ObjFile(std::string path, std::string temporary, int file)
      : path_(std::move(path)), temporary_(std::move(temporary)), file_(file) {}

  std::string path_, temporary_;
  int file_ = -1;  // -1: moved into place, or to another ObjFile
};

}  // namespace clothstream::cli

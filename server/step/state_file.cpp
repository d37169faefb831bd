// SPDX-License-Identifier: MIT
// Raw frames, and their description in JSON.
#include "server/step/state_file.h"

#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace clothstream::step {
namespace {

static_assert(std::endian::native == std::endian::little);

[[noreturn]] void fail(const std::filesystem::path& path) {
  throw FileError(fmt::format("cannot write {}: {}", path.string(), std::strerror(errno)));
}

}  // namespace

StateFile::StateFile(std::filesystem::path path)
    : path_(std::move(path)), file_(path_, std::ios::binary | std::ios::trunc) {
  if (!file_) fail(path_);
  std::error_code none;
  std::filesystem::remove(sidecar(), none);  // it describes an earlier file
}

std::filesystem::path StateFile::sidecar() const {
  return path_.string() + ".json";
}

void StateFile::append(std::span<const std::byte> frame) {
  file_.write(reinterpret_cast<const char*>(frame.data()), static_cast<std::streamsize>(frame.size()));
  if (!file_) fail(path_);
  ++frames_;
}

void StateFile::finish(const nlohmann::ordered_json& description, std::uint32_t nodes) {
  file_.close();
  if (!file_) fail(path_);
  nlohmann::ordered_json whole{{"format", "clothstream-state-1"},
                               {"file", path_.filename().string()},
                               {"dtype", "<f4"},
                               {"shape", {frames_, nodes, 6}},
                               {"columns", {"px", "py", "pz", "vx", "vy", "vz"}}};
  whole.update(description);
  const std::filesystem::path temporary = sidecar().string() + ".part";
  std::ofstream out(temporary);
  // Names of devices and files may not be UTF-8.
  out << whole.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
  out.close();
  if (!out) fail(temporary);
  std::error_code problem;
  std::filesystem::rename(temporary, sidecar(), problem);
  if (problem) throw FileError(fmt::format("cannot write {}: {}", sidecar().string(), problem.message()));
}

nlohmann::ordered_json describeCloths(const model::Scene& scene) {
  using Json = nlohmann::ordered_json;
  Json cloths = Json::array();
  std::uint32_t first = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    Json& entry =
        cloths.emplace_back(Json{{"name", cloth.name}, {"firstNode", first}, {"nodes", cloth.nodeCount()}});
    if (!cloth.mesh) {
      entry["rows"] = cloth.grid.rows;
      entry["columns"] = cloth.grid.columns;
    }
    first += cloth.nodeCount();
  }
  return cloths;
}

}  // namespace clothstream::step

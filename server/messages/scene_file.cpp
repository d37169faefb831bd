// SPDX-License-Identifier: MIT
// Reads and writes scene files.
#include "server/messages/scene_file.h"

#include <optional>

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <nlohmann/json.hpp>

#include "proto/text/excerpt.h"
#include "proto/text/lines.h"
#include "proto/text/utf8.h"
#include "server/files/regular_file.h"
#include "server/meshes/mesh_file.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"

namespace clothstream::messages {
namespace {

tl::unexpected<FieldError> refuse(v1::ErrorCode code, std::string_view source, std::string_view text) {
  return tl::unexpected(FieldError{code, fmt::format("{}: {}", source, text)});
}

// Bytes of an error that quotes text in another encoding.
constexpr std::size_t kShownError = 300;

// Line and column where the text is not JSON. The parser of protobuf does not report them.
std::optional<std::string> syntaxError(std::string_view json) {
  try {
    [[maybe_unused]] const nlohmann::json parsed = nlohmann::json::parse(json);
    return std::nullopt;
  } catch (const nlohmann::json::exception& error) {
    const std::string_view what = error.what();
    const std::size_t after = what.find("] ");  // skips the identifier of the exception
    return std::string(after == what.npos ? what : what.substr(after + 2));
  }
}

}  // namespace

Result<model::Scene> parseScene(std::string_view json, std::string_view source, const MeshReader& readMesh,
                                std::uint64_t maxNodes, std::vector<v1::MeshRepair>* repairs) {
  if (isWideText(json))
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE, source,
                  "is text in UTF-16 or UTF-32, which is not supported: save it as UTF-8");
  json = withoutByteOrderMark(json);
  if (const auto error = syntaxError(json))
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE, source,
                  isUtf8(json) ? *error : excerpt(*error, kShownError) + ": save the file as UTF-8");
  v1::Scene message;
  const auto status = google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &message);
  if (!status.ok()) {
    std::string_view what(status.message().data(), status.message().size());
    if (what.ends_with('.')) what.remove_suffix(1);
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE, source,
                  fmt::format("not a scene: {}; correct or remove it", what));
  }
  return toScene(message, readMesh, {.nodes = maxNodes}, repairs).map_error([&](const FieldError& error) {
    return FieldError{error.code, fmt::format("{}: {}", source, error.text)};
  });
}

Result<model::Scene> readSceneFile(const std::filesystem::path& path, std::vector<v1::MeshRepair>* repairs) {
  const std::string source = path.string();
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found)
    return refuse(v1::ERROR_CODE_NOT_FOUND, source, "there is no such file");
  if (kind == std::filesystem::file_type::directory)
    return refuse(v1::ERROR_CODE_INVALID_ARGUMENT, source, "is a directory; must be a file");
  const auto text = files::readFileOrFifo(path, limits::kMaxSceneFileBytes);
  if (!text)
    return refuse(
        text.error().isTooLarge ? v1::ERROR_CODE_RESOURCE_EXHAUSTED : v1::ERROR_CODE_INVALID_ARGUMENT, source,
        text.error().text);
  const auto readMesh = [&](const std::string& mesh, const meshes::JointRequest* joints) {
    return meshes::readMeshFile(path.parent_path() / mesh,
                                {.bytes = limits::kMaxMeshFileBytes, .vertices = limits::kMaxNodes}, joints);
  };
  return parseScene(*text, source, readMesh, limits::kMaxNodes, repairs);
}

std::string toJson(const model::Scene& scene) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.always_print_primitive_fields = true;
  std::string json;
  // Fails only on Any fields, and a Scene has none.
  static_cast<void>(google::protobuf::util::MessageToJsonString(toMessage(scene), &json, options));
  return json;
}

}  // namespace clothstream::messages

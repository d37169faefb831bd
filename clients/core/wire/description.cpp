// SPDX-License-Identifier: MIT
// Reads and checks a StreamDescription, and adds triangles and normals.
#include "clients/core/wire/description.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>

#include "proto/codec/packet_header.h"
#include "proto/codec/vertex_normals.h"
#include "proto/parameters/apply_change.h"

namespace clothstream::client {
namespace {

constexpr std::uint32_t kMaxRate = 1000;  // Hz; limit of scene.proto

bool isFinite(float number) {
  return std::isfinite(number);
}

struct ClothMessage {
  std::string name;
  codec::ClothLayout layout;
  Bytes restPositions, triangles, uvs, uvTriangles;
  std::vector<Submesh> submeshes;  // firstIndex is set later
};

// Metres, on each axis. Far beyond any scene, and small enough that normals can be computed with floats.
constexpr float kMaxRestCoordinate = 1e6f;
constexpr std::size_t kMaxSubmeshes = 65536;  // of all cloths
constexpr std::size_t kCornerBytes = sizeof(std::uint32_t), kPositionBytes = 3 * sizeof(float);
constexpr std::size_t kMaxMaterials = 1024;

bool readSubmesh(Bytes message, Submesh& submesh) {
  using F = field::Submesh;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kName.tag) return setText(submesh.name, reader);
    if (tag != F::kTriangleCount.tag) return skip(reader);
    const std::uint32_t triangles = reader.get_uint32();
    submesh.indexCount = 3 * triangles;
    return triangles <= codec::kMaxVertices;
  });
}

// `submeshes` counts those of all cloths.
bool readCloth(Bytes message, ClothMessage& cloth, std::size_t& submeshes) {
  using F = field::ClothDescription;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kName.tag:
        return setText(cloth.name, reader);
      case F::kVertexCount.tag:
        return cloth.layout.vertexCount = reader.get_uint32(), true;
      case F::kRows.tag:
        return cloth.layout.rows = reader.get_uint32(), true;
      case F::kColumns.tag:
        return cloth.layout.columns = reader.get_uint32(), true;
      case F::kRestPositions.tag:
        return cloth.restPositions = reader.get_view(), true;
      case F::kTriangles.tag:
        return cloth.triangles = reader.get_view(), true;
      case F::kUvs.tag:
        return cloth.uvs = reader.get_view(), true;
      case F::kUvTriangles.tag:
        return cloth.uvTriangles = reader.get_view(), true;
      case F::kSubmeshes.tag:
        return submeshes++ < kMaxSubmeshes && readSubmesh(reader.get_view(), cloth.submeshes.emplace_back());
      default:
        return skip(reader);
    }
  });
}

bool readDefinition(Bytes message, Description& description) {
  using F = field::Scene;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kEnvironment.tag) return readEnvironment(reader.get_view(), description.environment);
    if (tag != F::kCloths.tag) return skip(reader);
    std::string name;
    ClothParameters parameters;
    if (!readClothParameters(reader.get_view(), name, parameters)) return false;
    parameters.solvers[parameters.solver.kind] = parameters.solver;
    for (Cloth& cloth : description.cloths) {
      if (cloth.name == name) cloth.parameters = parameters;
    }
    return true;
  });
}

// Returns false if the message is not well formed. Wrong values are left to check().
bool readParts(Bytes message, Description& description, std::vector<ClothMessage>& cloths,
               Bytes& definition) {
  using F = field::StreamDescription;
  std::size_t submeshes = 0;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kEpoch.tag:
        return description.layout.epoch = reader.get_uint32(), true;
      case F::kCodec.tag:
        description.codec = reader.get_uint32();
        description.layout.codec = static_cast<std::uint8_t>(description.codec);
        return true;
      case F::kScene.tag:
        return setText(description.scene, reader);
      case F::kSimulationRate.tag:
        return description.simulationRate = reader.get_uint32(), true;
      case F::kStreamRate.tag:
        return description.streamRate = reader.get_uint32(), true;
      case F::kMaxError.tag:
        return description.layout.maxError = reader.get_float(), true;
      case F::kNormals.tag:
        description.layout.normals = reader.get_uint32() == field::Normals::kOctahedral
                                         ? codec::NormalMode::octahedral
                                         : codec::NormalMode::none;
        return true;
      case F::kCloths.tag:
        return cloths.size() <= codec::kMaxClothRanges &&
               readCloth(reader.get_view(), cloths.emplace_back(), submeshes);
      case F::kColliders.tag:
        return description.colliders.size() < kMaxSceneColliders &&
               readCollider(reader.get_view(), description.colliders.emplace_back());
      case F::kDefinition.tag:
        return definition = reader.get_view(), true;
      case F::kQualities.tag:
        description.layout.qualities =
            static_cast<std::uint8_t>(std::clamp<std::uint32_t>(reader.get_uint32(), 1, 255));
        return true;
      case F::kOrigin.tag:
        return readVec3(reader.get_view(), description.layout.origin);
      case F::kMaterials.tag:
        return description.materials.size() < kMaxMaterials &&
               setText(description.materials.emplace_back(), reader);
      default:
        return skip(reader);
    }
  });
}

std::string quoted(const std::string& name) {
  return "cloth \"" + name + "\"";
}

// Appends little-endian numbers. Returns false if the last number is incomplete.
template <typename T>
bool appendNumbers(Bytes bytes, std::vector<T>& out) {
  static_assert(std::endian::native == std::endian::little);
  const std::size_t first = out.size();
  out.resize(first + bytes.size() / sizeof(T));
  if (out.size() > first) std::memcpy(out.data() + first, bytes.data(), (out.size() - first) * sizeof(T));
  return bytes.size() % sizeof(T) == 0;
}

bool allBelow(const std::vector<std::uint32_t>& numbers, std::size_t limit) {
  return std::all_of(numbers.begin(), numbers.end(), [&](std::uint32_t number) { return number < limit; });
}

// Reads texture coordinates and submeshes. Returns the error; empty if they match the triangles.
std::string readDrawing(const ClothMessage& source, Cloth& cloth) {
  const bool whole =
      appendNumbers(source.uvs, cloth.uvs) && appendNumbers(source.uvTriangles, cloth.uvIndices);
  if (!whole || cloth.uvs.size() % 2 != 0 || !std::all_of(cloth.uvs.begin(), cloth.uvs.end(), isFinite))
    return "uvs are not pairs of finite numbers";
  if (cloth.uvIndices.size() != (cloth.uvs.empty() ? 0 : cloth.indexCount) ||
      !allBelow(cloth.uvIndices, cloth.uvs.size() / 2))
    return "uv_triangles are not one of " + std::to_string(cloth.uvs.size() / 2) +
           " texture coordinates for each of " + std::to_string(cloth.indexCount) + " corners";
  std::uint64_t next = cloth.firstIndex;
  for (const Submesh& submesh : source.submeshes) {
    cloth.submeshes.push_back({submesh.name, static_cast<std::uint32_t>(next), submesh.indexCount});
    next += submesh.indexCount;
  }
  if (!source.submeshes.empty() && next != std::uint64_t{cloth.firstIndex} + cloth.indexCount)
    return "submeshes do not cover its " + std::to_string(cloth.indexCount / 3) + " triangles";
  return {};
}

// Returns the error; empty if the numbers agree.
std::string check(const Description& description, const std::vector<ClothMessage>& cloths) {
  if (!codec::isCodec(description.codec))
    return "codec is " + std::to_string(description.codec) + "; this client decodes codec " +
           std::to_string(codec::kCodecHierarchical);
  const std::uint32_t simulation = description.simulationRate, stream = description.streamRate;
  if (simulation == 0 || simulation > kMaxRate)
    return "simulation_rate is " + std::to_string(simulation) + "; 1 to " + std::to_string(kMaxRate) +
           " is allowed";
  if (stream == 0 || simulation % stream != 0)
    return "stream_rate is " + std::to_string(stream) + "; a divisor of " + std::to_string(simulation) +
           " is allowed";
  if (cloths.empty() || cloths.size() > codec::kMaxClothRanges)
    return std::to_string(cloths.size()) + " cloths; 1 to " + std::to_string(codec::kMaxClothRanges) +
           " are allowed";
  for (const ClothMessage& cloth : cloths) {
    if (cloth.restPositions.size() != std::uint64_t{cloth.layout.vertexCount} * 3 * sizeof(float))
      return quoted(cloth.name) + ": rest_positions has " + std::to_string(cloth.restPositions.size()) +
             " bytes for " + std::to_string(cloth.layout.vertexCount) +
             " vertices; 12 bytes per vertex are needed";
  }
  if (!codec::isPossible(description.layout))
    return "a cloth's rows x columns is not its vertex_count, a triangle names a vertex that is not there, "
           "there are "
           "no vertices or more than " +
           std::to_string(codec::kMaxVertices) + ", or max_error, qualities or origin is out of range";
  return {};
}

// Returns the error; empty if the geometry stays within the limits.
std::string checkLimits(const std::vector<ClothMessage>& cloths, const Limits& limits) {
  const auto exceeds = [](std::uint64_t count, const char* what, std::uint32_t most, const char* field) {
    return std::to_string(count) + " " + what + "; this client accepts at most " + std::to_string(most) +
           " (cs_limits." + field + ")";
  };
  if (cloths.size() > limits.cloths) return exceeds(cloths.size(), "cloths", limits.cloths, "max_cloths");
  std::uint64_t vertices = 0, triangles = 0;
  for (const ClothMessage& cloth : cloths) {
    vertices +=
        std::max<std::uint64_t>(cloth.layout.vertexCount, cloth.restPositions.size() / kPositionBytes);
    triangles += cloth.triangles.size() / (3 * kCornerBytes);
    if (cloth.layout.rows > 0 && cloth.layout.columns > 0)
      triangles += 2 * (std::uint64_t{cloth.layout.rows} - 1) * (cloth.layout.columns - 1);
  }
  if (vertices > limits.vertices) return exceeds(vertices, "vertices", limits.vertices, "max_vertices");
  if (triangles > limits.triangles) return exceeds(triangles, "triangles", limits.triangles, "max_triangles");
  return {};
}

void appendTriangles(const codec::ClothLayout& cloth, std::uint32_t firstVertex,
                     std::vector<std::uint32_t>& out) {
  for (const std::uint32_t vertex : cloth.triangles) out.push_back(firstVertex + vertex);
  for (std::uint32_t row = 0; row + 1 < cloth.rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < cloth.columns; ++column) {
      const std::uint32_t a = firstVertex + row * cloth.columns + column, b = a + 1;
      const std::uint32_t e = a + cloth.columns, f = e + 1;
      out.insert(out.end(), {a, e, b, b, e, f});
    }
  }
}

bool appendPositions(Bytes bytes, std::vector<float>& out) {
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  appendNumbers(bytes, out);
  return std::all_of(out.begin() + first, out.end(),
                     [](float coordinate) { return std::abs(coordinate) <= kMaxRestCoordinate; });
}

}  // namespace

tl::expected<Description, std::string> readDescription(Bytes message, const Limits& limits) {
  Description description;
  description.layout.maxError = 0;  // a missing field is zero
  std::vector<ClothMessage> cloths;
  Bytes definition;
  if (!readParts(message, description, cloths, definition))
    return tl::unexpected(std::string("it is not a StreamDescription"));
  if (std::string problem = checkLimits(cloths, limits); !problem.empty())
    return tl::unexpected(std::move(problem));
  for (ClothMessage& cloth : cloths) {
    if (!appendNumbers(cloth.triangles, cloth.layout.triangles))
      return tl::unexpected(quoted(cloth.name) + ": the size of triangles is not a multiple of 4 bytes");
    if (!cloth.layout.triangles.empty()) appendNumbers(cloth.restPositions, cloth.layout.restPositions);
    description.layout.cloths.push_back(cloth.layout);
  }
  if (std::string problem = check(description, cloths); !problem.empty())
    return tl::unexpected(std::move(problem));

  for (Collider& collider : description.colliders) {
    if (collider.hull.empty() && collider.mesh.empty()) continue;
    std::optional<Hull> hull = collider.mesh.empty() ? readHull(collider.hull) : readMesh(collider.mesh);
    if (!hull) return tl::unexpected("collider \"" + collider.name + "\" has a malformed hull or mesh");
    description.hulls[collider.name] = std::move(*hull);
    collider.hull = collider.mesh = {};
  }

  std::uint32_t firstVertex = 0;
  for (ClothMessage& source : cloths) {
    Cloth& cloth = description.cloths.emplace_back();
    cloth.firstVertex = firstVertex;
    cloth.firstIndex = static_cast<std::uint32_t>(description.triangles.size());
    appendTriangles(source.layout, firstVertex, description.triangles);
    cloth.indexCount = static_cast<std::uint32_t>(description.triangles.size()) - cloth.firstIndex;
    if (const std::string problem = readDrawing(source, cloth); !problem.empty())
      return tl::unexpected(quoted(source.name) + ": " + problem);
    firstVertex += source.layout.vertexCount;
    if (!appendPositions(source.restPositions, description.restPositions))
      return tl::unexpected(quoted(source.name) +
                            ": a rest position is not finite, or farther than 1000 km from the origin");
    cloth.name = std::move(source.name);
  }
  description.restNormals.resize(description.restPositions.size());
  codec::computeVertexNormals(description.layout, description.restPositions.data(),
                              description.restNormals.data());
  if (!readDefinition(definition, description))
    return tl::unexpected(std::string("its definition is not a Scene"));
  return description;
}

std::optional<ClothTriangle> triangleOf(std::uint32_t index, const Description& description) {
  for (std::size_t i = 0; i < description.cloths.size(); ++i) {
    const Cloth& cloth = description.cloths[i];
    const std::uint32_t first = cloth.firstIndex / 3, count = cloth.indexCount / 3;
    if (index >= first && index - first < count)
      return ClothTriangle{static_cast<std::uint32_t>(i), index - first};
  }
  return std::nullopt;
}

const Hull* hullOf(const Collider& collider, const Description& description) {
  if (collider.shape != CS_SHAPE_HULL || collider.participantId != 0) return nullptr;
  const auto found = description.hulls.find(collider.name);
  return found == description.hulls.end() ? nullptr : &found->second;
}

void apply(const ParameterChange& change, Description& description) {
  parameters::applyChange(change.environment, description.environment);
  parameters::applyToCloths(
      change.cloths, description.cloths,
      [](const ClothChange& clothChange, Cloth& cloth) { apply(clothChange, cloth.parameters); });
}

}  // namespace clothstream::client

// SPDX-License-Identifier: MIT
#include "tests/meshes/draco_sheet.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <utility>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#pragma GCC diagnostic pop

namespace clothstream::meshes {

using model::Vec3;

Vec3 wave(int x, int y, int side) {
  return Vec3(static_cast<float>(x), std::sin(0.4f * static_cast<float>(x + y)), static_cast<float>(y)) /
         static_cast<float>(side);
}

std::string compressedSheet(const DracoCoding& coding, int side, bool hasMetadata, bool hasSkin) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2 * side * side);
  const int positions = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int uvs = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  int joints = -1, weights = -1;
  if (hasSkin) {
    joints = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT8);
    weights = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 4, draco::DT_FLOAT32);
  }
  constexpr std::array<std::uint8_t, 4> kJoints{0, 1, 0, 0};
  draco::FaceIndex face(0);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (const auto& corners :
           {std::array{x, y, x + 1, y, x + 1, y + 1}, std::array{x, y, x + 1, y + 1, x, y + 1}}) {
        Vec3 p[3];
        model::Uv uv[3];
        for (std::size_t i = 0; i < 3; ++i) {
          p[i] = wave(corners[2 * i], corners[2 * i + 1], side);
          uv[i] = model::Uv(p[i].x(), p[i].z());
        }
        builder.SetAttributeValuesForFace(positions, face, p[0].data(), p[1].data(), p[2].data());
        builder.SetAttributeValuesForFace(uvs, face, uv[0].data(), uv[1].data(), uv[2].data());
        if (hasSkin) {
          Eigen::Vector4f w[3];
          for (std::size_t i = 0; i < 3; ++i) w[i] = Eigen::Vector4f(p[i].x(), 1 - p[i].x(), 0, 0);
          builder.SetAttributeValuesForFace(joints, face, kJoints.data(), kJoints.data(), kJoints.data());
          builder.SetAttributeValuesForFace(weights, face, w[0].data(), w[1].data(), w[2].data());
        }
        ++face;
      }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  if (hasMetadata) {
    auto metadata = std::make_unique<draco::GeometryMetadata>();
    metadata->AddEntryString("name", "sheet");
    mesh->AddMetadata(std::move(metadata));
  }
  draco::Encoder encoder;
  encoder.SetEncodingMethod(coding.isSequential ? draco::MESH_SEQUENTIAL_ENCODING
                                                : draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetSpeedOptions(coding.speed, coding.speed);
  if (coding.quantization > 0)
    for (const auto type : {draco::GeometryAttribute::POSITION, draco::GeometryAttribute::TEX_COORD})
      encoder.SetAttributeQuantization(type, coding.quantization);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(*mesh, &buffer).ok())
    throw std::runtime_error("the sheet cannot be compressed");
  return std::string(buffer.data(), buffer.size());
}

// A .glb file. `points` and `indices` are the counts of its accessors.
std::string glbOf(const std::string& compressed, std::size_t points, std::size_t indices, bool hasSkin) {
  std::string json = R"({"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_draco_mesh_compression"],
    "extensionsRequired": ["KHR_draco_mesh_compression"], "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"name": "sheet", "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
      "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0, "TEXCOORD_0": 1}}}}]}],
    "accessors": [{"componentType": 5126, "count": POINTS, "type": "VEC3"},
      {"componentType": 5126, "count": POINTS, "type": "VEC2"}, {"componentType": 5125, "count": INDICES, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": BYTES}], "buffers": [{"byteLength": BYTES}]})";
  const auto replace = [&](const std::string& from, const std::string& to) {
    json.replace(json.find(from), from.size(), to);
  };
  if (hasSkin) {
    replace(R"("nodes": [{"mesh": 0}])",
            R"("nodes": [{"mesh": 0, "skin": 0, "translation": [9, 9, 9]},
      {"translation": [1, 0, 0]}, {"translation": [3, 0, 0]}], "skins": [{"joints": [1, 2]}])");
    replace(R"("TEXCOORD_0": 1}, "indices")",
            R"("TEXCOORD_0": 1, "JOINTS_0": 3, "WEIGHTS_0": 4}, "indices")");
    replace(R"("TEXCOORD_0": 1}}}}])", R"("TEXCOORD_0": 1, "JOINTS_0": 2, "WEIGHTS_0": 3}}}}])");
    replace(R"("type": "SCALAR"}])",
            R"("type": "SCALAR"}, {"componentType": 5121, "count": POINTS, "type": "VEC4"},
      {"componentType": 5126, "count": POINTS, "type": "VEC4"}])");
  }
  for (const auto& [name, number] :
       {std::pair("POINTS", points), std::pair("INDICES", indices), std::pair("BYTES", compressed.size())})
    for (std::size_t at = json.find(name); at != json.npos; at = json.find(name))
      json.replace(at, std::strlen(name), std::to_string(number));
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t padded = (compressed.size() + 3) / 4 * 4;
  std::string bytes = "glTF";
  const auto word = [&](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    bytes.append(reinterpret_cast<const char*>(&number), 4);
  };
  word(2), word(12 + 8 + json.size() + 8 + padded);
  word(json.size()), word(0x4E4F534A), bytes += json;
  word(padded), word(0x004E4942), bytes += compressed;
  bytes.resize(bytes.size() + padded - compressed.size(), '\0');
  return bytes;
}

}  // namespace clothstream::meshes

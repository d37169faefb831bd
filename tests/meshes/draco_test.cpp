// SPDX-License-Identifier: MIT
// glTF files that are compressed with Draco's encoder, whole, cut and hostile.
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "server/meshes/draco_mesh.h"
#include "server/meshes/mesh_file.h"
#include "tests/meshes/draco_sheet.h"

namespace clothstream::meshes {
namespace {

using model::Vec3;
using testing::HasSubstr;

constexpr int kSide = 20;  // quads on each side of a wavy sheet
constexpr int kPoints = (kSide + 1) * (kSide + 1), kFaces = 2 * kSide * kSide;
constexpr DracoRequest kRequest{.positions = 0, .uvs = 1, .maxPoints = kPoints, .maxFaces = kFaces};

std::string compressed(const DracoCoding& coding, bool hasMetadata = false) {
  return compressedSheet(coding, kSide, hasMetadata);
}

auto decoded(const std::string& bytes, const DracoRequest& request = kRequest) {
  return decodeDraco(std::as_bytes(std::span(bytes)), request);
}

tl::expected<MeshSource, std::string> read(const std::string& bytes, std::uint64_t vertices = kPoints) {
  const auto path =
      std::filesystem::temp_directory_path() / ("clothstream_draco_" + std::to_string(::getpid()) + ".glb");
  std::ofstream(path, std::ios::binary) << bytes;
  auto source = readMeshFile(path, {.bytes = 1'000'000, .vertices = vertices});
  std::filesystem::remove(path);
  return source;
}

std::string refusal(const std::string& bytes, std::uint64_t vertices = kPoints) {
  const auto source = read(bytes, vertices);
  return source ? "is accepted" : source.error();
}

TEST(Draco, IsReadWithEveryEncoding) {
  for (const DracoCoding& coding : kDracoCodings) {
    const auto source = read(glbOf(compressed(coding), kPoints, 3 * kFaces));
    ASSERT_TRUE(source) << source.error();
    const float error = coding.quantization > 0 ? 1.5f / static_cast<float>(1 << coding.quantization) : 0;
    EXPECT_EQ(source->vertices.size(), static_cast<std::size_t>(kPoints));
    for (std::size_t i = 0; i < source->vertices.size(); ++i) {
      const Vec3& p = source->vertices[i];
      const Vec3 expected = wave(static_cast<int>(std::lround(p.x() * kSide)),
                                 static_cast<int>(std::lround(p.z() * kSide)), kSide);
      EXPECT_LE((p - expected).cwiseAbs().maxCoeff(), error) << coding.quantization << ' ' << p.transpose();
      EXPECT_LE((source->uvs[i] - model::Uv(expected.x(), 1 - expected.z())).cwiseAbs().maxCoeff(),
                error + 1e-6f);
    }
    const auto built = buildMesh(
        *source, {}, {.maxVertices = kPoints, .maxCoordinate = 10, .minEdge = 1e-4f, .maxNodeSprings = 100});
    ASSERT_TRUE(built) << built.error().text;
    EXPECT_EQ(built->mesh.shape.triangles.size(), static_cast<std::size_t>(kFaces));
    EXPECT_EQ(built->mesh.shape.submeshes[0].name, "sheet");
    const model::Triangle& t = built->mesh.shape.triangles[0];
    const auto at = [&](std::size_t i) { return built->mesh.shape.positions[t[i]]; };
    EXPECT_LT((at(1) - at(0)).cross(at(2) - at(0)).y(),
              0);  // the front of the sheet, which is its lower side
  }
}

TEST(Draco, HasJointsAndWeights) {
  for (const DracoCoding& coding : kDracoCodings) {
    const std::string bytes = compressedSheet(coding, kSide, false, true);
    const auto bound = read(glbOf(bytes, kPoints, 3 * kFaces)),
               placed = read(glbOf(bytes, kPoints, 3 * kFaces, true));
    ASSERT_TRUE(bound) << bound.error();
    ASSERT_TRUE(placed) << placed.error();
    ASSERT_EQ(placed->vertices.size(), bound->vertices.size());
    for (std::size_t i = 0; i < bound->vertices.size(); ++i) {
      const Vec3& p = bound->vertices[i];
      EXPECT_LT((placed->vertices[i] - Vec3(3 - p.x(), p.y(), p.z())).cwiseAbs().maxCoeff(), 0.01f);
    }
  }
}

TEST(Draco, RefusesJointsThatTheCompressedDataDoesNotHave) {
  const std::string bytes = compressed(kDracoCodings[0]);
  EXPECT_THAT(
      refusal(glbOf(bytes, kPoints, 3 * kFaces, true)),
      HasSubstr("(KHR_draco_mesh_compression) does not have 4 numbers for each point in its attribute"));
}

TEST(Draco, RefusesSizesThatTheFileDoesNotState) {
  for (const DracoCoding& coding : kDracoCodings) {
    const std::string bytes = compressed(coding);
    EXPECT_THAT(refusal(glbOf(bytes, kPoints, 3 * kFaces - 3)),
                HasSubstr("states 800 faces; the file has 799"));
    EXPECT_THAT(refusal(glbOf(bytes, kPoints - 1, 3 * kFaces)),
                HasSubstr("states 441 points; the file has 440"));
    EXPECT_THAT(refusal(glbOf(bytes, kPoints, 3 * kFaces), kPoints - 1),
                HasSubstr("has 441 vertices; at most 440 more are allowed: simplify it"));
  }
  EXPECT_THAT(refusal(glbOf(compressed(kDracoCodings[0]) + std::string(8000, '\0'), 2, 3)),
              HasSubstr("bytes; at most"));
}

TEST(Draco, NamesWhatIsMissing) {
  const std::string bytes = compressed(kDracoCodings[0]);
  DracoRequest request = kRequest;
  request.positions = 7;
  EXPECT_EQ(decoded(bytes, request).error(), "has no positions in its attribute 7");
  request.positions = 1;
  EXPECT_EQ(decoded(bytes, request).error(), "has no positions in its attribute 1");
  request = kRequest;
  request.uvs = 0;
  EXPECT_EQ(decoded(bytes, request).error(), "has no texture coordinates in its attribute 0");
  EXPECT_EQ(decoded("DRAC").error(), "does not start with a header of Draco");
  EXPECT_THAT(decoded(compressed(kDracoCodings[0], true)).error(),
              HasSubstr("has metadata, which is not supported"));
  std::string old = bytes;
  old[6] = 1;
  EXPECT_EQ(decoded(old).error(),
            "has version 2.1 of Draco, which is not supported: compress it with version 2.2");
  std::string cloud = bytes;
  cloud[7] = 0;
  EXPECT_EQ(decoded(cloud).error(), "is not a triangle mesh");
}

TEST(Draco, RefusesEveryCut) {
  for (const DracoCoding& coding : kDracoCodings) {
    const std::string bytes = compressed(coding);
    for (std::size_t kept = 0; kept + 1 < bytes.size(); kept += 1 + kept / 40) {
      // An exactly sized copy, so that sanitizers see reads past its end.
      const std::vector<std::byte> cut(
          std::as_bytes(std::span(bytes)).begin(),
          std::as_bytes(std::span(bytes)).begin() + static_cast<std::ptrdiff_t>(kept));
      EXPECT_FALSE(decodeDraco(cut, kRequest)) << kept;
    }
  }
}

// Bytes for sizes of a header: varints of four bytes with a value of 2^28 - 1.
constexpr const char* kHuge = "\xFF\xFF\xFF\x7F";

long peakKilobytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// Buffers that state huge sizes must not cost what they state.
TEST(Draco, CostsLittleWithHugeSizes) {
  const std::string header = std::string("DRACO\x02\x02\x01", 8);
  const std::string none(2, '\0');
  const long before = peakKilobytes();
  const std::clock_t start = std::clock();
  for (const std::string& bytes : {
           header + std::string(1, '\0') + none + kHuge + kHuge + std::string(100, '\0'),  // sequential
           header + '\x01' + none + '\x00' + kHuge + kHuge + std::string(100, '\0'),       // edgebreaker
           header + '\x01' + none + '\x02' + kHuge + kHuge + std::string(100, '\0'),
           header + '\x01' + none + '\x00' + "\x04\x02\xFF\x02" +
               std::string(100, '\0'),  // 255 attribute tables
       })
    EXPECT_FALSE(decoded(bytes));
  // The same within the limits: 2^20 faces of 2^19 vertices from a hundred bytes.
  const DracoRequest large{.positions = 0, .uvs = std::nullopt, .maxPoints = 1 << 20, .maxFaces = 1 << 20};
  const std::string vertices = "\x80\x80\x20", faces = "\x80\x80\x40";
  for (const char traversal : {'\x00', '\x02'})
    EXPECT_FALSE(decoded(
        header + '\x01' + none + traversal + vertices + faces + '\x10' + faces + std::string(100, '\0'),
        large));
  EXPECT_LT(peakKilobytes() - before, 512 * 1024);
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 2.0);
}

// One of the numbers is that of the orientations of texture coordinates, of which Draco itself would read
// 2^31.
TEST(Draco, RefusesMoreOrientationsThanCorners) {
  for (const DracoCoding& coding : kDracoCodings) {
    const std::string bytes = compressed(coding);
    for (std::size_t at = 8; at + 4 <= bytes.size(); ++at) {
      std::string changed = bytes;
      changed.replace(at, 4, "\xFF\xFF\xFF\x7F");
      const std::clock_t start = std::clock();
      static_cast<void>(decoded(changed));
      ASSERT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 1.0) << at;
    }
  }
}

// Changed bytes either decode or do not; sizes stay within what was requested.
TEST(Draco, SurvivesChangedBytes) {
  for (const DracoCoding& coding : kDracoCodings) {
    const std::string bytes = compressed(coding);
    for (std::size_t at = 0; at < bytes.size(); at += 1 + at / 60)
      for (const int bits : {1, 0x80, 0xFF}) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(changed[at] ^ bits);
        const auto mesh = decoded(changed);
        if (!mesh) continue;
        EXPECT_LE(mesh->positions.size(), static_cast<std::size_t>(kPoints));
        EXPECT_LE(mesh->indices.size(), static_cast<std::size_t>(3 * kFaces));
        for (const std::uint32_t index : mesh->indices) ASSERT_LT(index, mesh->positions.size());
      }
  }
}

}  // namespace
}  // namespace clothstream::meshes

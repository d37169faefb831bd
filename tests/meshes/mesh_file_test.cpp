// SPDX-License-Identifier: MIT
// Valid and invalid OBJ and glTF files.
#include "server/meshes/mesh_file.h"

#include <cstring>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

namespace clothstream::meshes {
namespace {

using model::Vec3;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr FileLimits kFileLimits{.bytes = 1'000'000, .vertices = 1000};

class MeshFile : public testing::Test {
 protected:
  MeshFile() {
    folder_ =
        std::filesystem::temp_directory_path() /
        (std::string("clothstream_mesh_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  ~MeshFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, std::string_view bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  std::filesystem::path folder_;
};

TEST_F(MeshFile, ReadsVerticesFacesCoordinatesAndPartsOfObj) {
  const auto source = readMeshFile(write("cloth.obj", R"(# a comment
o sheet
v 0 0 0
v 1 0 0
v 1 1 0.5
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
usemtl cotton
f 1/1/1 2/2/1 3/3/1 4/4/1
v 2 0 0
usemtl silk
f 2/1 -1/2 3/3
)"),
                                   kFileLimits);
  ASSERT_TRUE(source) << source.error();
  ASSERT_EQ(source->vertices.size(), 5u);
  EXPECT_EQ(source->vertices[2], Vec3(1, 1, 0.5f));
  ASSERT_EQ(source->faces.size(), 2u);
  EXPECT_EQ(source->faces[0].cornerCount, 4u);
  EXPECT_THAT(source->faces[0].vertices, testing::ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(source->faces[1].cornerCount, 3u);
  EXPECT_EQ(source->faces[1].vertices[1], 4u);  // -1 is the newest
  EXPECT_EQ(source->faces[1].uvs[1], 1u);
  EXPECT_EQ(source->uvs[2], model::Uv(1, 1));
  ASSERT_EQ(source->parts.size(), 2u);
  EXPECT_EQ(source->parts[0].name, "cotton");
  EXPECT_EQ(source->parts[1].name, "silk");
  EXPECT_EQ(source->parts[1].firstFace, 1u);
}

TEST_F(MeshFile, IgnoresIncompleteTextureCoordinatesOfObj) {
  const auto source = parseObj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3\n");
  ASSERT_TRUE(source) << source.error();
  EXPECT_TRUE(source->uvs.empty());
}

TEST_F(MeshFile, RefusesInvalidObjHereOrInBuildMesh) {
  for (const auto& [text, says] :
       {std::pair("v 0 0 0\nv 1 nan 0\n", "line 2 is \"v 1 nan 0\""), std::pair("v 0 0 inf\n", "line 1"),
        std::pair("  v nan 0 0\n", "line 1"), std::pair("v\t0 nan 0\n", "line 1"),
        std::pair("v 0 0 0\nv 1e2147483648 0 0\n", "line 2 is \"v 1e2147483648 0 0\": an exponent"),
        std::pair("v 0 0 0\n vt 0 1e-999999999\n", "line 2"),
        std::pair("vn 1E+2147483648 0 0\n", "line 1")}) {
    const auto source = parseObj(text);
    ASSERT_FALSE(source) << text;
    EXPECT_THAT(source.error(), HasSubstr(says));
  }
  constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (const auto& [face, says] :
       {std::pair("f 1 2 4\n", "face 0 names vertex"),
        std::pair("f 1 2\n",
                  "face 0 has 2 corners; faces must have 3 or 4: triangulate it when you export, or set"),
        std::pair("f 1 2 3\nf 1 1 1 1 1\n", "face 1 has 5 corners; faces must have 3 or 4"),
        std::pair("f 1 2 3 2 9\n", "face 0 names vertex 8; there are 3")}) {
    const auto source = parseObj(std::string(kTriangle) + face);
    ASSERT_TRUE(source) << face;
    const auto built = buildMesh(*source, {}, {.maxVertices = 10, .maxCoordinate = 10, .minEdge = 0.001f});
    ASSERT_FALSE(built) << face;
    EXPECT_THAT(built.error().text, HasSubstr(says)) << face;
  }
}

TEST_F(MeshFile, NamesTheLineOfAnObjThatIsReadAsSomethingElse) {
  constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (const auto& [line, says] : {
           std::pair("f 0 1 2", "line 4 is \"f 0 1 2\": a corner of a face must be V, V/VT"),
           std::pair("f a b c", "line 4 is \"f a b c\": a corner"),
           std::pair("f 1 2 3x", "line 4 is \"f 1 2 3x\": a corner"),
           std::pair("f 1/1/1/1 2 3", "line 4"),
           std::pair("f 99999999999 2 3", "line 4"),
           std::pair("f 1 2 -9", "face 0 names vertex -9, but only 3 come before it"),
           std::pair("vt 0 x", "line 4 is \"vt 0 x\": texture coordinates must be finite numbers"),
           std::pair("usemtl \x83V\x83\x83", "line 4 is \"usemtl \\x83V\\x83\\x83\": a name must be UTF-8"),
           std::pair("o \xc4rmel", "line 4 is \"o \\xc4rmel\": a name must be UTF-8"),
           std::pair("g \xff", "save the file as UTF-8, or rename it"),
       }) {
    const auto source = parseObj(std::string(kTriangle) + line + "\nf 1 2 3\n");
    ASSERT_FALSE(source) << line;
    EXPECT_THAT(source.error(), HasSubstr(says)) << line;
  }
  const std::string zero("v 0 0 0\nv 1 \0 0\n", 16);
  EXPECT_THAT(parseObj(zero).error(), HasSubstr("line 2"));
}

TEST_F(MeshFile, ReadsObjWithAnyEndOfLinesAndEncoding) {
  const std::string lines =
      "# R\xe4nder\\\nv 0 0 0\nv 1 \\\n 0 0\nv 0 1 0\nusemtl L\xc3\xb6we \nf 1 \\\n2 \\\n3\n";
  for (const std::string end : {"\n", "\r\n", "\r"})
    for (const std::string mark : {"", "\xef\xbb\xbf"}) {
      std::string text = mark;
      for (const char c : lines) text += c == '\n' ? end : std::string(1, c);
      const auto source = parseObj(text);
      ASSERT_TRUE(source) << source.error();
      ASSERT_EQ(source->vertices.size(), 3u);
      EXPECT_EQ(source->vertices[1], Vec3(1, 0, 0));
      ASSERT_EQ(source->faces.size(), 1u);
      EXPECT_THAT(source->faces[0].vertices, testing::ElementsAre(0, 1, 2, 0));
      EXPECT_EQ(source->parts[0].name, "L\xc3\xb6we");
      const auto broken = parseObj(text + "v 0 0" + end + "v 0 nan" + end);
      EXPECT_THAT(broken.error(), HasSubstr("line 11 is \"v 0 nan\""));
    }
  for (const std::string mark : {"\xff\xfe", "\xfe\xff"}) {
    std::string wide = mark;
    for (const char c : lines) (wide += c) += '\0';
    EXPECT_THAT(parseObj(wide).error(), HasSubstr("is text in UTF-16 or UTF-32"));
    EXPECT_THAT(parseObj(wide.substr(2)).error(), HasSubstr("save it as UTF-8"));
  }
}

TEST_F(MeshFile, KeepsPolygonsOfObj) {
  const auto source =
      parseObj("v 0 0 0\nvt 0 0\nvt 1 0\nf 1/1 2/2 3/1 4/2 5/1\nf 1/1 2/2 3/1\nf 6/1 5/2 4/1 3/2 2/1 1/2\n");
  ASSERT_TRUE(source) << source.error();
  ASSERT_EQ(source->faces.size(), 3u);
  EXPECT_EQ(source->faces[0].cornerCount, 5u);
  EXPECT_EQ(source->corners.size(), 11u);
  EXPECT_EQ(source->cornerOf(source->faces[0], 4).vertex, 4u);
  EXPECT_EQ(source->cornerOf(source->faces[1], 1).uv, 1u);
  EXPECT_EQ(source->cornerOf(source->faces[2], 0).vertex, 5u);
  EXPECT_EQ(source->cornerOf(source->faces[2], 5).uv, 1u);
}

// Quad as two triangles. The buffer holds floats, then 16-bit indices. Nodes translate and mirror the quad.
constexpr const char* kGltf = R"({
  "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
  "nodes": [{"translation": [1, 2, 3], "children": [1]}, {"scale": [-2, 1, 1], "mesh": 0}],
  "materials": [{"name": "linen"}],
  "meshes": [{"name": "sheet", "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
  "buffers": [{"uri": "sheet.bin", "byteLength": 92}],
  "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 80, "byteStride": 20}, {"buffer": 0, "byteOffset": 80, "byteLength": 12}],
  "accessors": [
    {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
    {"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 4, "type": "VEC2"},
    {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}]
})";

std::string sheetBuffer() {
  std::string bytes;
  const auto append = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (const auto& [x, y] :
       {std::pair(0.0f, 0.0f), std::pair(1.0f, 0.0f), std::pair(1.0f, 1.0f), std::pair(0.0f, 1.0f)})
    for (const float value : {x, y, 0.0f, x, y}) append(value);
  for (const int index : {0, 1, 2, 0, 2, 3}) append(static_cast<std::uint16_t>(index));
  return bytes;
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  return text.replace(at, from.size(), to);
}

void expectSheet(const tl::expected<MeshSource, std::string>& source) {
  ASSERT_TRUE(source) << source.error();
  ASSERT_EQ(source->vertices.size(), 4u);
  EXPECT_EQ(source->vertices[2], Vec3(-1, 3, 3));  // (1, 1, 0) mirrored, doubled, moved
  ASSERT_EQ(source->faces.size(), 2u);
  EXPECT_THAT(source->faces[0].vertices,
              testing::ElementsAre(2, 1, 0, 0));  // reversed, because the mirror reverses the orientation
  EXPECT_EQ(source->uvs[2], model::Uv(1, 0));     // glTF's v runs down
  ASSERT_EQ(source->parts.size(), 1u);
  EXPECT_EQ(source->parts[0].name, "linen");
}

TEST_F(MeshFile, ReadsTransformedTrianglesOfTheGltfScene) {
  write("sheet.bin", sheetBuffer());
  expectSheet(readMeshFile(write("sheet.gltf", kGltf), kFileLimits));
}

TEST_F(MeshFile, ReadsGlb) {
  std::string json = replaced(kGltf, "\"uri\": \"sheet.bin\", ", "");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string buffer = sheetBuffer();
  std::string bytes;
  const auto word = [&](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    bytes.append(reinterpret_cast<const char*>(&number), 4);
  };
  word(0x46546C67), word(2), word(12 + 8 + json.size() + 8 + buffer.size());
  word(json.size()), word(0x4E4F534A), bytes += json;
  word(buffer.size()), word(0x004E4942), bytes += buffer;
  expectSheet(readMeshFile(write("sheet.glb", bytes), kFileLimits));
  for (const std::size_t kept : {0ul, 11ul, 40ul, bytes.size() - 50}) {
    const auto cut = readMeshFile(write("cut.glb", bytes.substr(0, kept)), kFileLimits);
    EXPECT_FALSE(cut) << kept;
  }
}

TEST_F(MeshFile, RefusesInvalidGltf) {
  write("sheet.bin", sheetBuffer());
  for (const auto& [from, to, says] : {
           std::tuple("\"version\": \"2.0\"", "\"version\": ", "is not glTF 2.0"),
           std::tuple("\"linen\"", "\"\x83V\"", ": save it as UTF-8"),
           std::tuple("\"sheet.bin\"", "\"missing.bin\"", "missing.bin"),
           std::tuple("\"indices\": 2", "\"indices\": 9", "accessor out of bounds"),
           std::tuple("\"count\": 6", "\"count\": 7", "accessor 2 has 7 elements"),
           std::tuple("\"count\": 4, \"type\": \"VEC3\"", "\"count\": 4000000000, \"type\": \"VEC3\"",
                      "accessor 0 has 4000000000 elements"),
           std::tuple("\"byteOffset\": 80,", "\"byteOffset\": 90,", "accessor 2"),
           std::tuple("\"children\": [1]", "\"children\": [0, 1]", "node 0 has two parents"),
           std::tuple("\"children\": [1]", "\"children\": [7]", "node 7 does not exist"),
           std::tuple("\"indices\": 2,", "\"indices\": 2, \"mode\": 0,", "is made of points"),
           std::tuple("\"indices\": 2,", "\"indices\": 2, \"mode\": 3,",
                      "mesh \"sheet\", primitive 0: is made of lines, which have no surface"),
           std::tuple("\"indices\": 2,", "\"indices\": 2, \"mode\": 9,", "has the mode 9"),

           std::tuple("\"count\": 6", "\"count\": 5", "not a multiple of three"),
           std::tuple("\"POSITION\": 0", "\"NORMAL\": 0", "has no POSITION"),
           std::tuple("\"asset\"", "\"extensionsRequired\": [\"VENDOR_own\"], \"asset\"",
                      "needs the extension VENDOR_own, which is not supported: export it without"),
           std::tuple("\"count\": 4, \"type\": \"VEC3\"", "\"count\": 3, \"type\": \"VEC3\"",
                      "has 4 texture coordinates for 3 vertices"),
       }) {
    const auto source = readMeshFile(write("bad.gltf", replaced(kGltf, from, to)), kFileLimits);
    ASSERT_FALSE(source) << to;
    EXPECT_THAT(source.error(), AllOf(StartsWith(folder_.string()), HasSubstr(says))) << to;
  }
}

TEST_F(MeshFile, GltfReadsOnlyFilesOfItsFolderWithinTheLimit) {
  const std::filesystem::path inside = folder_ / "inside";
  std::filesystem::create_directories(inside / "parts");
  write("sheet.bin", sheetBuffer());
  write("inside/parts/sheet.bin", sheetBuffer());
  const auto read = [&](const std::string& uri, const FileLimits& limits = kFileLimits) {
    return readMeshFile(write("inside/a.gltf", replaced(kGltf, "sheet.bin", uri)), limits);
  };
  EXPECT_TRUE(read("parts/sheet.bin"));
  EXPECT_TRUE(read("parts/../parts/sheet.bin"));
  for (const std::string& uri : {std::string("../sheet.bin"), (folder_ / "sheet.bin").string(),
                                 std::string("parts"), std::string("/dev/zero")})
    EXPECT_THAT(read(uri).error(), HasSubstr("buffer 0 is the file \"" + uri +
                                             "\", which is not a file in the folder of this one or below"));
  const std::size_t json = replaced(kGltf, "sheet.bin", "parts/sheet.bin").size();
  EXPECT_THAT(read("parts/sheet.bin", {.bytes = json + 40, .vertices = 100}).error(),
              HasSubstr("is too large: at most 40 bytes are allowed"));
}

TEST_F(MeshFile, GltfReadsFilesWithAnyName) {
  for (const std::string name : {"a 10%.bin", "a%20b.bin", "a+b.bin", "a b.bin", "\xc3\xa4.bin"})
    write(name, sheetBuffer());
  for (const std::string uri :
       {"a 10%.bin", "a%2010%25.bin", "a%20b.bin", "a%2520b.bin", "a+b.bin", "a%2Bb.bin", "a b.bin",
        "\xc3\xa4.bin", "%C3%A4.bin", "%c3%a4.bin", "\\u00e4.bin"})
    expectSheet(readMeshFile(write("a.gltf", replaced(kGltf, "sheet.bin", uri)), kFileLimits));
  std::filesystem::remove(folder_ / "a b.bin");
  expectSheet(readMeshFile(write("a.gltf", replaced(kGltf, "sheet.bin", "a%20b.bin")), kFileLimits));
  for (const std::string uri : {"10%.bin", "%41%.bin", "%2e%2e/a%2Bb.bin"})
    EXPECT_THAT(readMeshFile(write("a.gltf", replaced(kGltf, "sheet.bin", uri)), kFileLimits).error(),
                HasSubstr("which is not a file in the folder of this one or below"))
        << uri;
  EXPECT_THAT(readMeshFile(write("a.gltf", replaced(kGltf, "sheet.bin", "%41 10%.bin")), kFileLimits).error(),
              HasSubstr("buffer 0 is the file \"A 10%.bin\""));
}

TEST_F(MeshFile, ReadsStripsAndFansOfGltf) {
  for (const auto& [mode, indices, faces] :
       {std::tuple(5, std::vector{0, 1, 2, 3, 3, 3}, std::vector{0, 1, 2, 1, 3, 2}),
        std::tuple(6, std::vector{0, 1, 2, 3, 3, 0}, std::vector{1, 2, 0, 2, 3, 0}),
        std::tuple(5, std::vector{3, 3, 3, 0, 1, 2}, std::vector{3, 0, 1, 0, 2, 1})}) {
    std::string bytes = sheetBuffer().substr(0, 80);
    for (const int index : indices) {
      bytes += static_cast<char>(index);
      bytes += '\0';
    }
    write("sheet.bin", bytes);
    std::string json =
        replaced(kGltf, "\"indices\": 2,", "\"indices\": 2, \"mode\": " + std::to_string(mode) + ",");
    json = replaced(json, "\"scale\": [-2, 1, 1], ", "");
    const auto source = readMeshFile(write("sheet.gltf", json), kFileLimits);
    ASSERT_TRUE(source) << source.error();
    std::vector<int> found;
    for (const SourceFace& face : source->faces)
      for (int corner = 0; corner < 3; ++corner)
        found.push_back(static_cast<int>(face.vertices[static_cast<std::size_t>(corner)]));
    EXPECT_EQ(found, faces) << mode;
  }
  write("sheet.bin", sheetBuffer());
  const std::string two = replaced(replaced(kGltf, "\"indices\": 2,", "\"indices\": 2, \"mode\": 5,"),
                                   "\"count\": 6", "\"count\": 2");
  EXPECT_THAT(readMeshFile(write("two.gltf", two), kFileLimits).error(),
              HasSubstr("has 2 indices; a triangle has three"));
}

TEST_F(MeshFile, AppliesMorphTargetsOfGltfWithTheirDefaultWeights) {
  write("sheet.bin", sheetBuffer());
  // The target adds to each vertex its own place.
  std::string json = replaced(kGltf, "\"indices\": 2,", "\"targets\": [{\"POSITION\": 0}], \"indices\": 2,");
  json = replaced(json, "\"scale\": [-2, 1, 1], ", "");
  const auto secondVertex = [&](const std::string& text) {
    const auto source = readMeshFile(write("sheet.gltf", text), kFileLimits);
    EXPECT_TRUE(source) << source.error();
    return source ? source->vertices[2] : Vec3::Zero();
  };
  EXPECT_EQ(secondVertex(json), Vec3(2, 3, 3)) << "the weight is 0 by default";
  json = replaced(json, "\"name\": \"sheet\"", "\"name\": \"sheet\", \"weights\": [0.5]");
  EXPECT_EQ(secondVertex(json), Vec3(2.5f, 3.5f, 3));
  EXPECT_EQ(secondVertex(replaced(json, "\"mesh\": 0", "\"mesh\": 0, \"weights\": [2]")), Vec3(4, 5, 3))
      << "weights of the node replace those of the mesh";
  const std::string other = replaced(json, "[{\"POSITION\": 0}]", "[{\"POSITION\": 1}]");
  EXPECT_THAT(readMeshFile(write("sheet.gltf", other), kFileLimits).error(),
              HasSubstr("mesh \"sheet\", primitive 0: morph target 0: accessor 1 has the wrong number"));
}

TEST_F(MeshFile, IgnoresExtensionsAndImagesThatLeaveTheGeometry) {
  write("sheet.bin", sheetBuffer());
  for (const std::string name : {"EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu",
                                 "MSFT_texture_dds", "KHR_texture_transform", "KHR_xmp_json_ld",
                                 "KHR_materials_unlit", "VRMC_materials_mtoon", "KHR_lights_punctual"})
    expectSheet(readMeshFile(
        write("sheet.gltf",
              replaced(kGltf, "\"asset\"", "\"extensionsRequired\": [\"" + name + "\"], \"asset\"")),
        kFileLimits));
  for (const std::string image :
       {"data:image/webp;base64,UklGRg==", "data:image/avif;base64,AAAA", "none.webp"})
    expectSheet(readMeshFile(
        write("sheet.gltf",
              replaced(kGltf, "\"asset\"",
                       R"("images": [{"uri": ")" + image + R"("}], "textures": [{"source": 0}], "asset")")),
        kFileLimits));
  for (const std::string name : {"EXT_mesh_gpu_instancing", "KHR_gaussian_splatting", "VENDOR", "_", ""}) {
    const auto source = readMeshFile(
        write("bad.gltf",
              replaced(kGltf, "\"asset\"", "\"extensionsRequired\": [\"" + name + "\"], \"asset\"")),
        kFileLimits);
    ASSERT_FALSE(source) << name;
    EXPECT_THAT(source.error(), HasSubstr("needs the extension " + name + ", which is not supported"));
  }
}

TEST_F(MeshFile, NamesFormatsThatAreNotSupported) {
  write("sheet.bin", sheetBuffer());
  const std::string view = "{\"buffer\": 0, \"byteOffset\": 80, \"byteLength\": 12";
  const auto meshopt =
      "is compressed with EXT_meshopt_compression, which is not supported: export it without";
  for (const auto& [json, says] : {
           std::pair(replaced(kGltf, "\"2.0\"", "\"1.0\""),
                     "is glTF 1.0, which is not supported: convert it"),
           std::pair(
               std::string(R"({"asset": {}, "meshes": {"sheet": {"primitives": []}}, "accessors": {}})"),
               "is glTF 1.0, which is not supported"),
           std::pair(replaced(kGltf, "\"asset\"",
                              "\"extensionsRequired\": [\"EXT_meshopt_compression\"], \"asset\""),
                     meshopt),
           // The buffer that is decoded to has no bytes.
           std::pair(replaced(replaced(kGltf, "\"asset\"",
                                       "\"extensionsUsed\": [\"EXT_meshopt_compression\"], \"asset\""),
                              "\"uri\": \"sheet.bin\", ", ""),
                     meshopt),
           std::pair(replaced(kGltf, view,
                              view + ", \"extensions\": {\"EXT_meshopt_compression\": {\"buffer\": 0}}"),
                     meshopt),
       }) {
    const auto source = readMeshFile(write("other.gltf", json), kFileLimits);
    ASSERT_FALSE(source) << json;
    EXPECT_THAT(source.error(), HasSubstr(says)) << json;
  }
  std::string old = "glTF";
  for (const std::uint32_t word : {1u, 24u, 4u, 0u}) old.append(reinterpret_cast<const char*>(&word), 4);
  EXPECT_THAT(readMeshFile(write("old.glb", old + "{}  "), kFileLimits).error(), HasSubstr("is glTF 1.0"));
}

// Positions as normalised 16-bit integers, and texture coordinates as bytes.
TEST_F(MeshFile, ReadsQuantizedGltf) {
  std::string bytes;
  const auto append = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
    for (const int value : {x, y, 0}) append(static_cast<std::int16_t>(-32767 * value));
    for (const int value : {x, y}) append(static_cast<std::uint8_t>(255 * value));
  }
  for (const int index : {0, 1, 2, 0, 2, 3}) append(static_cast<std::uint16_t>(index));
  write("small.bin", bytes);
  const auto source = readMeshFile(write("small.gltf", R"({
    "asset": {"version": "2.0"}, "extensionsRequired": ["KHR_mesh_quantization"],
    "scenes": [{"nodes": [0]}], "nodes": [{"scale": [4, 4, 4], "mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}],
    "buffers": [{"uri": "small.bin", "byteLength": 44}],
    "bufferViews": [{"buffer": 0, "byteLength": 32, "byteStride": 8}, {"buffer": 0, "byteOffset": 32, "byteLength": 12}],
    "accessors": [
      {"bufferView": 0, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC3"},
      {"bufferView": 0, "byteOffset": 6, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC2"},
      {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}]})"),
                                   kFileLimits);
  ASSERT_TRUE(source) << source.error();
  EXPECT_EQ(source->vertices[2], Vec3(-4, -4, 0));
  EXPECT_EQ(source->uvs[2], model::Uv(1, 0));
}

// A node for each of many instances of one mesh.
TEST_F(MeshFile, RefusesMoreVerticesThanAllowedBeforeTheyAreRead) {
  write("sheet.bin", sheetBuffer());
  std::string nodes, list;
  for (int i = 0; i < 251; ++i) {
    nodes += R"({"mesh": 0},)";
    list += std::to_string(i) + ",";
  }
  nodes.pop_back(), list.pop_back();
  std::string json = replaced(kGltf, "\"nodes\": [0]", "\"nodes\": [" + list + "]");
  json = replaced(json, R"({"translation": [1, 2, 3], "children": [1]}, {"scale": [-2, 1, 1], "mesh": 0})",
                  nodes);
  const auto source = readMeshFile(write("many.gltf", json), kFileLimits);
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error(), HasSubstr("has 4 vertices; at most 0 more are allowed: simplify it"));
}

TEST_F(MeshFile, NamesFilesThatAreNotMeshes) {
  const auto expectRefused = [&](const std::filesystem::path& path, const char* says) {
    const auto source = readMeshFile(path, {.bytes = 100, .vertices = 1000});
    ASSERT_FALSE(source) << path;
    EXPECT_THAT(source.error(), AllOf(StartsWith(path.string()), HasSubstr(says)));
  };
  expectRefused(folder_ / "none.obj", "cannot be read: No such file");
  expectRefused(folder_, "is not a regular file");
  const std::filesystem::path pipe = folder_ / "pipe.obj";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  expectRefused(pipe, "is not a regular file");
  expectRefused(write("cloth.fbx", "x"), ".obj, .gltf or .glb");
  expectRefused(write("large.obj", std::string(101, ' ')), "is too large: at most 100 bytes");
}

}  // namespace
}  // namespace clothstream::meshes

// SPDX-License-Identifier: MIT
// Exported files have the texture coordinates and parts of the stream. The server's readers read them back.
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/cli/gltf_animation.h"
#include "clients/cli/obj_file.h"
#include "clients/recording/played_recording.h"
#include "server/meshes/mesh_file.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace clothstream::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint32_t kVertices = 5;

template <typename Number>
std::string bytesOf(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

// A recording of two cloths of five vertices. The first has three triangles around vertex 0 in two parts, and
// that vertex has other texture coordinates in the last triangle. The second has neither.
std::string meshRecording(const std::vector<std::string>& names) {
  const codec::ClothLayout cloth{.vertexCount = kVertices,
                                 .triangles = {0, 1, 2, 0, 2, 3, 0, 3, 4},
                                 .restPositions = std::vector<float>(3 * kVertices, 0.5f)};
  codec::StreamLayout layout = recording::sampleLayout();
  layout.cloths = {cloth, cloth};
  std::string plain;
  recording::writeSampleWithSliders(
      [&](std::string_view more) {
        plain += more;
        return recording::Written();
      },
      3, layout);
  const auto describe = [&](std::size_t, std::string& bytes) {
    v1::StreamDescription description;
    ASSERT_TRUE(description.ParseFromString(bytes));
    description.clear_cloths();
    description.clear_definition();
    for (const char* name : {"shirt", "plain"}) {
      v1::ClothDescription& described = *description.add_cloths();
      described.set_name(name);
      described.set_vertex_count(kVertices);
      described.set_rest_positions(bytesOf(cloth.restPositions));
      described.set_triangles(bytesOf(cloth.triangles));
    }
    v1::ClothDescription& shirt = *description.mutable_cloths(0);
    shirt.set_uvs(bytesOf<float>({0, 0, 0.25f, 0, 0.5f, 0, 0.75f, 0.5f, 1, 0.5f, 1, 1}));
    shirt.set_uv_triangles(bytesOf<std::uint32_t>({0, 1, 2, 0, 2, 3, 5, 3, 4}));
    for (std::size_t i = 0; i < names.size(); ++i) {
      shirt.add_submeshes()->set_name(names[i]);
      shirt.mutable_submeshes(static_cast<int>(i))
          ->set_triangle_count(names.size() == 1 ? 3
                               : i == 0          ? 1
                                                 : 2);
    }
    bytes = description.SerializeAsString();
  };
  return recording::withMessages(plain, recording::Topic::description, describe);
}

class Export : public testing::Test {
 protected:
  // Writes a file of all frames, and returns its path.
  std::string glb(const std::string& recording) {
    auto played = client::PlayedRecording::open(recording::readerOf(recording));
    EXPECT_TRUE(played) << played.error();
    GltfAnimation animation;
    for (auto more = played->next(); more && *more; more = played->next())
      animation.add(played->client(), played->seconds());
    EXPECT_EQ(animation.frames(), 3u);
    const std::string path = directory_.path() / "out.glb";
    std::ofstream(path, std::ios::binary) << animation.finish(true);
    return path;
  }

  // Writes a file of the first frame, and returns its path.
  std::string obj(const std::string& recording) {
    auto played = client::PlayedRecording::open(recording::readerOf(recording));
    EXPECT_TRUE(played) << played.error();
    const auto more = played->next();
    EXPECT_TRUE(more && *more) << (more ? "no frame" : more.error());
    const std::string path = directory_.path() / "out.obj";
    auto file = files::NewFile::create(path);
    EXPECT_TRUE(file && writeObj(played->client(), *file));
    return path;
  }

  static meshes::MeshSource read(const std::string& path) {
    auto source = meshes::readMeshFile(path, {.bytes = 1'000'000, .vertices = 1000});
    EXPECT_TRUE(source) << source.error();
    return source ? std::move(*source) : meshes::MeshSource();
  }

  static std::vector<std::string> partsOf(const meshes::MeshSource& source) {
    std::vector<std::string> names;
    for (const auto& part : source.parts) names.push_back(part.name);
    return names;
  }

  static model::Uv uvOf(const meshes::MeshSource& source, std::size_t face, std::uint32_t corner) {
    return source.uvs[source.cornerOf(source.faces[face], corner).uv];
  }

  e2e::TemporaryDirectory directory_;
};

TEST_F(Export, ObjHasTextureCoordinatesAndParts) {
  const std::string path = obj(meshRecording({"silk", "cotton"}));
  std::string text(std::istreambuf_iterator<char>(std::ifstream(path).rdbuf()), {});
  EXPECT_THAT(text,
              HasSubstr("g shirt\nusemtl silk\nf 1/1/1 2/2/2 3/3/3\nusemtl cotton\nf 1/1/1 3/3/3 4/4/4\n"
                        "f 1/6/1 4/4/4 5/5/5\ng plain\nusemtl plain\nf 6//6 7//7 8//8\n"));
  EXPECT_THAT(text, HasSubstr("vt 0.75 0.5\n"));
  EXPECT_THAT(partsOf(read(path)), ElementsAre("silk", "cotton", "plain"));
}

TEST_F(Export, GltfHasTextureCoordinatesAndParts) {
  const meshes::MeshSource source = read(glb(meshRecording({"silk", "cotton"})));
  EXPECT_THAT(partsOf(source), ElementsAre("silk", "cotton", "plain"));
  ASSERT_EQ(source.faces.size(), 6u);
  EXPECT_EQ(source.parts[1].firstFace, 1u);
  const auto shirt = read(glb(meshRecording({""})));
  EXPECT_THAT(partsOf(shirt), ElementsAre("", "")) << "nothing has a part";
}

// The reader drops texture coordinates unless all parts have them, so this test reads the numbers itself.
TEST_F(Export, GltfDividesVerticesWithSeveralTextureCoordinates) {
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromFile(&model, &error, &warning,
                                                      glb(meshRecording({"silk", "cotton"}))))
      << error;
  ASSERT_EQ(model.meshes.size(), 1u);
  const auto& primitives = model.meshes[0].primitives;
  ASSERT_EQ(primitives.size(), 3u);
  EXPECT_FALSE(primitives[2].attributes.contains("TEXCOORD_0"));
  const auto numbers = [&]<typename Number>(int accessor, Number) {
    const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(
        model.accessors[static_cast<std::size_t>(accessor)].bufferView)];
    std::vector<Number> values(view.byteLength / sizeof(Number));
    std::memcpy(values.data(), model.buffers[0].data.data() + view.byteOffset, view.byteLength);
    return values;
  };
  EXPECT_THAT(numbers(primitives[1].indices, std::uint32_t()), ElementsAre(0, 2, 3, 10, 3, 4));
  const auto uvs = numbers(primitives[1].attributes.at("TEXCOORD_0"), float());
  ASSERT_EQ(uvs.size(), 22u);
  EXPECT_EQ(uvs[1], 1) << "v runs downwards in glTF";
  EXPECT_EQ(uvs[20], 1);
  EXPECT_EQ(uvs[21], 0);
  const auto positions = numbers(primitives[1].attributes.at("POSITION"), float());
  ASSERT_EQ(positions.size(), 33u);
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(positions[30 + axis], positions[axis]);
  ASSERT_EQ(primitives[1].targets.size(), 2u);
  EXPECT_EQ(numbers(primitives[1].targets[1].at("POSITION"), float()).size(), 33u);
}

TEST_F(Export, FilesOfStreamsWithoutPartsHaveNoMaterials) {
  const std::string path = obj(recording::sampleRecording(3));
  const std::string text(std::istreambuf_iterator<char>(std::ifstream(path).rdbuf()), {});
  EXPECT_THAT(text, HasSubstr("g sheet\nf "));
  EXPECT_THAT(text, Not(HasSubstr("usemtl")));
  EXPECT_THAT(text, Not(HasSubstr("vt ")));
}

}  // namespace
}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
// Scene files: every field survives, and errors name the file.
#include "server/messages/scene_file.h"

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "server/messages/limits.h"
#include "server/messages/scene_message.h"

namespace clothstream::messages {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kEveryField = R"json({
  "name": "every_field", "description": "All of it", "simulationRate": 240, "streamRate": 120, "substeps": 40,
  "integrator": "INTEGRATOR_SEMI_IMPLICIT_EULER",
  "environment": {"gravity": {"x": 0.5, "y": -9.5, "z": 0.25}, "wind": {"x": 1, "y": 2, "z": 3}, "airDensity": 1.25,
                  "gust": {"strength": 0.5, "seconds": 4},
                  "winds": [{"name": "fan", "pose": {"position": {"x": 1, "y": 2, "z": 3},
                                                     "orientation": {"x": 0.5, "y": 0.5, "z": -0.5, "w": 0.5}},
                             "speed": 0.5, "fan": {"radius": 0.25, "spread": 0.5, "range": 2}},
                            {"name": "vortex", "pose": {"position": {"x": 1, "y": 2, "z": 3},
                                                        "orientation": {"x": 0.5, "y": 0.5, "z": -0.5, "w": 0.5}},
                             "speed": 0.25, "vortex": {"radius": 0.25, "reach": 2}}]},
  "cloths": [{
    "name": "sheet",
    "grid": {"rows": 6, "columns": 7, "width": 1.5, "height": 1.25,
             "pose": {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0.5, "y": 0.5, "z": 0.5, "w": 0.5}}},
    "mass": 4, "material": "wool",
    "structural": {"stiffness": 20, "damping": 0.5}, "shear": {"stiffness": 10, "damping": 0.25},
    "bend": {"stiffness": 5, "damping": 0.125}, "dihedralBending": 0, "pressure": 0,
    "damping": 3, "drag": 0.5, "lift": 0.25, "friction": 0.75, "thickness": 0.0625,
    "pins": [{"firstRow": 1, "lastRow": 5, "rowStep": 2, "firstColumn": 1, "lastColumn": 4, "columnStep": 3}],
    "pinnedVertices": [3, 41],
    "pinnedRegions": [{"centre": {"x": 1, "y": 2, "z": 3}, "size": {"x": 0.5, "y": 0.25, "z": 1}},
                      {"centre": {"x": 1, "y": 0, "z": 0}, "radius": 2}],
    "solver": {"massSpring": {}}, "selfCollision": {"radius": 0.125, "friction": 0.5, "nothingPasses": true}
  }, {
    "name": "mesh", "mesh": {"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0], "triangles": [0, 1, 2, 1, 3, 2],
      "quads": [0], "uvs": [0, 0, 1, 0, 0, 1, 1, 1], "uvTriangles": [0, 1, 2, 1, 3, 2],
      "submeshes": [{"name": "all", "triangleCount": 2}], "weldDistance": 0},
    "mass": 1, "structural": {}, "shear": {}, "bend": {}, "dihedralBending": 0, "pressure": 0, "damping": 0, "drag": 0, "lift": 0, "friction": 0.5,
    "thickness": 0.25, "solver": {"massSpring": {}}
  }, {
    "name": "held", "grid": {"rows": 2, "columns": 2, "width": 1, "height": 1,
                             "pose": {"position": {}, "orientation": {"w": 1}}},
    "mass": 1, "structural": {}, "shear": {}, "bend": {}, "dihedralBending": 0, "pressure": 0, "damping": 0, "drag": 0, "lift": 0, "friction": 0.5, "thickness": 0.25,
    "solver": {"constraint": {"bendConstraints": true, "compliance": 0.0625, "iterations": 30, "tolerance": 0.25,
                              "path": "CONSTRAINT_PATH_ASSEMBLED"}}
  }, {
    "name": "sleeve", "grid": {"rows": 2, "columns": 2, "width": 1, "height": 1,
                               "pose": {"position": {}, "orientation": {"w": 1}}},
    "mass": 1, "structural": {}, "shear": {}, "bend": {}, "dihedralBending": 0, "damping": 0, "drag": 0, "lift": 0, "friction": 0.5,
    "thickness": 0.25, "solver": {"massSpring": {}},
    "skin": {"collider": "limb", "vertexJoints": [0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0],
             "vertexWeights": [0.75, 0.25, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5, 0.5, 0, 0],
             "maxDistances": [-1, 0, 0.5, 1000], "backstopDistances": [0, 0.25, 0, 0], "backstopRadii": [0, 0.5, 0, 0]}
  }, {
    "name": "adaptive", "grid": {"rows": 2, "columns": 2, "width": 1, "height": 1,
                                 "pose": {"position": {}, "orientation": {"w": 1}}},
    "mass": 1, "structural": {}, "shear": {}, "bend": {}, "dihedralBending": 0, "pressure": 0, "damping": 0, "drag": 0, "lift": 0, "friction": 0.5,
    "thickness": 0.25,
    "solver": {"acad": {"activation": 0.25, "mode": "ACAD_MODE_PAPER",
                        "constraint": {"bendConstraints": true, "compliance": 0, "iterations": 30, "tolerance": 0,
                                       "path": "CONSTRAINT_PATH_MATRIX_FREE"}}}
  }, {
    "name": "corrected", "grid": {"rows": 2, "columns": 2, "width": 1, "height": 1,
                                  "pose": {"position": {}, "orientation": {"w": 1}}},
    "mass": 1, "structural": {}, "shear": {}, "bend": {}, "dihedralBending": 0, "pressure": 0, "damping": 0, "drag": 0, "lift": 0, "friction": 0.5,
    "thickness": 0.25, "solver": {"xpbd": {"iterations": 3, "compliance": 0}}
  }, {
    "name": "implicit", "grid": {"rows": 2, "columns": 2, "width": 1, "height": 1,
                                 "pose": {"position": {}, "orientation": {"w": 1}}},
    "mass": 1, "structural": {}, "shear": {}, "bend": {}, "dihedralBending": 0, "pressure": 0, "damping": 0, "drag": 0, "lift": 0, "friction": 0.5,
    "thickness": 0.25, "solver": {"implicitEuler": {"iterations": 3, "tolerance": 0.25}},
    "tethers": {"slack": 0.25}, "coarse": {"cells": 5, "sweeps": 3, "every": 7, "levels": 2},
    "attachments": [{
      "name": "knot", "vertices": [2], "collider": "table"
    }, {
      "name": "rod",
      "ranges": [{"firstRow": 0, "lastRow": 0, "rowStep": 1, "firstColumn": 1, "lastColumn": 1, "columnStep": 1}],
      "regions": [{"centre": {"x": 9, "y": 9, "z": 9}, "radius": 0.25}],
      "pose": {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
      "motion": {"keys": [{"time": 0, "position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
                          {"time": 1, "position": {"x": 3, "y": 2, "z": 1}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}],
                 "steady": false}
    }]
  }],
  "colliders": [{
    "name": "finger", "capsule": {"radius": 0.25, "length": 0.5, "topRadius": 0.125}, "pose": {"position": {"x": 1, "y": 0, "z": 0},
    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "friction": 1
  }, {
    "name": "floor", "plane": {}, "pose": {"position": {"x": 1, "y": 0, "z": 0},
    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "friction": 1
  }, {
    "name": "table", "box": {"size": {"x": 1, "y": 2, "z": 3}}, "pose": {"position": {"x": 1, "y": 0, "z": 0},
    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "friction": 1
  }, {
    "name": "stone", "hull": {
      "vertices": [{"x": 0, "y": 0, "z": 0}, {"x": 1, "y": 0, "z": 0}, {"x": 0, "y": 1, "z": 0},
                   {"x": 0.25, "y": 0.25, "z": 1}],
      "faces": [{"vertices": [0, 2, 1]}, {"vertices": [0, 1, 3]}, {"vertices": [0, 3, 2]}, {"vertices": [1, 2, 3]}]
    }, "pose": {"position": {"x": 1, "y": 0, "z": 0},
    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "friction": 1
  }, {
    "name": "sampled", "mesh": {"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1],
      "triangles": [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], "distanceCell": 0.0625},
    "pose": {"position": {}, "orientation": {"w": 1}}, "friction": 1
  }, {
    "name": "limb", "mesh": {
      "positions": [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1],
      "triangles": [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3],
      "skin": {
        "joints": [{"name": "root", "rest": {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}},
                   {"name": "tip", "parent": 0,
                    "rest": {"position": {"x": 0, "y": 0, "z": 0.5}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}}],
        "vertexJoints": [0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0],
        "vertexWeights": [0.75, 0.25, 0, 0, 0.75, 0.25, 0, 0, 0.75, 0.25, 0, 0, 0.75, 0.25, 0, 0],
        "animation": {"keys": [{"time": 0, "joints": [{"position": {}, "orientation": {"w": 1}}, {"position": {}, "orientation": {"w": 1}}]},
                               {"time": 2, "joints": [{"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
                                                      {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}]}]}
      }
    }, "pose": {"position": {"x": 1, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "friction": 1
  }, {
    "name": "ball", "sphere": {"radius": 0.5},
    "pose": {"position": {"x": 4, "y": 5, "z": 6}, "orientation": {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5}},
    "friction": 0.25,
    "motion": {"keys": [{"time": 0, "position": {"x": 1, "y": 1, "z": 1}, "orientation": {"w": 1}},
                        {"time": 2.5, "position": {"x": 2, "y": 3, "z": 4},
                         "orientation": {"x": 0.5, "y": 0.5, "z": -0.5, "w": 0.5}}],
               "steady": true}
  }],
  "stream": {"maxError": 0.001, "normals": "NORMALS_OCTAHEDRAL", "qualities": 4}
})json";

using Names = std::set<std::string>;

// Names of every field of a message type and of its submessages.
void addFields(const google::protobuf::Descriptor* descriptor, Names& names) {
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
    names.insert(field->full_name());
    if (field->message_type() != nullptr) addFields(field->message_type(), names);
  }
}

// Names of the fields that are set.
void addSetFields(const google::protobuf::Message& message, Names& names) {
  const auto* reflection = message.GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  reflection->ListFields(message, &fields);
  for (const auto* field : fields) {
    names.insert(field->full_name());
    if (field->message_type() == nullptr) continue;
    if (field->is_repeated())
      for (int i = 0; i < reflection->FieldSize(message, field); ++i)
        addSetFields(reflection->GetRepeatedMessage(message, field, i), names);
    else
      addSetFields(reflection->GetMessage(message, field), names);
  }
}

// Ensures that the test above covers fields that are added to the proto.
void expectEveryFieldSet(const v1::Scene& message) {
  Names all, set;
  addFields(message.GetDescriptor(), all);
  addSetFields(message, set);
  // A mesh is written as it is in the scene, placed and repaired, not as its file (mesh_message_test.cpp).
  for (const char* field : {"file", "pose", "scale", "repair", "fit"})
    all.erase(std::string("clothstream.v1.Mesh.") + field);
  for (const char* field : {"file", "animation", "scale"})
    all.erase(std::string("clothstream.v1.ColliderMesh.") + field);
  all.erase("clothstream.v1.Cloth.areal_mass");  // comes back as `mass`
  // A skin is written with the joints and limits of every node (cloth_skin_test.cpp).
  for (const char* field : {"limits", "colour_distance", "regions"})
    all.erase(std::string("clothstream.v1.ClothSkin.") + field);
  std::erase_if(all, [](const std::string& field) {
    return field.starts_with("clothstream.v1.SkinLimits.") ||
           field.starts_with("clothstream.v1.SkinRegion.") ||
           field.starts_with("clothstream.v1.ColourDistance.");
  });
  EXPECT_THAT(set, testing::ContainerEq(all));
}

v1::Scene messageOf(const char* json) {
  v1::Scene message;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(json, &message).ok());
  return message;
}

TEST(SceneFile, KeepsEveryFieldThroughTheModel) {
  const v1::Scene message = messageOf(kEveryField);
  expectEveryFieldSet(message);
  const Result<model::Scene> scene = parseScene(kEveryField, "test");
  ASSERT_TRUE(scene) << scene.error().text;
  std::string difference;
  google::protobuf::util::MessageDifferencer differencer;
  differencer.ReportDifferencesToString(&difference);
  EXPECT_TRUE(differencer.Compare(message, toMessage(*scene))) << difference;
}

TEST(SceneFile, KeepsEveryFieldThroughJson) {
  const Result<model::Scene> scene = parseScene(kEveryField, "test");
  const Result<model::Scene> again = parseScene(toJson(*scene), "again");
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(toMessage(*scene), toMessage(*again)));
}

TEST(SceneFile, RefusesMoreNodesThanPermitted) {
  const std::uint32_t nodes = parseScene(kEveryField, "test")->nodeCount();
  EXPECT_TRUE(parseScene(kEveryField, "test", {}, nodes));
  EXPECT_FALSE(parseScene(kEveryField, "test", {}, nodes - 1));
}

std::string errorOf(const char* json) {
  const Result<model::Scene> scene = parseScene(json, "my.json");
  return scene ? "no error" : scene.error().text;
}

TEST(SceneFile, ReportsLineAndColumnOfMalformedJson) {
  EXPECT_THAT(errorOf("{\n  \"name\": \"a\"\n  \"substeps\": 3}"),
              AllOf(StartsWith("my.json: "), HasSubstr("line 3, column 12")));
  EXPECT_THAT(errorOf(""), AllOf(StartsWith("my.json: "), HasSubstr("line 1, column 1")));
  EXPECT_THAT(errorOf("{\"name\": \"a\"} {}"), HasSubstr("line 1, column 15"));
  EXPECT_THAT(errorOf("{\"name\": \"\xff\"}"), HasSubstr("UTF-8"));
}

TEST(SceneFile, IsUtf8WithOrWithoutAByteOrderMark) {
  const std::string text = kEveryField;
  EXPECT_TRUE(parseScene("\xef\xbb\xbf" + text, "marked.json"));
  for (const std::string mark : {"", "\xff\xfe"}) {
    std::string wide = mark;
    for (const char c : text) (wide += c) += '\0';
    EXPECT_THAT(parseScene(wide, "wide.json").error().text,
                AllOf(StartsWith("wide.json: is text in UTF-16"), HasSubstr("save it as UTF-8")));
  }
}

TEST(SceneFile, NamesThePlaceOfTextInAnotherEncoding) {
  const std::string error = parseScene("{\"name\":\n\"\x83V\"}", "sjis.json").error().text;
  EXPECT_THAT(error, AllOf(StartsWith("sjis.json: parse error at line 2"), HasSubstr("\\x83"),
                           HasSubstr("save the file as UTF-8")));
}

TEST(SceneFile, RefusesUnknownFieldsAndWrongTypes) {
  EXPECT_THAT(errorOf("{\"subteps\": 3}"), AllOf(StartsWith("my.json: "), HasSubstr("subteps")));
  EXPECT_THAT(errorOf("{\"cloths\": [{\"mas\": 1}]}"), AllOf(HasSubstr("cloths[0]"), HasSubstr("mas")));
  EXPECT_THAT(errorOf("{\"cloths\": [{\"mass\": \"heavy\"}]}"),
              AllOf(HasSubstr("cloths[0].mass"), HasSubstr("heavy")));
  EXPECT_THAT(errorOf("{\"substeps\": -1}"), AllOf(HasSubstr("substeps"), HasSubstr("-1")));
  EXPECT_THAT(errorOf("{\"integrator\": \"MAGIC\"}"), AllOf(HasSubstr("integrator"), HasSubstr("MAGIC")));
  EXPECT_THAT(errorOf("{\"stream\": {\"coding\": \"CODING_PACKED\"}}"),
              AllOf(HasSubstr("(stream) coding"), HasSubstr("correct or remove it")));
  EXPECT_THAT(errorOf("{\"stream\": {\"temporalLayers\": 2}}"),
              AllOf(HasSubstr("(stream) temporalLayers"), HasSubstr("correct or remove it")));
  EXPECT_THAT(errorOf("[]"), StartsWith("my.json: not a scene"));
}

TEST(SceneFile, RefusesDeepNesting) {
  const std::string deep = "{\"cloths\":" + std::string(200'000, '[') + std::string(200'000, ']') + "}";
  EXPECT_THAT(errorOf(deep.c_str()), StartsWith("my.json: "));
}

TEST(SceneFile, NamesTheFieldOfAnInvalidValue) {
  EXPECT_THAT(errorOf("{\"name\": \"a\", \"substeps\": 300}"),
              StartsWith("my.json: substeps = 300: must be a whole number from 1 to 256"));
}

class SceneFileOnDisk : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directory(directory_); }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path write(const char* name, std::string_view text) const {
    std::ofstream(directory_ / name, std::ios::binary) << text;
    return directory_ / name;
  }

  std::filesystem::path directory_ =
      std::filesystem::path(testing::TempDir()) /
      ("scene_file_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(SceneFileOnDisk, ReadsMeshesRelativeToItself) {
  std::filesystem::create_directory(directory_ / "meshes");
  write("meshes/rag.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  constexpr const char* kScene = R"json({"name": "a", "cloths": [{
    "name": "rag", "mesh": {"file": "meshes/rag.obj", "scale": 0.5}}]})json";
  const Result<model::Scene> scene = readSceneFile(write("scene.json", kScene));
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->cloths[0].nodeCount(), 4u);
  EXPECT_FLOAT_EQ(scene->cloths[0].mass, 0.2f * 0.25f);
  const Result<model::Scene> elsewhere = parseScene(kScene, "message");
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().text,
              HasSubstr("cloths[0].mesh.file = \"meshes/rag.obj\": files can only be named in scene"));
  write("meshes/rag.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n");
  const Result<model::Scene> bad = readSceneFile(directory_ / "scene.json");
  ASSERT_FALSE(bad);
  EXPECT_THAT(bad.error().text,
              HasSubstr("cloths[0].mesh = \"meshes/rag.obj\": face 0 names vertex 2; there are 2"));
  std::filesystem::remove(directory_ / "meshes/rag.obj");
  const Result<model::Scene> missing = readSceneFile(directory_ / "scene.json");
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().text, AllOf(HasSubstr("cloths[0].mesh.file"), HasSubstr("No such file")));
}

TEST_F(SceneFileOnDisk, IsRead) {
  const Result<model::Scene> scene = readSceneFile(write("scene.json", kEveryField));
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->name, "every_field");
}

TEST_F(SceneFileOnDisk, IsRefusedIfMissing) {
  const Result<model::Scene> scene = readSceneFile(directory_ / "none.json");
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(scene.error().text, AllOf(HasSubstr("none.json"), HasSubstr("no such file")));
}

TEST_F(SceneFileOnDisk, IsRefusedIfADirectory) {
  const Result<model::Scene> scene = readSceneFile(directory_);
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().text, HasSubstr("is a directory"));
}

TEST_F(SceneFileOnDisk, IsRefusedIfTooLarge) {
  for (const std::size_t beyond : {1, 2, 100'000}) {
    const Result<model::Scene> scene =
        readSceneFile(write("large.json", std::string(limits::kMaxSceneFileBytes + beyond, ' ')));
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED) << beyond;
    EXPECT_THAT(scene.error().text, AllOf(HasSubstr("large.json"), HasSubstr("too large")));
  }
}

TEST_F(SceneFileOnDisk, IsFoundByNameOrPath) {
  EXPECT_EQ(loadScene("flag")->name, "flag");
  EXPECT_EQ(loadScene(write("flag.json", kEveryField).string())->name, "every_field");
  const Result<model::Scene> none = loadScene("no_such_scene");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(none.error().text, HasSubstr("curtain, figure_07, figure_09"));
}

}  // namespace
}  // namespace clothstream::messages

// SPDX-License-Identifier: MIT
// Meshes in messages: conversion in both directions, pins and errors.
#include <cmath>
#include <functional>
#include <numbers>

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "server/messages/description.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/model/mesh.h"
#include "tests/messages/scenes.h"

namespace clothstream::messages {
namespace {

using testing::HasSubstr;

// A quad with an adjacent triangle, two parts and a vertex without a face.
v1::Scene meshScene() {
  v1::Scene message = smallScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  cloth.clear_pins();
  v1::Mesh& mesh = *cloth.mutable_mesh();
  for (const float x :
       {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f, 9.f, 9.f, 9.f, 2.f, 0.f, 0.f})
    mesh.add_positions(x);
  for (const std::uint32_t i : {0u, 1u, 3u, 1u, 2u, 3u, 1u, 5u, 2u}) mesh.add_triangles(i);
  mesh.add_quads(0);
  for (int i = 0; i < 12; ++i) mesh.add_uvs(0.125f * static_cast<float>(i));
  for (const auto& [name, count] : {std::pair("cotton", 2u), std::pair("silk", 1u)}) {
    v1::Submesh& part = *mesh.add_submeshes();
    part.set_name(name);
    part.set_triangle_count(count);
  }
  mesh.mutable_pose()->mutable_position()->set_y(2);
  mesh.set_scale(0.5f);
  return message;
}

TEST(MeshMessage, BecomesAMesh) {
  const Result<model::Scene> scene = toScene(meshScene());
  ASSERT_TRUE(scene) << scene.error().text;
  const model::Cloth& cloth = scene->cloths[0];
  ASSERT_TRUE(cloth.mesh);
  EXPECT_EQ(cloth.nodeCount(), 5u);
  EXPECT_EQ(cloth.mesh->shape.quads.size(), 1u);
  EXPECT_EQ(cloth.mesh->shape.submeshes[1].name, "silk");
  EXPECT_EQ(cloth.mesh->shape.uvs.size(), 6u);
  EXPECT_NEAR(cloth.mesh->area, 1.5 * 0.25, 1e-6);
  for (const model::Vec3& p : cloth.mesh->shape.positions) EXPECT_GE(p.y(), 2);
}

// Names of parts reach clients in messages, whose texts must be UTF-8.
TEST(MeshMessage, RefusesNamesOfPartsInFilesThatNoMessageHolds) {
  v1::Scene message = smallScene();
  message.mutable_cloths(0)->mutable_mesh()->set_file("sheet.obj");
  const auto errorOf = [&](const std::string& name) {
    const MeshReader reader = [&](const std::string&, const meshes::JointRequest*) {
      meshes::MeshSource source;
      source.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
      source.faces = {{.cornerCount = 3, .vertices = {0, 1, 2, 0}, .uvs = {}}};
      source.parts = {{name, 0}};
      return tl::expected<meshes::MeshSource, std::string>(std::move(source));
    };
    const auto scene = toScene(message, reader);
    return scene ? std::string("no error") : scene.error().text;
  };
  EXPECT_EQ(errorOf(""), "no error");
  EXPECT_EQ(errorOf("L\xc3\xb6we 2"), "no error");
  EXPECT_THAT(
      errorOf("\x83V\x83"),
      HasSubstr("cloths[0].mesh.file = \"sheet.obj\": has a material or object named \"\\x83V\\x83\""));
  EXPECT_THAT(errorOf("two\nlines"), HasSubstr("named \"two\\x0alines\", whose name must be one line"));
  EXPECT_THAT(errorOf(std::string(1025, 'a')), HasSubstr("rename it"));
}

TEST(MeshMessage, RefusesMorePartsThanClientsRead) {
  v1::Scene message = smallScene();
  v1::Mesh& mesh = *message.mutable_cloths(0)->mutable_mesh();
  constexpr std::uint32_t kTriangles = 65'537;
  for (std::uint32_t i = 0; i < kTriangles; ++i) {
    const auto x = 0.01f * static_cast<float>(i % 1000), y = 0.01f * static_cast<float>(i / 1000);
    for (const float value : {x, y, 0.0f, x + 0.005f, y, 0.0f, x, y + 0.005f, 0.0f})
      mesh.add_positions(value);
    for (std::uint32_t k = 0; k < 3; ++k) mesh.add_triangles(3 * i + k);
    mesh.add_submeshes()->set_triangle_count(1);
  }
  message.mutable_cloths(0)->mutable_structural()->set_stiffness(0);
  EXPECT_THAT(toScene(message).error().text, HasSubstr("cloths: have meshes with 65537 parts in all"));
}

TEST(MeshMessage, SurvivesTheWayThroughAMessage) {
  v1::Scene message = meshScene();
  message.mutable_cloths(0)->add_pinned_vertices(5);
  message.mutable_cloths(0)->add_pinned_regions()->set_radius(0.5f);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::Scene once = toMessage(*scene);
  const Result<model::Scene> again = toScene(once);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(again->cloths[0].mesh->shape.positions, scene->cloths[0].mesh->shape.positions);
  EXPECT_EQ(pinnedNodes(again->cloths[0]), pinnedNodes(scene->cloths[0]));
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(toMessage(*again), once));
}

TEST(MeshMessage, PinsVerticesOfTheMessageAndRegions) {
  v1::Scene message = meshScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  const auto pinned = [&] {
    const Result<model::Scene> scene = toScene(message);
    EXPECT_TRUE(scene) << scene.error().text;
    std::vector<std::pair<float, float>> places;
    const std::vector<std::uint8_t> flags = pinnedNodes(scene->cloths[0]);
    for (std::size_t i = 0; i < flags.size(); ++i) {
      const model::Vec3& p = scene->cloths[0].mesh->shape.positions[i];
      if (flags[i] != 0) places.emplace_back(p.x(), p.y());
    }
    std::ranges::sort(places);
    return places;
  };
  using Places = std::vector<std::pair<float, float>>;
  cloth.add_pinned_vertices(5);
  EXPECT_EQ(pinned(), (Places{{1, 2}}));
  v1::Region& region = *cloth.add_pinned_regions();
  region.mutable_centre()->set_y(2.5f);
  region.set_radius(0.1f);
  EXPECT_EQ(pinned(), (Places{{0, 2.5f}, {1, 2}}));
  region.mutable_size()->set_x(1);  // from -0.5 to 0.5
  EXPECT_EQ(pinned(), (Places{{0, 2.5f}, {0.5f, 2.5f}, {1, 2}}));
}

TEST(MeshMessage, PinsGridsByVertexAndRegion) {
  v1::Scene message = smallScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  cloth.clear_pins();
  cloth.add_pinned_vertices(1);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(pinnedNodes(scene->cloths[0])[1], 1);
  cloth.add_pinned_vertices(100'000);
  const Result<model::Scene> bad = toScene(message);
  ASSERT_FALSE(bad);
  EXPECT_THAT(bad.error().text,
              HasSubstr("cloths[0].pinnedVertices[1] = 100000: must be a whole number from 0 to"));
}

TEST(MeshMessage, RefusesMoreEntriesThanVertices) {
  v1::Scene grid = smallScene();
  grid.mutable_cloths(0)->clear_pins();
  for (v1::Scene message : {grid, meshScene()}) {
    const Result<model::Scene> before = toScene(message);
    ASSERT_TRUE(before) << before.error().text;
    v1::Cloth& cloth = *message.mutable_cloths(0);
    const int vertices = cloth.has_mesh() ? 6 : static_cast<int>(before->cloths[0].nodeCount());
    for (int i = 0; i < vertices; ++i) cloth.add_pinned_vertices(1);
    const Result<model::Scene> most = toScene(message);
    ASSERT_TRUE(most) << most.error().text;
    // A node is listed once.
    EXPECT_EQ(most->cloths[0].pinnedVertices.size(), 1u);
    cloth.add_pinned_vertices(1);
    const Result<model::Scene> more = toScene(message);
    ASSERT_FALSE(more);
    EXPECT_THAT(more.error().text, HasSubstr("cloths[0].pinnedVertices"));
    EXPECT_THAT(more.error().text, HasSubstr(std::to_string(vertices + 1) + " elements; must have 0 to"));
  }
}

// Fan of triangles that share one node.
TEST(MeshMessage, RefusesAssembledSystemsThatAreTooLarge) {
  v1::Scene message = smallScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  cloth.clear_pins();
  v1::Mesh& mesh = *cloth.mutable_mesh();
  constexpr std::uint32_t kSpokes = 400;
  for (std::uint32_t i = 0; i <= kSpokes; ++i) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / kSpokes;
    for (const float x : {std::cos(angle), std::sin(angle), 0.0f}) mesh.add_positions(i < kSpokes ? x : 0);
    if (i < kSpokes)
      for (const std::uint32_t corner : {i, (i + 1) % kSpokes, kSpokes}) mesh.add_triangles(corner);
  }
  v1::ConstraintSolver& solver = *cloth.mutable_solver()->mutable_constraint();
  EXPECT_TRUE(toScene(message));
  solver.set_path(v1::CONSTRAINT_PATH_ASSEMBLED);
  const Result<model::Scene> bad = toScene(message);
  ASSERT_FALSE(bad);
  EXPECT_THAT(bad.error().text, HasSubstr("matrices of at most 256 entries a node; this one's has"));
}

TEST(MeshMessage, IsDescribedToClientsOnce) {
  const Result<model::Scene> scene = toScene(meshScene());
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::StreamDescription description = toDescription(*scene, 1, 1, 0);
  const v1::ClothDescription& cloth = description.cloths(0);
  EXPECT_EQ(cloth.vertex_count(), 5u);
  EXPECT_EQ(cloth.rows(), 0u);
  EXPECT_EQ(cloth.rest_positions().size(), 5u * 12);
  EXPECT_EQ(cloth.triangles().size(), 3u * 12);
  EXPECT_EQ(cloth.uvs().size(), 6u * 8);
  EXPECT_EQ(cloth.uv_triangles().size(), 3u * 12);
  EXPECT_EQ(cloth.submeshes(0).triangle_count(), 2u);
  EXPECT_EQ(geometryBytes(scene->cloths[0]), cloth.rest_positions().size() + cloth.triangles().size() +
                                                 cloth.uvs().size() + cloth.uv_triangles().size());
  EXPECT_TRUE(description.definition().cloths(0).has_mesh());
  EXPECT_EQ(description.definition().cloths(0).mesh().positions_size(), 0);
}

// Texture coordinates alone exceed the limit, used or not.
TEST(MeshMessage, RefusesMeshesThatDoNotFitADescription) {
  v1::Scene message = meshScene();
  v1::Mesh& mesh = *message.mutable_cloths(0)->mutable_mesh();
  for (const std::uint32_t i : {0u, 1u, 3u, 1u, 2u, 3u, 1u, 5u, 2u}) mesh.add_uv_triangles(i);
  mesh.mutable_uvs()->Resize(2 * (limits::kMaxGeometryBytes / 8), 0);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().text,
              HasSubstr("bytes of positions, triangles and texture coordinates; a client"));
}

// Two triangles and a flap on their common edge, which is pinned; the flap faces another way.
v1::Scene flapScene() {
  v1::Scene message = smallScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  cloth.clear_pins();
  v1::Mesh& mesh = *cloth.mutable_mesh();
  for (const float x : {0.f, 0.f, 0.f, 0.f, 1.f, 0.f, 1.f, 0.f, 0.f, -1.f, 0.f, 0.f, 0.f, 0.f, 1.f})
    mesh.add_positions(x);
  for (const std::uint32_t i : {0u, 2u, 1u, 0u, 1u, 3u, 0u, 1u, 4u}) mesh.add_triangles(i);
  cloth.add_pinned_vertices(0);
  cloth.add_pinned_vertices(1);
  return message;
}

TEST(MeshMessage, IsRepairedOnRequestAndSaysWhat) {
  v1::Scene message = flapScene();
  const Result<model::Scene> refused = toScene(message);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("or set \"repair\""));
  message.mutable_cloths(0)->mutable_mesh()->set_repair(true);
  std::vector<v1::MeshRepair> repairs;
  const Result<model::Scene> scene = toScene(message, {}, {}, &repairs);
  ASSERT_TRUE(scene) << scene.error().text;
  ASSERT_EQ(repairs.size(), 1u);
  EXPECT_EQ(repairs[0].cloth(), scene->cloths[0].name);
  EXPECT_EQ(repairs[0].split_edges(), 1u);
  EXPECT_EQ(repairs[0].added_vertices(), 2u);
  EXPECT_EQ(repairs[0].sentences_size(), 2);
  // All copies of the pinned vertices are pinned.
  EXPECT_EQ(scene->cloths[0].nodeCount(), 7u);
  EXPECT_EQ(scene->cloths[0].pinnedVertices.size(), 4u);
}

TEST(MeshMessage, KeepsARepairedMeshWhenSaved) {
  v1::Scene message = flapScene();
  message.mutable_cloths(0)->mutable_mesh()->set_repair(true);
  message.mutable_cloths(0)->mutable_mesh()->set_fit(true);
  message.mutable_cloths(0)->mutable_mesh()->set_scale(5000);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::Scene saved = toMessage(*scene);
  EXPECT_FALSE(saved.cloths(0).mesh().repair());
  std::vector<v1::MeshRepair> repairs;
  const Result<model::Scene> again = toScene(saved, {}, {}, &repairs);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_TRUE(repairs.empty());
  EXPECT_EQ(again->cloths[0].mesh->shape.positions, scene->cloths[0].mesh->shape.positions);
  EXPECT_EQ(again->cloths[0].mesh->shape.triangles, scene->cloths[0].mesh->shape.triangles);
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(toMessage(*again), saved));
}

TEST(MeshMessage, IsScaledOnlyOnRequest) {
  v1::Scene message = meshScene();
  v1::Mesh& mesh = *message.mutable_cloths(0)->mutable_mesh();
  for (const float scale : {5000.f, 1e-5f}) {
    mesh.set_scale(scale);
    mesh.set_fit(false);
    const Result<model::Scene> refused = toScene(message);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().text, HasSubstr("or set \"fit\", which makes it 2 m large"));
    mesh.set_fit(true);
    std::vector<v1::MeshRepair> repairs;
    const Result<model::Scene> scene = toScene(message, {}, {}, &repairs);
    ASSERT_TRUE(scene) << scene.error().text;
    ASSERT_EQ(repairs.size(), 1u);
    EXPECT_NEAR(repairs[0].fitted_scale() * scale, 2.0 / 9, 1e-5);  // its box is 9 m, with the unused vertex
    EXPECT_THAT(repairs[0].sentences(0), HasSubstr("to 2 x 2 x 2 m"));
  }
}

TEST(MeshMessage, RefusesMoreNodesAfterARepairThanAllowed) {
  v1::Scene message = flapScene();
  message.mutable_cloths(0)->mutable_mesh()->set_repair(true);
  EXPECT_TRUE(toScene(message, {}, {.nodes = 7}));
  const Result<model::Scene> scene = toScene(message, {}, {.nodes = 6});
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().text, HasSubstr("has more than 6 vertices once its edges are split"));
}

TEST(MeshMessage, RefusesMoreSpringsOfANodeThanTheLimit) {
  EXPECT_TRUE(toScene(meshScene()));
  const Result<model::Scene> scene = toScene(meshScene(), {}, {.nodeSprings = 3});
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().text, HasSubstr("cloths[0].mesh: vertex"));
  EXPECT_THAT(scene.error().text, HasSubstr("has more than 3 springs"));
  EXPECT_EQ(scene.error().limit, telemetry::Refusal::sceneSize);
}

TEST(MeshMessage, RepairedClothsShareTheLimitOfNodes) {
  v1::Scene message = flapScene();
  message.mutable_cloths(0)->mutable_mesh()->set_repair(true);
  v1::Cloth& second = *message.add_cloths();
  second = message.cloths(0);
  second.set_name("second");
  EXPECT_TRUE(toScene(message, {}, {.nodes = 14}));
  const Result<model::Scene> scene = toScene(message, {}, {.nodes = 13});
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().text,
              HasSubstr("cloths[1].mesh: has more than 6 vertices once its edges are split"));
}

struct BadCase {
  const char* says;
  std::function<void(v1::Cloth&, v1::Mesh&)> spoil;
};

TEST(MeshMessage, RefusesInvalidMeshes) {
  const BadCase cases[] = {
      {"cloths[0].mesh.positions: has 19 numbers; must have 3 for each",
       [](auto&, auto& m) { m.add_positions(0); }},
      {"cloths[0].mesh.triangles: has 10 numbers", [](auto&, auto& m) { m.add_triangles(0); }},
      {"cloths[0].mesh.uvs: has 13 numbers", [](auto&, auto& m) { m.add_uvs(0); }},
      {"cloths[0].mesh.uvs: has 14 numbers for 6 vertices",
       [](auto&, auto& m) { m.add_uvs(0), m.add_uvs(0); }},
      {"cloths[0].mesh.uvTriangles: has 1 numbers; must have as many as triangles, 9",
       [](auto&, auto& m) { m.add_uv_triangles(0); }},
      {"cloths[0].mesh: face 2 names vertex 6; there are 6", [](auto&, auto& m) { m.set_triangles(7, 6); }},
      {"cloths[0].mesh: vertex 0 is at (nan, 0, 0)", [](auto&, auto& m) { m.set_positions(0, NAN); }},
      {"cloths[0].mesh: faces 1 and 2 are not a quad: they share no edge",
       [](auto&, auto& m) {
         m.set_quads(0, 1);
         m.set_triangles(6, 4), m.set_triangles(8, 5), m.set_triangles(7, 0);
       }},
      {"cloths[0].mesh: faces 7 and 8 are not a quad", [](auto&, auto& m) { m.set_quads(0, 7); }},
      {"cloths[0].mesh.submeshes[1].triangleCount = 2: must be 1 or more, and there are 1",
       [](auto&, auto& m) { m.mutable_submeshes(1)->set_triangle_count(2); }},
      {"cloths[0].mesh.submeshes: have 2 triangles of 3",
       [](auto&, auto& m) { m.mutable_submeshes()->RemoveLast(); }},
      {"cloths[0].mesh.scale = 0:", [](auto&, auto& m) { m.set_scale(0); }},
      {"cloths[0].mesh.weldDistance = 1:", [](auto&, auto& m) { m.set_weld_distance(1); }},
      {"cloths[0].mesh.file = \"x.obj\": is given together with positions",
       [](auto&, auto& m) { m.set_file("x.obj"); }},
      {"cloths[0].mesh: has no vertices", [](auto&, auto& m) { m.Clear(); }},
      {"cloths[0].pins: must be absent for a mesh", [](auto& c, auto&) { c.add_pins(); }},
      {"cloths[0].pinnedVertices[0] = 6: must be a whole number from 0 to 5",
       [](auto& c, auto&) { c.add_pinned_vertices(6); }},
      {"cloths[0].pinnedVertices[0] = 4: is a vertex without a face",
       [](auto& c, auto&) { c.add_pinned_vertices(4); }},
      {"cloths[0].pinnedRegions[0]: has no shape", [](auto& c, auto&) { c.add_pinned_regions(); }},
      {"cloths[0].pinnedRegions[0].radius = -1:",
       [](auto& c, auto&) { c.add_pinned_regions()->set_radius(-1); }},
  };
  for (const BadCase& bad : cases) {
    v1::Scene message = meshScene();
    v1::Cloth& cloth = *message.mutable_cloths(0);
    bad.spoil(cloth, *cloth.mutable_mesh());
    const Result<model::Scene> scene = toScene(message);
    ASSERT_FALSE(scene) << bad.says;
    EXPECT_THAT(scene.error().text, HasSubstr(bad.says));
  }
}

}  // namespace
}  // namespace clothstream::messages

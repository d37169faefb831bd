// SPDX-License-Identifier: MIT
// Scene messages: defaults, and the error for everything that is refused.
#include "server/messages/scene_message.h"

#include <cctype>
#include <functional>
#include <limits>
#include <ostream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/model/material.h"
#include "server/model/springs.h"
#include "tests/messages/scenes.h"
#include "tests/model/meshes.h"

namespace clothstream::messages {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(ToScene, DerivesTheMaximumErrorFromTheFinestEdges) {
  v1::Scene message = smallScene();
  v1::Grid& grid = *message.mutable_cloths(0)->mutable_grid();
  grid.set_width(0.6f);
  grid.set_height(1.8f);
  grid.set_columns(61);
  grid.set_rows(181);
  message.set_substeps(60);
  Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_NEAR(scene->stream.maxError, 0.01 / 40, 1e-8);
  message.mutable_stream()->set_max_error(0.0007f);
  scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->stream.maxError, 0.0007f);
}

TEST(ToScene, AppliesTheDefaultsOfTheProto) {
  const Result<model::Scene> scene = toScene(smallScene());
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->simulationRate, 72u);
  EXPECT_EQ(scene->streamRate, 72u);
  EXPECT_EQ(scene->substeps, 10u);
  EXPECT_EQ(scene->integrator, model::Integrator::semiImplicitEuler);
  EXPECT_EQ(scene->environment.gravity, model::Vec3(0, -9.81f, 0));
  EXPECT_EQ(scene->environment.wind, model::Vec3(0, 0, 0));
  EXPECT_EQ(scene->environment.airDensity, 1.2f);
  EXPECT_EQ(scene->stream.maxError, 0.0005f);
  EXPECT_EQ(scene->stream.normals, model::Normals::none);
  const model::Cloth& cloth = scene->cloths.at(0);
  EXPECT_FLOAT_EQ(cloth.mass, 0.6f);
  EXPECT_EQ(cloth.damping, 0);
  EXPECT_EQ(cloth.drag, 0);
  EXPECT_EQ(cloth.lift, 0);
  EXPECT_EQ(cloth.friction, 0.3f);
  EXPECT_EQ(cloth.thickness, 0.005f);
  EXPECT_TRUE(cloth.pins.empty());
  EXPECT_TRUE(cloth.grid.pose.orientation.coeffs() == model::Quaternion::Identity().coeffs());
  EXPECT_EQ(scene->colliders.at(0).friction, 1);
  EXPECT_TRUE(scene->colliders.at(0).motion.keys.empty());
}

// smallScene() with a cube of 1 m, whose cloth has a pressure.
v1::Scene sceneWithGas(const std::function<void(model::MeshShape&)>& change = {}) {
  model::MeshShape shape = model::cube(1);
  if (change) change(shape);
  v1::Scene scene = smallScene();
  v1::Cloth& cloth = *scene.mutable_cloths(0);
  for (const model::Vec3& position : shape.positions)
    for (const float x : {position.x(), position.y(), position.z()}) cloth.mutable_mesh()->add_positions(x);
  for (const model::Triangle& triangle : shape.triangles)
    for (const std::uint32_t node : triangle) cloth.mutable_mesh()->add_triangles(node);
  cloth.set_pressure(500);
  return scene;
}

TEST(ToScene, ReadsThePressureOfClosedMeshes) {
  const Result<model::Scene> scene = toScene(sceneWithGas());
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->cloths[0].pressure, 500);
  EXPECT_EQ(toMessage(*scene).cloths(0).pressure(), 500);
}

TEST(ToScene, RefusesPressureInOpenAndTurnedMeshes) {
  const auto errorOf = [](const v1::Scene& message) {
    const Result<model::Scene> scene = toScene(message);
    return scene ? "no error" : scene.error().text;
  };
  const auto open = [](model::MeshShape& shape) { shape.triangles.pop_back(); };
  EXPECT_THAT(
      errorOf(sceneWithGas(open)),
      StartsWith("cloths[0].pressure = 500: must be 0: the cloth is open, among others at the edge from "));
  const auto turn = [](model::MeshShape& shape) {
    for (model::Triangle& triangle : shape.triangles) std::swap(triangle[1], triangle[2]);
  };
  v1::Scene turned = sceneWithGas(turn);
  EXPECT_EQ(errorOf(turned),
            "cloths[0].pressure = 500: must be 0: the cloth is inside out; turn all its faces, which must be "
            "counter-clockwise from outside, or set mesh.repair");
  turned.mutable_cloths(0)->mutable_mesh()->set_repair(true);
  EXPECT_EQ(errorOf(turned), "no error");
  v1::Scene otherIntegrator = sceneWithGas();
  otherIntegrator.set_integrator(v1::INTEGRATOR_RUNGE_KUTTA_4);
  EXPECT_EQ(errorOf(otherIntegrator),
            "cloths[0].pressure = 500: must be 0: other values need INTEGRATOR_SEMI_IMPLICIT_EULER");
}

TEST(ToScene, StreamsASlowSimulationAtTheSimulationRate) {
  v1::Scene message = smallScene();
  message.set_simulation_rate(60);
  EXPECT_EQ(toScene(message)->streamRate, 60u);
}

TEST(ToScene, KeepsExplicitZeros) {
  v1::Scene message = smallScene();
  message.mutable_environment()->mutable_gravity();
  message.mutable_environment()->set_air_density(0);
  message.mutable_cloths(0)->set_friction(0);
  message.mutable_cloths(0)->set_thickness(0);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->environment.gravity, model::Vec3(0, 0, 0));
  EXPECT_EQ(scene->environment.airDensity, 0);
  EXPECT_EQ(scene->cloths[0].friction, 0);
  EXPECT_EQ(scene->cloths[0].thickness, 0);
}

TEST(ToScene, AppliesTheMaterialBeforeGivenValues) {
  v1::Scene message = smallScene();
  v1::Cloth& described = *message.mutable_cloths(0);
  described.clear_structural();
  described.set_material("wool");
  described.set_friction(0.9f);
  const model::Material& wool = *model::findMaterial("wool");
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  const model::Cloth& cloth = scene->cloths[0];
  EXPECT_EQ(cloth.material, "wool");
  EXPECT_FLOAT_EQ(cloth.mass, 3 * wool.arealMass);
  EXPECT_EQ(cloth.structural.stiffness, wool.tension);
  EXPECT_EQ(cloth.bend.stiffness, static_cast<float>(model::bendStiffness(wool, cloth)));
  EXPECT_EQ(cloth.drag, wool.drag);
  EXPECT_EQ(cloth.friction, 0.9f);
  EXPECT_EQ(cloth.solver.kind, model::SolverKind::xpbd);
  // A message keeps everything, including the name of the material.
  const Result<model::Scene> again = toScene(toMessage(*scene));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(again->cloths[0].material, "wool");
  EXPECT_EQ(again->cloths[0].mass, cloth.mass);
  EXPECT_EQ(again->cloths[0].friction, 0.9f);
  // Used as forces, its springs are too stiff for these steps.
  described.mutable_solver()->mutable_mass_spring();
  described.mutable_grid()->set_rows(64);
  EXPECT_THAT(toScene(message).error().text, HasSubstr("this scene needs at least"));
  described.clear_solver();
  described.clear_material();
  described.set_areal_mass(0.5f);
  EXPECT_FLOAT_EQ(toScene(message)->cloths[0].mass, 1.5f);
}

TEST(ToScene, ReadsGusts) {
  v1::Scene message = smallScene();
  EXPECT_EQ(toScene(message)->environment.gust.strength, 0);
  message.mutable_environment()->mutable_gust()->set_strength(3);
  EXPECT_EQ(toScene(message)->environment.gust.seconds, 2);
  message.mutable_environment()->mutable_gust()->set_seconds(0.5f);
  const model::Gust gust = toScene(toMessage(*toScene(message)))->environment.gust;
  EXPECT_EQ(gust.strength, 3);
  EXPECT_EQ(gust.seconds, 0.5f);
}

TEST(ToScene, UsesOneXpbdIterationByDefault) {
  v1::Scene message = smallScene();
  message.mutable_cloths(0)->mutable_solver()->mutable_xpbd();
  // Springs of xpbd set no bound on explicit steps.
  message.mutable_cloths(0)->mutable_structural()->set_stiffness(1e6f);
  message.set_substeps(1);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  const model::Solver& solver = scene->cloths[0].solver;
  EXPECT_EQ(solver.kind, model::SolverKind::xpbd);
  EXPECT_EQ(solver.iterations, 1u);
  EXPECT_FALSE(solver.compliance);
}

TEST(ToScene, PinsOneNodeIfARangeHasNoLast) {
  v1::Scene message = smallScene();
  v1::GridRange& range = *message.mutable_cloths(0)->add_pins();
  range.set_first_row(2);
  range.set_first_column(3);
  const std::vector<std::uint8_t> pinned = model::pinnedNodes(toScene(message)->cloths[0]);
  for (std::size_t i = 0; i < pinned.size(); ++i) EXPECT_EQ(pinned[i], i == 2 * 5 + 3 ? 1 : 0);
}

TEST(ToScene, NormalisesNearlyUnitQuaternions) {
  v1::Scene message = smallScene();
  v1::Quaternion& q = *message.mutable_cloths(0)->mutable_grid()->mutable_pose()->mutable_orientation();
  q.set_x(0.6005f);
  q.set_w(0.8005f);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_NEAR(scene->cloths[0].grid.pose.orientation.norm(), 1, 1e-6);
}

TEST(ToScene, DefaultsBallRadiusToHalfTheShortestSpring) {
  v1::Scene message = smallScene();
  EXPECT_FALSE(toScene(message)->cloths[0].selfCollision);
  message.mutable_cloths(0)->mutable_grid()->set_height(1.2f);  // rows 0.4 m apart, columns 0.5 m
  message.mutable_cloths(0)->mutable_self_collision();
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  ASSERT_TRUE(scene->cloths[0].selfCollision);
  EXPECT_FLOAT_EQ(scene->cloths[0].selfCollision->radius, 0.2f);
  EXPECT_EQ(scene->cloths[0].selfCollision->friction, 0.3f);
  // A message keeps the radius.
  message.mutable_cloths(0)->mutable_self_collision()->set_radius(0.4f);
  message.mutable_cloths(0)->mutable_self_collision()->set_friction(0);
  const Result<model::Scene> again = toScene(toMessage(*toScene(message)));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(again->cloths[0].selfCollision->radius, 0.4f);
  EXPECT_EQ(again->cloths[0].selfCollision->friction, 0);
}

TEST(ToScene, KeepsThroughAMessageThatNothingPassesThroughACloth) {
  v1::Scene message = smallScene();
  message.mutable_cloths(0)->mutable_self_collision();
  EXPECT_FALSE(model::boundsMotion(toScene(message)->cloths[0]));
  message.mutable_cloths(0)->mutable_self_collision()->set_nothing_passes(true);
  const Result<model::Scene> again = toScene(toMessage(toScene(message).value()));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_TRUE(model::boundsMotion(again->cloths[0]));
}

TEST(ToScene, KeepsAttachmentsAndTethersThroughAMessage) {
  v1::Scene message = smallScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  cloth.clear_pins();
  v1::Attachment& rod = *cloth.add_attachments();
  rod.set_name("rod");
  rod.add_ranges()->set_last_column(4);
  rod.mutable_pose()->mutable_position()->set_y(1);
  for (const float time : {0.0f, 2.0f}) rod.mutable_motion()->add_keys()->set_time(time);
  v1::Attachment& knot = *cloth.add_attachments();
  knot.set_name("knot");
  knot.add_vertices(7);
  v1::Region& region = *knot.add_regions();
  region.set_radius(0.001f);
  region.mutable_centre()->set_y(-100);
  knot.set_collider(message.colliders(0).name());
  cloth.mutable_tethers();
  const Result<model::Scene> scene = toScene(toMessage(*toScene(message)));
  ASSERT_TRUE(scene) << scene.error().text;
  const std::vector<model::Attachment>& attachments = scene->cloths[0].attachments;
  ASSERT_EQ(attachments.size(), 2u);
  EXPECT_EQ(attachments[0].name, "rod");
  EXPECT_EQ(attachments[0].ranges.at(0).lastColumn, 4u);
  EXPECT_EQ(attachments[0].pose.position.y(), 1);
  EXPECT_EQ(attachments[0].motion.keys.size(), 2u);
  EXPECT_EQ(attachments[1].vertices, std::vector<std::uint32_t>{7});
  EXPECT_EQ(attachments[1].regions.at(0).radius, 0.001f);
  EXPECT_EQ(attachments[1].collider, message.colliders(0).name());
  ASSERT_TRUE(scene->cloths[0].tethers);
  EXPECT_EQ(scene->cloths[0].tethers->slack, 0.02f);
}

v1::Attachment& attachment(v1::Scene& scene, const char* name) {
  v1::Attachment& added = *scene.mutable_cloths(0)->add_attachments();
  added.set_name(name);
  added.add_vertices(static_cast<std::uint32_t>(10 + scene.cloths(0).attachments_size()));
  return added;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct BadScene {
  const char* error;  // start of the error text
  std::function<void(v1::Scene&)> spoil;
  const char* allowed = "must";  // a later part of the error text
};

v1::Cloth& cloth(v1::Scene& scene) {
  return *scene.mutable_cloths(0);
}
v1::Grid& grid(v1::Scene& scene) {
  return *cloth(scene).mutable_grid();
}
v1::Collider& collider(v1::Scene& scene) {
  return *scene.mutable_colliders(0);
}
v1::ConvexHull& hull(v1::Scene& scene) {
  return *collider(scene).mutable_hull();
}
void addKey(v1::Scene& scene, float time) {
  collider(scene).mutable_motion()->add_keys()->set_time(time);
}

const BadScene kBadScenes[] = {
    {"name = \"\":", [](v1::Scene& s) { s.clear_name(); }, "1 to 64 characters out of [a-z0-9_-]"},
    {"name = \"Small\":", [](v1::Scene& s) { s.set_name("Small"); }},
    {"name = \"aaaa", [](v1::Scene& s) { s.set_name(std::string(65, 'a')); }},
    {"description = \"two?lines\":", [](v1::Scene& s) { s.set_description("two\nlines"); }, "one line"},
    {"cloths[0].attachments[0].name = \"Rod\":", [](v1::Scene& s) { attachment(s, "Rod"); }},
    {"cloths[0].attachments[0]: has no node", [](v1::Scene& s) { attachment(s, "rod").clear_vertices(); }},
    {"cloths[0].attachments[0].vertices[0] = 99:", [](v1::Scene& s) { attachment(s, "rod").set_vertices(0, 99); }},
    {"cloths[0].attachments[0].ranges[0].lastColumn = 9:",
     [](v1::Scene& s) { attachment(s, "rod").add_ranges()->set_last_column(9); }},
    {"cloths[0].attachments[0].regions[0]: has no shape", [](v1::Scene& s) { attachment(s, "rod").add_regions(); }},
    {"cloths[0].attachments[1]: has node 12, which is pinned or attached already",
     [](v1::Scene& s) {
       attachment(s, "rod");
       attachment(s, "knot").set_vertices(0, s.cloths(0).attachments(0).vertices(0));
       s.mutable_cloths(0)->mutable_attachments(0)->set_vertices(0, 12);
       s.mutable_cloths(0)->mutable_attachments(1)->set_vertices(0, 12);
     },
     "attached already"},
    {"cloths[0].attachments[1].name = \"rod\": is used twice",
     [](v1::Scene& s) {
       attachment(s, "rod");
       attachment(s, "rod");
     },
     "unique"},
    {"cloths[0].attachments[0].collider = \"nobody\":", [](v1::Scene& s) { attachment(s, "rod").set_collider("nobody"); }},
    {"cloths[0].attachments[0].collider = ",
     [](v1::Scene& s) {
       attachment(s, "rod").set_collider(s.colliders(0).name());
       s.mutable_cloths(0)->mutable_attachments(0)->mutable_pose();
     },
     "one or the other"},
    {"cloths[0].attachments[0].motion.keys: has 1 elements",
     [](v1::Scene& s) { attachment(s, "rod").mutable_motion()->add_keys(); }},
    {"cloths: have pins, attachments and skins that select nodes in 83886080 steps",
     [](v1::Scene& s) {
       grid(s).set_rows(8192);
       grid(s).set_columns(1024);
       grid(s).set_height(1000);
       grid(s).set_width(1000);
       for (int i = 0; i < 10; ++i) {
         v1::GridRange& all = *cloth(s).add_pins();
         all.set_last_row(8191);
         all.set_last_column(1023);
       }
     },
     "must have at most 67108864"},
    {"cloths: have 67108864 nodes in all",
     [](v1::Scene& s) {
       grid(s).set_rows(8192);
       grid(s).set_columns(8192);
       grid(s).set_height(1000);
       grid(s).set_width(1000);
       attachment(s, "rod").add_regions()->set_radius(1);
     },
     "must have at most 16777216"},
    {"cloths[0].tethers.slack = 2:", [](v1::Scene& s) { cloth(s).mutable_tethers()->set_slack(2); }},
    {"cloths[0].coarse.cells = 1:", [](v1::Scene& s) { cloth(s).mutable_coarse()->set_cells(1); }, "from 2 to 16"},
    {"cloths[0].coarse.cells = 17:", [](v1::Scene& s) { cloth(s).mutable_coarse()->set_cells(17); }},
    {"cloths[0].coarse.sweeps = 0:", [](v1::Scene& s) { cloth(s).mutable_coarse()->set_sweeps(0); }, "from 1 to 16"},
    {"cloths[0].coarse.every = 65:", [](v1::Scene& s) { cloth(s).mutable_coarse()->set_every(65); }, "from 1 to 64"},
    {"cloths[0].coarse.levels = 3:", [](v1::Scene& s) { cloth(s).mutable_coarse()->set_levels(3); }, "from 1 to 2"},
    {"cloths[0].coarse:", [](v1::Scene& s) { cloth(s).mutable_coarse(); }, "with a damping of at least"},
    {"cloths[0].coarse:",
     [](v1::Scene& s) {
       cloth(s).mutable_coarse();
       s.set_integrator(v1::INTEGRATOR_RUNGE_KUTTA_4);
     },
     "INTEGRATOR_SEMI_IMPLICIT_EULER"},
    {"simulationRate = 0:", [](v1::Scene& s) { s.set_simulation_rate(0); }, "from 1 to 1000"},
    {"simulationRate = 1001:", [](v1::Scene& s) { s.set_simulation_rate(1001); }},
    {"streamRate = 50:", [](v1::Scene& s) { s.set_stream_rate(50); },
     "must divide simulationRate, which is 72"},
    {"streamRate = 0:", [](v1::Scene& s) { s.set_stream_rate(0); }},
    {"streamRate = 144:", [](v1::Scene& s) { s.set_stream_rate(144); }},
    {"substeps = 0:", [](v1::Scene& s) { s.set_substeps(0); }, "from 1 to 256"},
    {"substeps = 257:", [](v1::Scene& s) { s.set_substeps(257); }},
    {"integrator = 7:", [](v1::Scene& s) { s.set_integrator(static_cast<v1::Integrator>(7)); },
     "INTEGRATOR_EXPLICIT_EULER"},
    {"environment.gravity.y = nan:",
     [](v1::Scene& s) { s.mutable_environment()->mutable_gravity()->set_y(kNan); },
     "a finite number from -1000 to 1000"},
    {"environment.wind.x = 101:", [](v1::Scene& s) { s.mutable_environment()->mutable_wind()->set_x(101); }},
    {"environment.gust.strength = 101:",
     [](v1::Scene& s) { s.mutable_environment()->mutable_gust()->set_strength(101); }, "from 0 to 100"},
    {"environment.gust.seconds = 0:",
     [](v1::Scene& s) { s.mutable_environment()->mutable_gust()->set_seconds(0); }, "from 0.01 to 3600"},
    {"cloths[0].material = \"velvet\":", [](v1::Scene& s) { cloth(s).set_material("velvet"); },
     "must be one of cotton, denim, flag_nylon, leather, paper, rubber, silk, wool"},
    {"cloths[0].arealMass = 0:", [](v1::Scene& s) { cloth(s).set_areal_mass(0); }, "from 0.0001 to 1000"},
    {"cloths[0].arealMass = 1000:",
     [](v1::Scene& s) {
       cloth(s).mutable_grid()->set_width(1000);
       cloth(s).mutable_grid()->set_height(1000);
       cloth(s).clear_mass();
       cloth(s).set_areal_mass(1000);
     },
     "a mass of 1e+09 kg, which must be from 1e-06 to 1e+06"},
    {"cloths[0].arealMass = 1:",
     [](v1::Scene& s) {
       cloth(s).set_mass(1);
       cloth(s).set_areal_mass(1);
     },
     "must be absent if \"mass\" is given"},
    {"environment.airDensity = -1:", [](v1::Scene& s) { s.mutable_environment()->set_air_density(-1); }},
    {"cloths: has 0 elements", [](v1::Scene& s) { s.clear_cloths(); }, "must have 1 to 256"},
    {"cloths: has 257 elements",
     [](v1::Scene& s) {
       while (s.cloths_size() < 257) s.add_cloths();
     }},
    {"cloths[0].name = \"a b\":", [](v1::Scene& s) { cloth(s).set_name("a b"); }},
    {"cloths[1].name = \"sheet\":", [](v1::Scene& s) { *s.add_cloths() = s.cloths(0); }, "must be unique"},
    {"cloths[0]: has no shape", [](v1::Scene& s) { cloth(s).clear_grid(); }, "must have \"grid\""},
    {"cloths[0].selfCollision.radius = 0.6:",
     [](v1::Scene& s) { cloth(s).mutable_self_collision()->set_radius(0.6f); },
     "a finite number from 5e-05 to 0.5"},
    {"cloths[0].selfCollision.radius = 0:",
     [](v1::Scene& s) { cloth(s).mutable_self_collision()->set_radius(0); }},
    {"cloths[0].selfCollision.friction = -1:",
     [](v1::Scene& s) { cloth(s).mutable_self_collision()->set_friction(-1); }},
    {"cloths[0].selfCollision.nothingPasses = true:",
     [](v1::Scene& s) {
       cloth(s).mutable_self_collision()->set_nothing_passes(true);
       grid(s).set_rows(257);
       grid(s).set_columns(257);
     },
     "at most 65536 nodes"},
    {"cloths[0].selfCollision.nothingPasses = true:",
     [](v1::Scene& s) {
       cloth(s).mutable_self_collision()->set_nothing_passes(true);
       cloth(s).mutable_coarse();
     },
     "without \"coarse\""},
    {"cloths[0].selfCollision:",
     [](v1::Scene& s) {
       cloth(s).mutable_self_collision();
       grid(s).set_rows(725);
       grid(s).set_columns(725);
     },
     "is for scenes of at most 524288 nodes; this one has 525625"},
    {"cloths[0].grid.rows = 1:", [](v1::Scene& s) { grid(s).set_rows(1); }, "from 2 to 8192"},
    {"cloths[0].grid.columns = 8193:", [](v1::Scene& s) { grid(s).set_columns(8193); }},
    {"cloths[0].grid.width = 0:", [](v1::Scene& s) { grid(s).set_width(0); }, "from 0.001 to 1000"},
    {"cloths[0].grid.height = inf:", [](v1::Scene& s) { grid(s).set_height(kInfinity); }},
    {"cloths[0].grid.width = 0.002:",
     [](v1::Scene& s) {
       grid(s).set_columns(101);
       grid(s).set_width(0.002f);
     },
     "at least 0.01 with 101 columns"},
    {"cloths[0].grid.pose.position.z = 1001:",
     [](v1::Scene& s) { grid(s).mutable_pose()->mutable_position()->set_z(1001); }},
    {"cloths[0].grid.pose.orientation = (0, 0, 0, 0.5):",
     [](v1::Scene& s) { grid(s).mutable_pose()->mutable_orientation()->set_w(0.5f); }, "a unit quaternion"},
    {"cloths[0].grid.pose.orientation = (nan, 0, 0, 0):",
     [](v1::Scene& s) { grid(s).mutable_pose()->mutable_orientation()->set_x(kNan); }},
    {"cloths[0].mass = 0:", [](v1::Scene& s) { cloth(s).set_mass(0); }, "from 1e-06 to 1e+06"},
    {"cloths[0].structural.stiffness = -3:",
     [](v1::Scene& s) { cloth(s).mutable_structural()->set_stiffness(-3); },
     "must be a finite number from 0 to 1e+06"},
    {"cloths[0].shear.damping = inf:",
     [](v1::Scene& s) { cloth(s).mutable_shear()->set_damping(kInfinity); }},
    {"cloths[0].bend.stiffness = nan:", [](v1::Scene& s) { cloth(s).mutable_bend()->set_stiffness(kNan); }},
    {"cloths[0].damping = 1001:", [](v1::Scene& s) { cloth(s).set_damping(1001); }},
    {"cloths[0].drag = 11:", [](v1::Scene& s) { cloth(s).set_drag(11); }},
    {"cloths[0].lift = -0.5:", [](v1::Scene& s) { cloth(s).set_lift(-0.5f); }},
    {"cloths[0].friction = 10.5:", [](v1::Scene& s) { cloth(s).set_friction(10.5f); }, "from 0 to 10"},
    {"cloths[0].thickness = 2:", [](v1::Scene& s) { cloth(s).set_thickness(2); }},
    {"cloths[0].pins[0].firstRow = 4:", [](v1::Scene& s) { cloth(s).add_pins()->set_first_row(4); },
     "from 0 to 3"},
    {"cloths[0].pins[1].lastColumn = 5:",
     [](v1::Scene& s) {
       cloth(s).add_pins();
       cloth(s).add_pins()->set_last_column(5);
     },
     "from 0 to 4"},
    {"cloths[0].pins[0].lastRow = 1:",
     [](v1::Scene& s) {
       cloth(s).add_pins()->set_first_row(2);
       cloth(s).mutable_pins(0)->set_last_row(1);
     },
     "from 2 to 3"},
    {"cloths[0].pins[0].rowStep = 0:", [](v1::Scene& s) { cloth(s).add_pins()->set_row_step(0); }},
    {"cloths[0].pins[0].columnStep = 0:", [](v1::Scene& s) { cloth(s).add_pins()->set_column_step(0); }},
    {"cloths[0].pins: has 4097 elements",
     [](v1::Scene& s) {
       for (int i = 0; i < 4097; ++i) cloth(s).add_pins();
     }},
    {"cloths: have 16842752 nodes",  // 257 rows of 8192 in each of 8 cloths
     [](v1::Scene& s) {
       grid(s).set_rows(257);
       grid(s).set_columns(8192);
       for (int i = 1; i < 8; ++i) {
         *s.add_cloths() = s.cloths(0);
         s.mutable_cloths(i)->set_name("sheet" + std::to_string(i));
       }
     },
     "at most 16777216"},
    {"colliders: has 65 elements",
     [](v1::Scene& s) {
       while (s.colliders_size() < 65) s.add_colliders();
     }},
    {"colliders[0].name = \"\":", [](v1::Scene& s) { collider(s).clear_name(); }},
    {"colliders[1].name = \"ball\":", [](v1::Scene& s) { *s.add_colliders() = s.colliders(0); },
     "must be unique"},
    {"colliders[0]: has no shape", [](v1::Scene& s) { collider(s).clear_sphere(); }, "must have \"sphere\""},
    {"colliders[0].capsule.radius = 0:", [](v1::Scene& s) { collider(s).mutable_capsule(); }},
    {"colliders[0].capsule.length = -1:",
     [](v1::Scene& s) {
       collider(s).mutable_capsule()->set_radius(1);
       collider(s).mutable_capsule()->set_length(-1);
     }},
    {"colliders[0].capsule.topRadius = 1.5:",
     [](v1::Scene& s) {
       collider(s).mutable_capsule()->set_radius(1);
       collider(s).mutable_capsule()->set_length(0.5f);
       collider(s).mutable_capsule()->set_top_radius(1.5f);
     },
     "use a sphere"},
    {"colliders[0].box.size.x = 0:", [](v1::Scene& s) { collider(s).mutable_box(); }},
    {"colliders[0].hull.vertices: has 0 elements", [](v1::Scene& s) { collider(s).mutable_hull(); },
     "must have 4 to 128"},
    {"colliders[0].hull.vertices: has 129 elements",
     [](v1::Scene& s) {
       s = sceneWithHull();
       while (hull(s).vertices_size() < 129) hull(s).add_vertices();
     }},
    {"colliders[0].hull.faces: has 3 elements",
     [](v1::Scene& s) {
       s = sceneWithHull();
       hull(s).mutable_faces()->RemoveLast();
     }},
    {"colliders[0].hull.vertices[2].y = nan:",
     [](v1::Scene& s) {
       s = sceneWithHull();
       hull(s).mutable_vertices(2)->set_y(kNan);
     }},
    {"colliders[0].hull.faces[1].vertices: has 0 elements",
     [](v1::Scene& s) {
       s = sceneWithHull();
       hull(s).mutable_faces(1)->clear_vertices();
     },
     "must have 3 to 128"},
    {"colliders[0].hull.faces[3]: names vertex 7",
     [](v1::Scene& s) {
       s = sceneWithHull();
       hull(s).mutable_faces(3)->set_vertices(1, 7);
     },
     "there are 4"},
    {"colliders[0].hull.faces[0]: has vertex 3 in front of it",
     [](v1::Scene& s) {
       s = sceneWithHull();
       hull(s).mutable_vertices(3)->set_z(-1);
     },
     "must be convex"},
    {"colliders[0].sphere.radius = 0:", [](v1::Scene& s) { collider(s).mutable_sphere()->set_radius(0); }},
    {"colliders[0].pose.position.x = -inf:",
     [](v1::Scene& s) { collider(s).mutable_pose()->mutable_position()->set_x(-kInfinity); }},
    {"colliders[0].friction = -1:", [](v1::Scene& s) { collider(s).set_friction(-1); }},
    {"colliders[0].motion.keys: has 1 elements", [](v1::Scene& s) { addKey(s, 0); }, "must have 2 to"},
    {"colliders[0].motion.keys[0].time = 1:",
     [](v1::Scene& s) {
       addKey(s, 1);
       addKey(s, 2);
     },
     "must be 0"},
    {"colliders[0].motion.keys[2].time = 3:",
     [](v1::Scene& s) {
       for (const float time : {0.f, 3.f, 3.f}) addKey(s, time);
     },
     "greater than the time of the key before, 3"},
    {"colliders[0].motion.keys[1].time = nan:",
     [](v1::Scene& s) {
       addKey(s, 0);
       addKey(s, kNan);
     }},
    {"colliders[0].motion.keys[0].position.y = 2000:",
     [](v1::Scene& s) {
       addKey(s, 0);
       addKey(s, 1);
       collider(s).mutable_motion()->mutable_keys(0)->mutable_position()->set_y(2000);
     }},
    {"stream.qualities = 0:", [](v1::Scene& s) { s.mutable_stream()->set_qualities(0); }, "from 1 to 4"},
    {"stream.maxError = 1:", [](v1::Scene& s) { s.mutable_stream()->set_max_error(1); }, "from 1e-05 to 0.1"},
    {"cloths[0].solver.constraint.iterations = 0:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_constraint()->set_iterations(0); },
     "from 1 to 10000"},
    {"cloths[0].solver.constraint.tolerance = 2:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_constraint()->set_tolerance(2); }, "from 0 to 1"},
    {"cloths[0].solver.constraint.compliance = -1:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_constraint()->set_compliance(-1); },
     "from 0 to 1"},
    {"cloths[0].solver.acad.activation = 11:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_acad()->set_activation(11); }, "from 0 to 10"},
    {"cloths[0].solver.acad.constraint.iterations = 0:",
     [](v1::Scene& s) {
       cloth(s).mutable_solver()->mutable_acad()->mutable_constraint()->set_iterations(0);
     }},
    {"cloths[0].solver.acad.mode = 9:",
     [](v1::Scene& s) {
       cloth(s).mutable_solver()->mutable_acad()->set_mode(static_cast<v1::AcadMode>(9));
     },
     "ACAD_MODE_PAPER"},
    {"cloths[0].solver.xpbd.iterations = 0:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_xpbd()->set_iterations(0); }, "from 1 to 1000"},
    {"cloths[0].solver.xpbd.iterations = 1001:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_xpbd()->set_iterations(1001); }, "from 1 to 1000"},
    {"cloths[0].solver.xpbd.compliance = nan:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_xpbd()->set_compliance(kNan); }},
    {"cloths[0].solver: solves a system, which",
     [](v1::Scene& s) {
       cloth(s).mutable_solver()->mutable_xpbd();
       s.set_integrator(v1::INTEGRATOR_EXPLICIT_EULER);
     },
     "INTEGRATOR_SEMI_IMPLICIT_EULER"},
    {"cloths[0].solver.implicitEuler.iterations = 0:",
     [](v1::Scene& s) { cloth(s).mutable_solver()->mutable_implicit_euler()->set_iterations(0); },
     "from 1 to 10000"},
    {"cloths[0].solver: solves a system,",
     [](v1::Scene& s) {
       cloth(s).mutable_solver()->mutable_implicit_euler();
       s.set_integrator(v1::INTEGRATOR_EXPLICIT_EULER);
     },
     "INTEGRATOR_SEMI_IMPLICIT_EULER"},
    {"cloths[0].solver: solves a system,",
     [](v1::Scene& s) {
       cloth(s).mutable_solver()->mutable_constraint();
       s.set_integrator(v1::INTEGRATOR_EXPLICIT_EULER);
     },
     "INTEGRATOR_SEMI_IMPLICIT_EULER"},
    {"cloths[0].solver: assembles its system (CONSTRAINT_PATH_ASSEMBLED), for cloths of at most 65536 nodes in all; "
     "here they have 65792",
     [](v1::Scene& s) {
       grid(s).set_rows(257);
       grid(s).set_columns(256);
       cloth(s).mutable_solver()->mutable_constraint()->set_path(v1::CONSTRAINT_PATH_ASSEMBLED);
     },
     "65536"},
    {"stream.normals = 9:",
     [](v1::Scene& s) { s.mutable_stream()->set_normals(static_cast<v1::Normals>(9)); }},
    // 4 springs of 4000 N/m at nodes of 0.03 kg: h < 2 / sqrt(2 * 4 * 4000 / 0.03) s = 1 / 516.4, 7.2 a tick.
    {"substeps = 2: this scene needs at least 8",
     [](v1::Scene& s) {
       cloth(s).mutable_structural()->set_stiffness(4000);
       s.set_substeps(2);
     },
     "because of the springs of \"sheet\", whose mass is 0.6 kg; 2 would do with a mass of at least"},
    {"cloths[0]: has a node 601 m from (128, 0, 0), the middle of the scene, along an axis",
     [](v1::Scene& s) {
       *s.add_cloths() = s.cloths(0);
       s.mutable_cloths(1)->set_name("far");
       grid(s).mutable_pose()->mutable_position()->set_x(-472);
       s.mutable_cloths(1)->mutable_grid()->mutable_pose()->mutable_position()->set_x(728);
     },
     "must be within 514.2 m, which is what a stream with a maxError of 0.0005 m holds: place the cloths nearer "
     "to one another, or set stream.maxError to 0.000585 or more"},
    {"substeps = 10: no number up to 256",
     [](v1::Scene& s) {
       cloth(s).mutable_bend()->set_stiffness(1e6f);
       cloth(s).set_mass(0.001f);
     },
     "because of the springs of \"sheet\", whose mass is 0.001 kg; 10 would do with a mass of at least"},
    {"substeps = 10: no number up to 256",
     [](v1::Scene& s) { s.set_integrator(v1::INTEGRATOR_EXPLICIT_EULER); }, "INTEGRATOR_SEMI_IMPLICIT_EULER"},
};

// The parts of an error of instability(): forces, cloth and values.
TEST(Instability, NamesTheForcesThatBoundTheStepAndValuesThatFit) {
  const auto errorOf = [](const std::function<void(v1::Scene&)>& spoil) {
    v1::Scene message = smallScene();
    *message.add_cloths() = message.cloths(0);
    message.mutable_cloths(1)->set_name("light");
    spoil(message);
    const auto scene = toScene(message);
    return scene ? std::string("no error") : scene.error().text;
  };
  const auto light = [](v1::Scene& s) -> v1::Cloth& { return *s.mutable_cloths(1); };
  ASSERT_EQ(errorOf([](v1::Scene&) {}), "no error");
  const auto air = [&](v1::Scene& s) {
    light(s).set_mass(0.01f);
    light(s).mutable_structural()->set_stiffness(0.01f);
    light(s).set_drag(2);
    light(s).set_lift(1);
  };
  EXPECT_THAT(
      errorOf(air),
      testing::MatchesRegex(
          "substeps = 10: this scene needs at least [0-9]+, because of the drag and lift of "
          "\"light\", whose mass is 0.01 kg; 10 would do with a mass of at least [0-9.]+ "
          "kg [(][0-9.]+ kg/m.2[)], or with a drag of at most [0-9.]+ and a lift of at most [0-9.]+"));
  EXPECT_THAT(errorOf([&](v1::Scene& s) {
                light(s).set_damping(1000);
                s.set_substeps(2);
              }),
              HasSubstr("because of the damping of \"light\""));
  EXPECT_THAT(errorOf([&](v1::Scene& s) {
                light(s).set_mass(1e-4f);
                light(s).mutable_structural()->set_stiffness(0);
                light(s).set_dihedral_bending(1);
              }),
              HasSubstr("because of the dihedralBending of \"light\""));
  EXPECT_THAT(errorOf([&](v1::Scene& s) {
                light(s).set_mass(0.2f);
                light(s).set_drag(2);
                s.mutable_environment()->mutable_wind()->set_x(100);
              }),
              HasSubstr("because of the wind on \"light\""));
  EXPECT_THAT(errorOf([&](v1::Scene& s) {
                light(s).set_mass(0.2f);
                light(s).set_drag(2);
                v1::LocalWind& fan = *s.mutable_environment()->add_winds();
                fan.set_name("fan");
                fan.set_speed(100);
                fan.mutable_fan();
              }),
              testing::ContainsRegex("the wind on \"light\".*local winds of at most [0-9.]+ m/s in all"));
  EXPECT_THAT(errorOf([&](v1::Scene& s) { s.mutable_cloths(0)->mutable_shear()->set_damping(1000); }),
              HasSubstr("because of the springs of \"sheet\""));
}

// Takes the values out of the error and gives them to the scene.
TEST(Instability, NamesValuesThatAreEnough) {
  v1::Scene message = smallScene();
  v1::Cloth& cloth = *message.mutable_cloths(0);
  cloth.set_mass(0.01f);
  cloth.mutable_structural()->set_stiffness(0.01f);
  cloth.set_drag(2);
  const std::string error = toScene(message).error().text;
  const auto numberAfter = [&](const std::string& text) {
    const std::size_t at = error.find(text);
    EXPECT_NE(at, error.npos) << error;
    return at == error.npos ? 0.0f : std::stof(error.substr(at + text.size()));
  };
  const auto accepts = [&](const std::function<void(v1::Scene&)>& change) {
    v1::Scene changed = message;
    change(changed);
    return toScene(changed).has_value();
  };
  const float mass = numberAfter("a mass of at least "), drag = numberAfter("a drag of at most "),
              substeps = numberAfter("needs at least ");
  EXPECT_TRUE(accepts([&](v1::Scene& s) { s.mutable_cloths(0)->set_mass(mass); }));
  EXPECT_FALSE(accepts([&](v1::Scene& s) { s.mutable_cloths(0)->set_mass(0.95f * mass); }));
  EXPECT_TRUE(accepts([&](v1::Scene& s) { s.mutable_cloths(0)->set_drag(drag); }));
  EXPECT_FALSE(accepts([&](v1::Scene& s) { s.mutable_cloths(0)->set_drag(1.05f * drag); }));
  EXPECT_TRUE(accepts([&](v1::Scene& s) { s.set_substeps(static_cast<std::uint32_t>(substeps)); }));
}

// Letters and digits of the error. CTest cannot handle brackets and quotes in names.
std::string nameOf(const BadScene& bad) {
  std::string name;
  for (const char c : std::string_view(bad.error))
    if (std::isalnum(static_cast<unsigned char>(c))) name += c;
  return name;
}

void PrintTo(const BadScene& bad, std::ostream* out) {
  *out << nameOf(bad);
}

class ToSceneRefuses : public testing::TestWithParam<BadScene> {};

TEST_P(ToSceneRefuses, WithPathValueAndAllowedRange) {
  v1::Scene message = smallScene();
  ASSERT_TRUE(toScene(message));
  GetParam().spoil(message);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(scene.error().text, StartsWith(GetParam().error));
  EXPECT_THAT(scene.error().text, HasSubstr(GetParam().allowed));
}

INSTANTIATE_TEST_SUITE_P(All, ToSceneRefuses, testing::ValuesIn(kBadScenes),
                         [](const auto& bad) { return nameOf(bad.param) + "_" + std::to_string(bad.index); });

TEST(ToScene, AcceptsTheMaximumErrorThatItRequested) {
  v1::Scene message = smallScene();
  *message.add_cloths() = message.cloths(0);
  message.mutable_cloths(1)->set_name("far");
  grid(message).mutable_pose()->mutable_position()->set_x(-472);
  message.mutable_cloths(1)->mutable_grid()->mutable_pose()->mutable_position()->set_x(728);
  ASSERT_FALSE(toScene(message));
  message.mutable_stream()->set_max_error(0.000585f);
  const Result<model::Scene> scene = toScene(message);
  EXPECT_TRUE(scene) << scene.error().text;
}

TEST(ToScene, AcceptsTheSubstepsThatItRequested) {
  v1::Scene message = smallScene();
  cloth(message).mutable_structural()->set_stiffness(4000);
  message.set_substeps(8);
  EXPECT_TRUE(toScene(message));
}

TEST(ToScene, KeepsErrorsShortWhateverTheInput) {
  v1::Scene message = smallScene();
  message.set_name(std::string(1'000'000, 'x'));
  EXPECT_LT(toScene(message).error().text.size(), 300u);
}

TEST(ToScene, RefusesMoreSpringsOrAttachmentsThanTheLimits) {
  v1::Scene message = smallScene();
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene);
  std::uint64_t springs = 0;
  for (const model::Cloth& cloth : scene->cloths) {
    EXPECT_EQ(model::springCount(cloth), model::springLinks(cloth).size());
    springs += model::springCount(cloth);
  }
  EXPECT_TRUE(toScene(message, {}, {.springs = springs}));
  const Result<model::Scene> tooMany = toScene(message, {}, {.springs = springs - 1});
  ASSERT_FALSE(tooMany);
  EXPECT_THAT(tooMany.error().text,
              HasSubstr("springs in all; must have at most " + std::to_string(springs - 1)));
  EXPECT_EQ(tooMany.error().limit, telemetry::Refusal::sceneSize);
  for (const char* name : {"one", "two"}) message.mutable_cloths(0)->add_attachments()->set_name(name);
  const Result<model::Scene> attached = toScene(message, {}, {.attachments = 1});
  ASSERT_FALSE(attached);
  EXPECT_EQ(attached.error().text, "cloths: have 2 attachments in all; must have at most 1");
  EXPECT_EQ(attached.error().limit, telemetry::Refusal::sceneSize);
}

}  // namespace
}  // namespace clothstream::messages

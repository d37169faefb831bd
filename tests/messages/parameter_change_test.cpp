// SPDX-License-Identifier: MIT
// Parameter changes of clients.
#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/client_message.h"
#include "server/messages/scene_message.h"
#include "server/messages/solver_message.h"
#include "server/model/coarse_level.h"
#include "server/model/material.h"
#include "server/model/mesh.h"
#include "tests/messages/scenes.h"
#include "tests/model/meshes.h"

namespace clothstream::messages {
namespace {

using testing::StartsWith;

class ToParameterChange : public testing::Test {
 protected:
  std::string error() const {
    const auto change = toParameterChange(message_, scene_, model::StabilityBound(scene_));
    return change ? "no error" : change.error().text;
  }

  model::Scene scene_ = *toScene(smallScene());
  v1::ParameterChange message_;
};

TEST_F(ToParameterChange, RefusesSizesThatTheShapeDoesNotHave) {
  v1::ColliderChange& change = *message_.add_colliders();
  change.set_name("ball");
  change.set_length(0.2f);
  EXPECT_EQ(error(), "parameterChange.colliders[0].length = 0.2: must be absent: \"ball\" is no capsule");
  change.clear_length();
  change.mutable_size()->set_x(1);
  change.mutable_size()->set_y(1);
  change.mutable_size()->set_z(1);
  EXPECT_EQ(error(), "parameterChange.colliders[0].size: must be absent: \"ball\" is no box");
  change.clear_size();
  change.set_friction(11);
  EXPECT_EQ(error(), "parameterChange.colliders[0].friction = 11: must be a finite number from 0 to 10");
}

TEST_F(ToParameterChange, AcceptsSizesOfTheShape) {
  scene_.colliders[0].shape = model::Box{};
  v1::ColliderChange& change = *message_.add_colliders();
  change.set_name("ball");
  change.mutable_size()->set_x(1);
  change.mutable_size()->set_y(2);
  change.mutable_size()->set_z(3);
  change.set_friction(2);
  model::applyChange(scene_, toParameterChange(message_, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(std::get<model::Box>(scene_.colliders[0].shape).size, model::Vec3(1, 2, 3));
  EXPECT_EQ(scene_.colliders[0].friction, 2);
  scene_.colliders[0].shape = model::Capsule{};
  change.clear_size();
  change.set_length(0.7f);
  change.set_radius(0.2f);
  model::applyChange(scene_, toParameterChange(message_, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(std::get<model::Capsule>(scene_.colliders[0].shape).length, 0.7f);
  EXPECT_EQ(std::get<model::Capsule>(scene_.colliders[0].shape).radius, 0.2f);
  std::get<model::Capsule>(scene_.colliders[0].shape).topRadius = 1;
  EXPECT_THAT(error(), StartsWith("parameterChange.colliders[0].topRadius = 1: must differ from \"radius\""));
}

TEST_F(ToParameterChange, ChangesSelfCollisionAndTethersOfClothsThatHaveThem) {
  v1::ClothChange& change = *message_.add_cloths();
  change.mutable_self_collision()->set_friction(1);
  EXPECT_EQ(error(), "parameterChange.cloths[0].selfCollision: must be absent: \"" + scene_.cloths[0].name +
                         "\" has none from its start");
  change.clear_self_collision();
  change.mutable_tethers()->set_slack(0.5f);
  EXPECT_EQ(error(), "parameterChange.cloths[0].tethers: must be absent: \"" + scene_.cloths[0].name +
                         "\" has none from its start");
  scene_.cloths[0].tethers.emplace();
  scene_.cloths[0].selfCollision = model::SelfCollision{.radius = 0.01f};
  change.mutable_self_collision()->set_friction(1);
  change.mutable_self_collision()->set_radius(10);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].selfCollision.radius = 10: must be"));
  change.mutable_self_collision()->clear_radius();
  change.mutable_self_collision()->set_nothing_passes(true);
  EXPECT_EQ(error(),
            "parameterChange.cloths[0].selfCollision.nothingPasses = true: must be absent: it cannot change "
            "while the scene runs");
  change.mutable_self_collision()->set_nothing_passes(false);
  model::applyChange(scene_, toParameterChange(message_, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(scene_.cloths[0].selfCollision->radius, 0.01f);
  EXPECT_EQ(scene_.cloths[0].selfCollision->friction, 1);
  EXPECT_EQ(scene_.cloths[0].tethers->slack, 0.5f);
}

TEST_F(ToParameterChange, RefusesToTakeTheDampingThatACoarseCorrectionNeeds) {
  model::Cloth& cloth = scene_.cloths[0];
  cloth.coarse.emplace();
  const float least = model::leastCoarseDamping(cloth, scene_.substepSeconds());
  cloth.structural.damping = 1.1f * least;
  v1::ClothChange& change = *message_.add_cloths();
  change.mutable_structural()->set_damping(0.9f * least);
  EXPECT_THAT(error(), StartsWith("parameterChange: the coarse correction of \"" + cloth.name +
                                  "\" needs structural springs with a damping of at least"));
  change.mutable_structural()->set_damping(1.01f * least);
  EXPECT_EQ(error(), "no error");
  change.set_areal_mass(static_cast<float>(2 * double{cloth.mass} / model::areaOf(cloth)));
  EXPECT_THAT(error(), StartsWith("parameterChange: the coarse correction of"));
}

TEST_F(ToParameterChange, RefusesDihedralBendingThatIsUnstableOrUnsupported) {
  v1::ClothChange& change = *message_.add_cloths();
  change.set_dihedral_bending(2);
  EXPECT_EQ(error(), "parameterChange.cloths[0].dihedralBending = 2: must be a finite number from 0 to 1");
  scene_.cloths[0].structural = scene_.cloths[0].shear = scene_.cloths[0].bend = {};
  scene_.cloths[0].mass = 1e-5f;
  change.set_dihedral_bending(1);
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = "));
  change.set_dihedral_bending(1e-9f);
  EXPECT_EQ(error(), "no error");
  scene_.integrator = model::Integrator::rungeKutta4;
  EXPECT_EQ(error(),
            "parameterChange.cloths[].dihedralBending: must be 0: other values need "
            "INTEGRATOR_SEMI_IMPLICIT_EULER");
}

TEST_F(ToParameterChange, RefusesPressureThatTheClothCannotHold) {
  v1::ClothChange& change = *message_.add_cloths();
  change.set_pressure(100);
  EXPECT_EQ(error(),
            "parameterChange.cloths[0].pressure = 100: must be 0: the cloth is a grid, which is open; only a "
            "closed "
            "mesh holds gas (\"sheet\")");
  change.set_pressure(0);
  EXPECT_EQ(error(), "no error");
  change.set_pressure(100);
  scene_.cloths[0].mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::cube(1)));
  EXPECT_EQ(error(), "no error");
  change.set_pressure(1'000'001);
  EXPECT_EQ(error(),
            "parameterChange.cloths[0].pressure = 1000001: must be a finite number from -50000 to 1e+06");
  change.set_pressure(-50'000);
  EXPECT_EQ(error(), "no error");
  scene_.integrator = model::Integrator::explicitEuler;
  EXPECT_THAT(error(), testing::HasSubstr("pressure = -50000: must be 0: other values need "
                                          "INTEGRATOR_SEMI_IMPLICIT_EULER (\"sheet\")"));
}

TEST_F(ToParameterChange, RefusesARadiusForShapesWithoutOne) {
  scene_ = *toScene(sceneWithHull());
  message_.add_colliders()->set_name("ball");
  message_.mutable_colliders(0)->set_radius(0.5f);
  EXPECT_THAT(error(),
              StartsWith("parameterChange.colliders[0].radius = 0.5: must be absent: \"ball\" is neither"));
}

TEST_F(ToParameterChange, CarriesEveryField) {
  message_.mutable_gravity()->mutable_value()->set_y(-1.5f);
  message_.mutable_wind()->mutable_value()->set_z(4);
  message_.set_air_density(0.5f);
  message_.mutable_gust()->set_strength(1.5f);
  message_.mutable_gust()->set_seconds(4);
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_structural()->set_stiffness(11);
  cloth.mutable_shear()->set_stiffness(12);
  cloth.mutable_bend()->set_damping(0.01f);
  cloth.set_damping(0.5f);
  cloth.set_drag(0.6f);
  cloth.set_lift(0.7f);
  cloth.set_friction(0.8f);
  cloth.set_thickness(0.02f);
  cloth.mutable_solver()->mutable_acad()->set_activation(0.25f);
  cloth.mutable_solver()->mutable_acad()->mutable_constraint()->set_iterations(7);
  v1::ColliderChange& collider = *message_.add_colliders();
  collider.set_name("ball");
  collider.mutable_position()->set_x(3);
  collider.mutable_orientation()->set_y(1);
  collider.set_radius(0.5f);
  const auto change = toParameterChange(message_, scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  EXPECT_EQ(scene_.environment.gravity, model::Vec3(0, -1.5f, 0));
  EXPECT_EQ(scene_.environment.wind, model::Vec3(0, 0, 4));
  EXPECT_EQ(scene_.environment.airDensity, 0.5f);
  EXPECT_EQ(scene_.environment.gust.strength, 1.5f);
  EXPECT_EQ(scene_.environment.gust.seconds, 4);
  EXPECT_EQ(scene_.cloths[0].structural.stiffness, 11);
  EXPECT_EQ(scene_.cloths[0].shear.stiffness, 12);
  EXPECT_EQ(scene_.cloths[0].bend.damping, 0.01f);
  EXPECT_EQ(scene_.cloths[0].damping, 0.5f);
  EXPECT_EQ(scene_.cloths[0].drag, 0.6f);
  EXPECT_EQ(scene_.cloths[0].lift, 0.7f);
  EXPECT_EQ(scene_.cloths[0].friction, 0.8f);
  EXPECT_EQ(scene_.cloths[0].thickness, 0.02f);
  EXPECT_EQ(scene_.cloths[0].solver.kind, model::SolverKind::acad);
  EXPECT_EQ(scene_.cloths[0].solver.activation, 0.25f);
  EXPECT_EQ(scene_.cloths[0].solver.iterations, 7u);
  EXPECT_EQ(scene_.colliders[0].pose.position, model::Vec3(3, 0, 0));
  EXPECT_EQ(scene_.colliders[0].pose.orientation.y(), 1);
  EXPECT_EQ(std::get<model::Sphere>(scene_.colliders[0].shape).radius, 0.5f);
}

TEST_F(ToParameterChange, LeavesOutWhatIsAbsent) {
  message_.add_cloths();
  const auto change = toParameterChange(message_, scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(change) << change.error().text;
  EXPECT_EQ(change->environment, parameters::EnvironmentChange());
  EXPECT_FALSE(change->cloths[0].numbers.hasAnyOf(parameters::kStructural) ||
               change->cloths[0].numbers.has(parameters::ClothNumber::drag));
}

TEST_F(ToParameterChange, FillsWhatFieldsLeaveOut) {
  scene_.environment.gust = {.strength = 1, .seconds = 7};
  message_.mutable_gravity();
  message_.mutable_gust()->set_strength(3);
  applyChange(scene_, toParameterChange(message_, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(scene_.environment.gravity, model::Vec3(0, 0, 0));
  EXPECT_EQ(scene_.environment.gust.strength, 3);
  EXPECT_EQ(scene_.environment.gust.seconds, 2);
}

TEST_F(ToParameterChange, ListsTheNamesOfTheScene) {
  message_.add_cloths()->set_name("rug");
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].name = \"rug\": must be one of sheet"));
  EXPECT_EQ(toParameterChange(message_, scene_, model::StabilityBound(scene_)).error().code,
            v1::ERROR_CODE_NOT_FOUND);
  message_.clear_cloths();
  message_.add_colliders();
  EXPECT_THAT(error(), StartsWith("parameterChange.colliders[0].name = \"\": must be one of ball"));
}

TEST_F(ToParameterChange, RefusesValuesWithTheirPath) {
  message_.mutable_gravity()->mutable_value()->set_x(kNan);
  EXPECT_THAT(error(), StartsWith("parameterChange.gravity.value.x = nan:"));
  message_.Clear();
  message_.set_air_density(-1);
  EXPECT_THAT(error(), StartsWith("parameterChange.airDensity = -1:"));
  message_.Clear();
  message_.add_cloths()->mutable_shear()->set_stiffness(-3);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].shear.stiffness = -3:"));
  message_.Clear();
  message_.add_colliders()->set_name("ball");
  message_.mutable_colliders(0)->mutable_position()->set_y(5000);
  EXPECT_THAT(error(), StartsWith("parameterChange.colliders[0].position.y = 5000:"));
}

TEST_F(ToParameterChange, RefusesUnstableChangesAndNamesTheSubsteps) {
  message_.add_cloths()->mutable_structural()->set_stiffness(20000);
  // 4 springs of 20000 N/m at nodes of 0.03 kg: h < 2 / sqrt(2 * 4 * 20000 / 0.03) s = 1 / 1154.7, 16.04 a
  // tick.
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = 10, this scene needs at least 17"));
}

// Constraints set no bound on the step. A change back to forces meets the bound again.
TEST_F(ToParameterChange, RefusesSolversThatTheSceneCannotUse) {
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.mutable_structural()->set_stiffness(20000);
  cloth.mutable_solver()->mutable_constraint();
  const auto change = toParameterChange(message_, scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  message_.Clear();
  message_.add_cloths()->mutable_solver()->mutable_mass_spring();
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = 10, this scene needs at least 17"));

  message_.mutable_cloths(0)->mutable_solver()->mutable_constraint()->set_iterations(0);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].solver.constraint.iterations = 0:"));
  message_.mutable_cloths(0)->mutable_solver()->mutable_acad()->set_activation(-1);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].solver.acad.activation = -1:"));
  message_.mutable_cloths(0)->mutable_solver()->mutable_acad()->set_activation(0.1f);
  scene_.integrator = model::Integrator::explicitEuler;
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].solver: \"sheet\" solves a system, which needs "
                                  "INTEGRATOR_SEMI_IMPLICIT_EULER"));
  message_.mutable_cloths(0)->clear_solver();
  message_.mutable_cloths(0)->set_thickness(2);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].thickness = 2:"));
}

TEST_F(ToParameterChange, MakesClothsOfAMaterial) {
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.set_material("denim");
  cloth.set_areal_mass(0.5f);
  cloth.mutable_bend()->set_stiffness(7);
  const auto change = toParameterChange(message_, scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  EXPECT_EQ(scene_.cloths[0].material, "denim");
  EXPECT_EQ(scene_.cloths[0].structural.stiffness, model::findMaterial("denim")->tension);
  EXPECT_EQ(scene_.cloths[0].bend.stiffness, 7);
  EXPECT_FLOAT_EQ(scene_.cloths[0].mass, 1.5f);
  EXPECT_EQ(scene_.cloths[0].solver.kind, model::SolverKind::xpbd);
}

// Scenes with implicit Euler have too few substeps for xpbd.
TEST_F(ToParameterChange, KeepsImplicitEulerWithANewMaterial) {
  model::Solver& solver = scene_.cloths[0].solver;
  solver.kind = model::SolverKind::implicitEuler;
  solver.iterations = 14;
  message_.add_cloths()->set_material("denim");
  const auto change = toParameterChange(message_, scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  EXPECT_EQ(scene_.cloths[0].material, "denim");
  EXPECT_EQ(solver.kind, model::SolverKind::implicitEuler);
  EXPECT_EQ(solver.iterations, 14u);

  message_.mutable_cloths(0)->mutable_solver()->mutable_xpbd();
  const auto chosen = toParameterChange(message_, scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(chosen) << chosen.error().text;
  applyChange(scene_, *chosen);
  EXPECT_EQ(solver.kind, model::SolverKind::xpbd);
}

TEST_F(ToParameterChange, RefusesUnknownAndUnusableMaterials) {
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.set_material("velvet");
  EXPECT_THAT(error(),
              StartsWith("parameterChange.cloths[0].material = \"velvet\": must be one of cotton, denim, "));
  cloth.set_material("");
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].material = \"\": must be one of cotton, "));
  cloth.set_material("denim");
  scene_.integrator = model::Integrator::explicitEuler;
  EXPECT_THAT(error(),
              StartsWith("parameterChange.cloths[0].material: \"sheet\" solves a system, which needs"));
  scene_.integrator = model::Integrator::semiImplicitEuler;
  cloth.mutable_solver()->mutable_mass_spring();
  cloth.mutable_structural()->set_stiffness(20000);
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = 10, this scene needs at least"));
  message_.Clear();
  message_.add_cloths()->set_areal_mass(0);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].arealMass = 0:"));
  scene_.cloths[0].grid.width = scene_.cloths[0].grid.height = 1000;
  message_.mutable_cloths(0)->set_areal_mass(100);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].arealMass = 100: gives the cloth of 1e+06 m^2 a "
                                  "mass of 1e+08 kg, which must be from 1e-06 to 1e+06;"));
  message_.Clear();
  message_.mutable_gust()->set_strength(-1);
  EXPECT_THAT(error(), StartsWith("parameterChange.gust.strength = -1:"));
  message_.mutable_gust()->set_strength(1);
  message_.mutable_gust()->set_seconds(0);
  EXPECT_THAT(error(), StartsWith("parameterChange.gust.seconds = 0:"));
}

TEST_F(ToParameterChange, ChangesTheMessageWithAllParametersLikeTheScene) {
  const double areas[] = {model::areaOf(scene_.cloths[0])};
  v1::ParameterChange all = allParameters(toMessage(scene_), areas);
  message_.mutable_gravity()->mutable_value();  // zero
  message_.mutable_wind()->mutable_value()->set_z(2);
  message_.set_air_density(0);
  message_.mutable_gust()->set_strength(1);
  message_.mutable_gust()->set_seconds(3);
  v1::ClothChange& everyCloth = *message_.add_cloths();
  everyCloth.set_areal_mass(0.5f);
  model::Solver solver;
  solver.kind = model::SolverKind::xpbd;
  solver.compliance = 0;
  *everyCloth.mutable_solver() = toMessage(solver);
  v1::ClothChange& sheet = *message_.add_cloths();
  sheet.set_name("sheet");
  sheet.set_drag(0.25f);
  applyChange(message_, all);
  model::applyChange(scene_, toParameterChange(message_, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(all.DebugString(), allParameters(toMessage(scene_), areas).DebugString());

  message_.Clear();
  message_.add_cloths()->set_name("unknown");
  message_.add_colliders()->set_name("ball");
  const std::string before = all.DebugString();
  applyChange(message_, all);
  EXPECT_EQ(all.DebugString(), before);
}

// Cloths of several shapes, materials and solvers.
model::Scene sceneOfManyCloths(int cloths) {
  v1::Scene scene = smallScene();
  constexpr const char* kMaterials[] = {"cotton", "silk", "wool"};
  for (int i = 1; i < cloths; ++i) {
    v1::Cloth& cloth = *scene.add_cloths();
    cloth = scene.cloths(0);
    cloth.set_name("sheet-" + std::to_string(i));
    cloth.mutable_grid()->set_width(2.0f + static_cast<float>(i % 3));
    cloth.set_material(kMaterials[i % 3]);
    cloth.set_drag(0.1f * static_cast<float>(i));
    if (i % 4 == 0) cloth.mutable_solver()->mutable_implicit_euler()->set_iterations(5 + i);
  }
  Result<model::Scene> converted = toScene(scene);
  if (!converted) throw std::runtime_error(converted.error().text);
  return std::move(*converted);
}

v1::ParameterChange allParametersOf(const model::Scene& scene) {
  std::vector<double> areas;
  for (const model::Cloth& cloth : scene.cloths) areas.push_back(model::areaOf(cloth));
  return allParameters(toMessage(scene), areas);
}

// Clients apply announcements to what they know.
TEST_F(ToParameterChange, AnnouncedMaterialsLeadClientsToTheParametersOfTheScene) {
  const auto announced = [&](const model::Scene& before) {
    model::Scene after = before;
    const auto change = toParameterChange(message_, before, model::StabilityBound(before));
    ASSERT_TRUE(change) << change.error().text;
    model::applyChange(after, *change);
    v1::ParameterChange all = allParametersOf(before);
    applyChange(withMaterials(message_, after), all);
    EXPECT_EQ(all.DebugString(), allParametersOf(after).DebugString()) << message_.DebugString();
  };
  const model::Scene scene = sceneOfManyCloths(9);
  for (const model::Material& material : model::materials()) {
    message_.Clear();
    message_.add_cloths()->set_material(std::string(material.name));
    announced(scene);
    message_.mutable_cloths(0)->set_name("sheet-3");
    announced(scene);
    message_.add_cloths()->set_material("silk");
    message_.mutable_cloths(1)->set_drag(0.3f);
    message_.mutable_cloths(1)->mutable_bend();
    announced(scene);
    v1::ClothChange& last = *message_.add_cloths();
    last.set_name("sheet-1");
    last.set_friction(2);
    announced(scene);
    last.set_material("wool");
    announced(scene);
    // Numbers between two materials, and after them.
    message_.add_cloths()->mutable_structural()->set_stiffness(3);
    *message_.add_cloths() = message_.cloths(1);
    message_.add_cloths()->set_lift(0.2f);
    announced(scene);
    message_.mutable_cloths(4)->set_name("sheet-2");
    announced(scene);
  }
}

TEST_F(ToParameterChange, AnnouncementsGiveTheNumbersOfEachClothOnce) {
  model::Scene scene = sceneOfManyCloths(9);
  for (int i = 0; i < 16; ++i) {
    message_.add_cloths()->set_material(i % 2 == 0 ? "denim" : "silk");
    message_.add_cloths()->set_name("sheet-" + std::to_string(i % 8 + 1));
    message_.mutable_cloths(2 * i + 1)->set_material("wool");
  }
  model::applyChange(scene, *toParameterChange(message_, scene, model::StabilityBound(scene)));
  const v1::ParameterChange announced = withMaterials(message_, scene);
  const auto withNumbers =
      std::ranges::count_if(announced.cloths(), [](const v1::ClothChange& each) { return each.has_drag(); });
  EXPECT_LE(withNumbers, 9 + 1);
}

// Clients refuse longer lists of cloths.
TEST_F(ToParameterChange, AnnouncementsHaveAtMostAsManyElementsAsAScene) {
  model::Scene before = *toScene(smallScene());
  const model::Cloth cloth = before.cloths[0];
  message_.add_cloths()->set_material("denim");
  for (int i = 1; i <= 200; ++i) {
    before.cloths.push_back(cloth);
    before.cloths.back().name = "sheet-" + std::to_string(i);
    v1::ClothChange& change = *message_.add_cloths();
    change.set_name(before.cloths.back().name);
    change.set_drag(0.001f * static_cast<float>(i));
  }
  model::Scene after = before;
  model::applyChange(after, *toParameterChange(message_, before, model::StabilityBound(before)));
  const v1::ParameterChange announced = withMaterials(message_, after);
  EXPECT_LE(announced.cloths_size(), 256);
  v1::ParameterChange all = allParametersOf(before);
  applyChange(announced, all);
  EXPECT_EQ(all.DebugString(), allParametersOf(after).DebugString());
}

TEST_F(ToParameterChange, RefusesElementsThatAddressTooManyCloths) {
  const model::Cloth cloth = scene_.cloths[0];
  for (int i = 1; i < 256; ++i) {
    scene_.cloths.push_back(cloth);
    scene_.cloths.back().name = "sheet-" + std::to_string(i);
  }
  for (int i = 0; i < 16; ++i) message_.add_cloths()->set_material("silk");
  EXPECT_EQ(error(), "no error");
  message_.add_cloths()->set_name("sheet-1");
  EXPECT_EQ(
      error(),
      "parameterChange.cloths: address 4097 cloths together; must be at most 4096: set every value of a "
      "cloth once");
}

TEST_F(ToParameterChange, AnnouncementsOfMaterialsDoNotGrowWithTheScene) {
  model::Scene scene = *toScene(smallScene());
  const model::Cloth cloth = scene.cloths[0];
  for (int i = 1; i < 256; ++i) {
    scene.cloths.push_back(cloth);
    scene.cloths.back().name = "sheet-" + std::to_string(i);
  }
  message_.add_cloths()->set_material("denim");
  model::Scene changed = scene;
  model::applyChange(changed, *toParameterChange(message_, scene, model::StabilityBound(scene)));
  EXPECT_LT(withMaterials(message_, changed).ByteSizeLong(), 150u);
  message_.Clear();
  message_.mutable_wind()->mutable_value();
  EXPECT_EQ(withMaterials(message_, changed).DebugString(), message_.DebugString());
}

TEST_F(ToParameterChange, ChecksTheCombinedChange) {
  message_.add_cloths()->mutable_structural()->set_stiffness(20000);
  message_.add_cloths()->mutable_structural()->set_stiffness(10);
  EXPECT_EQ(error(), "no error");
}

}  // namespace
}  // namespace clothstream::messages

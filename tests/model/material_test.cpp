// SPDX-License-Identifier: MIT
// Materials by name, and cloths made of them.
#include "server/model/material.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/model/input.h"
#include "server/model/stability.h"
#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

Cloth sheet(std::uint32_t size) {
  Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 0.5f, .height = 0.5f, .pose = {}};
  cloth.mass = 1;
  return cloth;
}

TEST(Materials, AreListedAlphabetically) {
  std::vector<std::string_view> names;
  for (const Material& material : materials()) {
    names.push_back(material.name);
    EXPECT_FALSE(material.description.empty() || material.source.empty()) << material.name;
    EXPECT_EQ(findMaterial(material.name), &material);
  }
  EXPECT_THAT(names, testing::ElementsAre("cotton", "denim", "flag_nylon", "leather", "paper", "rubber",
                                          "silk", "wool"));
  EXPECT_EQ(findMaterial("velvet"), nullptr);
  EXPECT_EQ(findMaterial(""), nullptr);
}

TEST(Materials, AreStableWithAnySubsteps) {
  for (const Material& material : materials()) {
    Scene scene;
    scene.cloths = {sheet(64)};
    makeOf(material, scene.cloths[0]);
    const Cloth& cloth = scene.cloths[0];
    EXPECT_EQ(cloth.material, material.name);
    EXPECT_FLOAT_EQ(cloth.mass, 0.25f * material.arealMass);
    EXPECT_EQ(cloth.structural.stiffness, material.tension);
    EXPECT_EQ(cloth.shear.stiffness, material.shear);
    EXPECT_EQ(cloth.friction, material.friction);
    EXPECT_EQ(cloth.solver.kind, SolverKind::xpbd);
    EXPECT_EQ(cloth.thickness, 0.005f);  // not changed by the material
    EXPECT_LE(stableSubsteps(scene), scene.substeps) << material.name;
    EXPECT_NE(stableSubsteps(scene), 0u) << material.name;
  }
}

// Half the distance between nodes gives 16 times the stiffness, up to the stiffness in tension.
TEST(Materials, BendEquallyForAnyDistanceBetweenNodes) {
  const Material& silk = *findMaterial("silk");
  const double coarse = bendStiffness(silk, sheet(26)), fine = bendStiffness(silk, sheet(51));
  EXPECT_NEAR(fine / coarse, 16, 1e-3);
  EXPECT_EQ(bendStiffness(silk, sheet(1001)), silk.tension);
  EXPECT_NEAR(bendStiffness(silk, asMesh(sheet(26))) / coarse, 1,
              1);  // springs across edges instead of along rows
}

// Bending length by ASTM D1388. Apparel has one to four centimetres.
TEST(Materials, HaveRealisticBendingLengths) {
  const auto length = [](const char* name) { return bendingLength(*findMaterial(name)); };
  EXPECT_NEAR(length("silk"), 0.013, 0.002);
  EXPECT_NEAR(length("denim"), 0.027, 0.003);
  EXPECT_LT(length("silk"), length("wool"));
  EXPECT_LT(length("wool"), length("cotton"));
  EXPECT_LT(length("cotton"), length("denim"));
  EXPECT_LT(length("denim"), length("leather"));
  EXPECT_LT(length("leather"), length("paper"));
}

TEST(Materials, ApplyBeforeTheOtherChanges) {
  Scene scene;
  scene.cloths = {sheet(26), sheet(51)};
  scene.cloths[1].name = "other";
  ClothChange change{
      .numbers = {{parameters::ClothNumber::bendStiffness, 3.f}, {parameters::ClothNumber::bendDamping, 0.f}},
      .material = "denim"};
  applyChange(scene, {.cloths = {change}});
  for (const Cloth& cloth : scene.cloths) {
    EXPECT_EQ(cloth.material, "denim");
    EXPECT_EQ(cloth.structural.stiffness, findMaterial("denim")->tension);
    EXPECT_EQ(cloth.bend.stiffness, 3);
  }
  applyChange(scene, {.cloths = {{.name = "other", .arealMass = 2.0f}}});
  EXPECT_FLOAT_EQ(scene.cloths[1].mass, 0.5f);
  EXPECT_FLOAT_EQ(scene.cloths[0].mass, 0.25f * findMaterial("denim")->arealMass);
}

}  // namespace
}  // namespace clothstream::model

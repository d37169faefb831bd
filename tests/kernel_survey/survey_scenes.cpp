// SPDX-License-Identifier: MIT
// Scenes that need every kernel of the server.
#include "tests/kernel_survey/survey_scenes.h"

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/messages/scene_file.h"
#include "server/model/cloth_skin.h"
#include "tests/model/meshes.h"
#include "tests/model/solids.h"

namespace clothstream::kernel_survey {
namespace {

using enum model::SolverKind;

// Rows and columns of a sheet that one workgroup solves on every device, and of sheets that take several.
using Sizes = std::pair<std::uint32_t, std::uint32_t>;
constexpr Sizes kSmall{16, 16}, kLarge{96, 128};

struct Case {
  const char* name;
  model::SolverKind kind = massSpring;
  bool damped = false, air = false;
};

constexpr Case kCases[] = {{"mass_spring", massSpring},
                           {"mass_spring_damped", massSpring, true},
                           {"mass_spring_damped_air", massSpring, true, true},
                           {"acad", acad},
                           {"acad_damped_air", acad, true, true},
                           {"constraint", constraint},
                           {"implicit_euler", implicitEuler},
                           {"xpbd", xpbd},
                           {"xpbd_damped", xpbd, true}};

model::Cloth sheet(const Case& experiment, std::uint32_t size) {
  const float damping = experiment.damped ? 0.01f : 0;
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.2f;
  cloth.structural = {10, damping};
  cloth.shear = {5, damping};
  cloth.bend = {1, damping};
  if (experiment.air) cloth.drag = cloth.lift = 0.5f;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  cloth.solver.kind = experiment.kind;
  if (experiment.kind == xpbd) cloth.solver.iterations = 1;
  return cloth;
}

model::Scene sceneOf(model::Cloth cloth) {
  model::Scene scene;
  scene.name = "survey";
  scene.substeps = 2;
  scene.cloths = {std::move(cloth)};
  return scene;
}

using MakeCloth = std::function<model::Cloth(std::uint32_t size)>;

void add(
    std::vector<SurveyScene>& scenes, const std::string& name, const MakeCloth& cloth, Sizes sizes,
    const std::function<void(model::Scene&)>& change = [](model::Scene&) {}) {
  SurveyScene survey{name, sceneOf(cloth(sizes.first))};
  change(survey.scene);
  // One workgroup works on a whole small cloth, so that its kernels cost nothing a node.
  if (sizes == kLarge) change(survey.larger.emplace(sceneOf(cloth(sizes.second))));
  scenes.push_back(std::move(survey));
}

void addSolvers(std::vector<SurveyScene>& scenes) {
  for (const Case& experiment : kCases)
    for (const bool mesh : {false, true})
      for (const bool large : {false, true}) {
        const std::string name =
            std::string(experiment.name) + (mesh ? "/mesh" : "/grid") + (large ? "/large" : "/small");
        const auto sizes = large ? kLarge : kSmall;
        const MakeCloth cloth = [&](std::uint32_t size) {
          const model::Cloth grid = sheet(experiment, size);
          return mesh ? model::asMesh(grid) : grid;
        };
        add(scenes, name, cloth, sizes);
        // Too many iterations for one workgroup.
        if (experiment.kind == acad && !mesh)
          add(
              scenes, name + "/long",
              [&](std::uint32_t size) {
                model::Cloth solved = cloth(size);
                solved.solver.iterations = 1'000'000;
                return solved;
              },
              sizes);
        if (experiment.kind == xpbd)
          add(
              scenes, name + "/sweeps",
              [&](std::uint32_t size) {
                model::Cloth swept = cloth(size);
                swept.solver.iterations = 3;
                return swept;
              },
              sizes);
        if (experiment.kind == constraint)
          for (const auto path : {model::ConstraintPath::matrixFree, model::ConstraintPath::assembled})
            add(
                scenes, name + (path == model::ConstraintPath::assembled ? "/assembled" : "/bend"),
                [&](std::uint32_t size) {
                  model::Cloth enforced = cloth(size);
                  enforced.solver.bendConstraints = path == model::ConstraintPath::matrixFree;
                  enforced.solver.path = path;
                  return enforced;
                },
                sizes);
      }
}

void addFeatures(std::vector<SurveyScene>& scenes) {
  const Case plain{"plain"};
  const MakeCloth grid = [&](std::uint32_t size) { return sheet(plain, size); };
  for (const bool mesh : {false, true})
    add(
        scenes, mesh ? "runge_kutta/mesh" : "runge_kutta/grid",
        [&](std::uint32_t size) { return mesh ? model::asMesh(grid(size)) : grid(size); }, kLarge,
        [](model::Scene& scene) { scene.integrator = model::Integrator::rungeKutta4; });
  for (const bool mesh : {false, true})
    add(
        scenes, mesh ? "coarse/mesh" : "coarse/grid",
        [&](std::uint32_t size) {
          model::Cloth cloth = mesh ? model::asMesh(grid(size)) : grid(size);
          cloth.coarse.emplace();
          return cloth;
        },
        kLarge);
  add(scenes, "explicit_euler", grid, kLarge,
      [](model::Scene& scene) { scene.integrator = model::Integrator::explicitEuler; });
  add(
      scenes, "bending",
      [&](std::uint32_t size) {
        model::Cloth cloth = grid(size);
        cloth.dihedralBending = 1e-5f;
        return cloth;
      },
      kLarge);
  add(
      scenes, "gas",
      [&](std::uint32_t size) {
        model::Cloth cloth = sheet(plain, 4);
        cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::icosphere(size / 3, 0.5f)));
        cloth.pins.clear();
        cloth.pressure = 100;
        return cloth;
      },
      kLarge);
  add(
      scenes, "tethers_and_attachments",
      [&](std::uint32_t size) {
        model::Cloth cloth = grid(size);
        cloth.tethers.emplace();
        cloth.attachments.push_back(
            {.name = "rod",
             .ranges =
                 {{.firstRow = size - 1, .lastRow = size - 1, .firstColumn = 0, .lastColumn = size - 1}},
             .vertices = {},
             .regions = {},
             .collider = {},
             .pose = {},
             .motion = {}});
        return cloth;
      },
      kLarge);
  for (const bool several : {false, true})
    add(
        scenes, several ? "self_collision/materials" : "self_collision",
        [&](std::uint32_t size) {
          model::Cloth cloth = grid(size);
          cloth.selfCollision = model::SelfCollision{.radius = 0.4f / static_cast<float>(size)};
          return cloth;
        },
        kLarge,
        [several](model::Scene& scene) {
          if (!several) return;
          scene.cloths.push_back(scene.cloths.front());
          scene.cloths.back().selfCollision->friction *= 2;
        });
  add(
      scenes, "nothing_passes",
      [&](std::uint32_t size) {
        model::Cloth cloth = grid(size);
        cloth.selfCollision =
            model::SelfCollision{.radius = 0.4f / static_cast<float>(size), .nothingPasses = true};
        return cloth;
      },
      kLarge);
  for (const bool triangles : {false, true})
    add(scenes, triangles ? "sampled_and_triangles" : "sampled", grid, kLarge,
        [triangles](model::Scene& scene) {
          const model::Solid ball = model::ballMesh(0.1f, 4);
          scene.colliders.emplace_back().shape = model::sampled(ball, 0.02f);
          if (triangles) scene.colliders.emplace_back().shape = ball;
        });
  add(scenes, "clothes", grid, kLarge, [](model::Scene& scene) {
    model::ClosedMesh rod = *model::rodMesh(0.03f, 0.4f, 8, 4);
    rod.skin = model::Skin{
        .joints = {{"root", std::nullopt, {}}},
        .vertices = std::vector(rod.vertices.size(), model::VertexJoints{{0, 0, 0, 0}, {1, 0, 0, 0}}),
        .keys = {}};
    model::Collider& collider = scene.colliders.emplace_back();
    collider.name = "rod";
    collider.shape = std::make_shared<const model::ClosedMesh>(std::move(rod));
    model::Cloth& cloth = scene.cloths[0];
    model::ClothSkin skin{.collider = collider.name, .joints = {}, .limits = {}};
    skin.joints.assign(cloth.nodeCount(), {{0, 0, 0, 0}, {1, 0, 0, 0}});
    skin.limits.assign(cloth.nodeCount(), {.maxDistance = 0.1f, .backstopRadius = 1});
    model::complete(skin, cloth, collider);
    cloth.skin = std::make_shared<const model::ClothSkin>(std::move(skin));
  });
  add(scenes, "normals", grid, kLarge,
      [](model::Scene& scene) { scene.stream.normals = model::Normals::octahedral; });
  add(
      scenes, "normals/mesh", [&](std::uint32_t size) { return model::asMesh(grid(size)); }, kLarge,
      [](model::Scene& scene) { scene.stream.normals = model::Normals::octahedral; });
}

}  // namespace

std::vector<SurveyScene> surveyScenes() {
  std::vector<SurveyScene> scenes;
  addSolvers(scenes);
  addFeatures(scenes);
  for (const std::string& name : messages::namedScenes()) {
    messages::Result<model::Scene> scene = messages::loadScene(name);
    if (!scene) throw std::runtime_error(scene.error().text);
    scenes.push_back({name, std::move(*scene)});
  }
  return scenes;
}

}  // namespace clothstream::kernel_survey

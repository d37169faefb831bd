// SPDX-License-Identifier: MIT
// A frame of a hung sheet: Bullet's soft body compared with our mass-spring pipeline, with the strain of
// each.
#include <cmath>
#include <stdexcept>

#include "server/model/stability.h"
#include "server/simulation/software_threads.h"
#include "tests/bench/peers/bullet_cloth.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/samples.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kFrames = 180;  // 3 s
constexpr std::uint32_t kRate = 60;

// The stiffest sheet that this many substeps allow, with twelve equal springs a node.
model::Scene sheet(std::uint32_t size, std::uint32_t substeps) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.grid.pose.orientation = model::Quaternion(Eigen::AngleAxisf(-1.5707964f, model::Vec3::UnitX()));
  cloth.mass = 1;
  cloth.damping = 0.5f;
  cloth.pins = {{.firstRow = 0,
                 .lastRow = 0,
                 .rowStep = 1,
                 .firstColumn = 0,
                 .lastColumn = size - 1,
                 .columnStep = size - 1}};
  model::Scene scene;
  scene.name = "sheet";
  scene.simulationRate = scene.streamRate = kRate;
  scene.substeps = substeps;
  scene.environment.airDensity = 0;
  const double h = scene.substepSeconds();
  const double nodeMass = 1.0 / (static_cast<double>(size) * size);
  const auto stiffness = static_cast<float>(0.16 * nodeMass / (h * h));
  cloth.structural = cloth.shear = cloth.bend = {stiffness, 0};
  scene.cloths = {cloth};
  if (model::stableSubsteps(scene) > substeps)
    throw std::runtime_error("the sheet is too stiff for its substeps");
  return scene;
}

double meanStrain(const std::vector<model::Vec3>& positions, std::uint32_t size) {
  const double rest = 1.0 / (size - 1);
  double sum = 0;
  const auto strain = [&](std::uint32_t a, std::uint32_t b) {
    return std::abs((positions[a] - positions[b]).cast<double>().norm() - rest) / rest;
  };
  for (std::uint32_t row = 0; row < size; ++row)
    for (std::uint32_t column = 0; column + 1 < size; ++column)
      sum += strain(row * size + column, row * size + column + 1) +
             strain(column * size + row, (column + 1) * size + row);
  return sum / (2.0 * size * (size - 1));
}

nlohmann::ordered_json rowOf(const char* who, std::uint32_t size, const std::string& settings,
                             const Samples& wall, double strain) {
  const double nodes = static_cast<double>(size) * size;
  return {{"suite", "mass_spring_peers"},
          {"who", who},
          {"size", size},
          {"settings", settings},
          {"msMin", wall.min() * 1e3},
          {"msMedian", wall.median() * 1e3},
          {"msP99", wall.p99() * 1e3},
          {"nsPerNode", wall.median() * 1e9 / nodes},
          {"meanStrainAfter3s", strain}};
}

}  // namespace

Rows compareMassSpring(const vulkan::DeviceOptions& options) {
  Rows rows;
  // Bullet's search for bend springs takes quadratic time in the nodes, too long for 256 x 256.
  for (const std::uint32_t size : {32u, 64u, 128u}) {
    constexpr int kIterations = 10;
    vulkan::Device device(simulation::suitedTo(size * size, options));
    const std::uint32_t substeps = size < 128 ? 24 : 32;
    BulletCloth bullet(size, kIterations);
    const model::Scene scene = sheet(size, substeps);
    Simulated ours(device, scene, {});
    const simulation::TickInputs inputs{scene.environment, {}};
    ours.check(inputs);
    ours.restart();
    Samples bulletWall;
    for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
      bulletWall.add(secondsOf([&] { bullet.step(1.0f / kRate); }));
      ours.tick(inputs);
    }
    rows.push_back(rowOf("Bullet 3.24 soft body", size, "10 position iterations, one thread", bulletWall,
                         bullet.meanStrain()));
    rows.push_back(rowOf("ClothStream mass-spring", size, std::to_string(substeps) + " substeps", ours.wall(),
                         meanStrain(ours.state().positions, size)));
  }
  return rows;
}

}  // namespace clothstream::bench

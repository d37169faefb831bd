// SPDX-License-Identifier: MIT
// Table of materials, and cloths made of them.
#include "server/model/material.h"

#include <algorithm>
#include <cmath>

#include "server/model/springs.h"

namespace clothstream::model {
namespace {

constexpr double kGravity = 9.81;  // m/s^2
// Curvature times bending length of a strip that hangs over an edge by twice its bending length. The value is
// about the root mean square over the strip. With it, strips of all materials hang closest to their true
// shape.
constexpr double kCurvature = 0.65;

// [WOR11] is Wang, O'Brien and Ramamoorthi, "Data-driven elastic models for cloth: modeling and measurement",
// SIGGRAPH 2011, with data published in ARCSim. 1 oz/yd^2 is 33.9 g/m^2, 1 momme is 4.34 g/m^2. Shear and
// bending of woven cloth are in the range that Kawabata measured for apparel ("The standardization and
// analysis of hand evaluation", 1980): 20 to 100 N/m and 1 to 20 uN m.
constexpr Material kMaterials[] = {
    {.name = "cotton",
     .description = "shirting, plain weave",
     .source = "120 g/m2, common for shirts; shear and bending as Kawabata has shirting",
     .arealMass = 0.12f,
     .tension = 1500,
     .shear = 60,
     .rigidity = 8e-6f,
     .damping = 0.5f,
     .drag = 1,
     .lift = 0.5f,
     .friction = 0.35f},
    {.name = "denim",
     .description = "jeans, twill of 11 oz",
     .source = "[WOR11], 11oz-black-denim: 0.324 kg/m2, 64 uN m, 2,028 N/m",
     .arealMass = 0.324f,
     .tension = 2028,
     .shear = 200,
     .rigidity = 64e-6f,
     .damping = 0.8f,
     .drag = 1.1f,
     .lift = 0.5f,
     .friction = 0.45f},
    {.name = "flag_nylon",
     .description = "outdoor flag, nylon of 200 denier",
     .source = "4 oz/yd2, which is common for such nylon; bending at the upper end of Kawabata's apparel",
     .arealMass = 0.135f,
     .tension = 3000,
     .shear = 80,
     .rigidity = 12e-6f,
     .damping = 0.1f,
     .drag = 1.2f,
     .lift = 0.8f,
     .friction = 0.2f},
    {.name = "leather",
     .description = "garment leather, 0.9 mm",
     .source = "0.9 mm of 0.8 g/cm3 and 10 MPa; bending for a bending length of 3.5 cm",
     .arealMass = 0.72f,
     .tension = 9000,
     .shear = 3400,
     .rigidity = 300e-6f,
     .damping = 1.5f,
     .drag = 1.2f,
     .lift = 0.5f,
     .friction = 0.5f},
    {.name = "paper",
     .description = "office paper",
     .source = "80 g/m2 (ISO 536), 0.1 mm of 3 GPa: E h and E h^3 / 12",
     .arealMass = 0.08f,
     .tension = 3e5f,
     .shear = 1.1e5f,
     .rigidity = 250e-6f,
     .damping = 0.5f,
     .drag = 1.2f,
     .lift = 0.8f,
     .friction = 0.3f},
    {.name = "rubber",
     .description = "sheet of natural rubber, 1 mm",
     .source = "1 mm of 0.93 g/cm3 and 1.5 MPa: E h, E h / 3 and E h^3 / 9",
     .arealMass = 0.93f,
     .tension = 1500,
     .shear = 500,
     .rigidity = 167e-6f,
     .damping = 0.3f,
     .drag = 1.2f,
     .lift = 0.5f,
     .friction = 0.9f},
    {.name = "silk",
     .description = "crepe de Chine of 16 momme",
     .source = "16 momme are 69 g/m2; shear and bending at the lower end of Kawabata's apparel",
     .arealMass = 0.069f,
     .tension = 1000,
     .shear = 20,
     .rigidity = 1.5e-6f,
     .damping = 0.3f,
     .drag = 1,
     .lift = 0.5f,
     .friction = 0.2f},
    {.name = "wool",
     .description = "suiting, worsted twill",
     .source = "7.7 oz/yd2, common for suits; shear and bending as Kawabata has suiting",
     .arealMass = 0.26f,
     .tension = 1000,
     .shear = 40,
     .rigidity = 10e-6f,
     .damping = 1,
     .drag = 0.8f,
     .lift = 0.4f,
     .friction = 0.4f},
};

// Mean length of the bend springs, m. A cloth without bend springs gets an arbitrary length.
double meanBendLength(const Cloth& cloth) {
  if (!cloth.mesh) {
    const GridSpacing lengths = spacing(cloth.grid);
    return 2 * std::sqrt(double{lengths.column} * double{lengths.row});
  }
  double sum = 0;
  std::size_t count = 0;
  for (const SpringLink& link : springLinks(cloth))
    if (link.kind == SpringKind::bend) {
      sum += double{link.restLength};
      ++count;
    }
  return count == 0 ? 1 : sum / static_cast<double>(count);
}

}  // namespace

std::span<const Material> materials() {
  return kMaterials;
}

const Material* findMaterial(std::string_view name) {
  const auto found = std::ranges::find(kMaterials, name, &Material::name);
  return found == std::end(kMaterials) ? nullptr : found;
}

double bendingLength(const Material& material) {
  return std::cbrt(double{material.rigidity} / (double{material.arealMass} * kGravity));
}

double bendStiffness(const Material& material, const Cloth& cloth) {
  const double curvature = kCurvature / bendingLength(material);
  const double square = std::pow(meanBendLength(cloth) / 2, 2);
  return std::min(double{material.tension},
                  16 * double{material.rigidity} / (square * square * curvature * curvature));
}

void makeOf(const Material& material, Cloth& cloth) {
  cloth.material = material.name;
  cloth.mass = static_cast<float>(double{material.arealMass} * areaOf(cloth));
  cloth.structural = {material.tension, 0};
  cloth.shear = {material.shear, 0};
  cloth.bend = {static_cast<float>(bendStiffness(material, cloth)), 0};
  cloth.damping = material.damping;
  cloth.drag = material.drag;
  cloth.lift = material.lift;
  cloth.friction = material.friction;
  cloth.solver = Solver();
  cloth.solver.kind = SolverKind::xpbd;
  cloth.solver.iterations = parameters::kXpbdIterations.initial;
}

}  // namespace clothstream::model

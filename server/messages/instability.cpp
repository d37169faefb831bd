// SPDX-License-Identifier: MIT
// Says why a scene needs more substeps than it has: which forces of which cloth, and which values would do.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/model/stability.h"

namespace clothstream::messages {
namespace {

using model::Cloth;
using model::Scene;

// Forces that bound the step.
struct Cause {
  const char* what;  // before the name of the cloth
  // Multiplies the parameters of the forces.
  void (*scale)(Scene&, Cloth&, float factor);
  // Text of the parameters that the factor gave.
  std::string (*limits)(const Scene&, const Cloth&, float factor);
};

constexpr Cause kWind{
    "the wind on",
    [](Scene& scene, Cloth&, float factor) {
      scene.environment.wind *= factor;
      scene.environment.gust.strength *= factor;
      for (model::SceneWind& wind : scene.winds) wind.speed *= factor;
    },
    [](const Scene& scene, const Cloth&, float) {
      std::string text = fmt::format("a wind of at most {:.3g} m/s and gusts of at most {:.3g} m/s",
                                     scene.environment.wind.norm(), scene.environment.gust.strength);
      if (!scene.winds.empty())
        text += fmt::format(", and local winds of at most {:.3g} m/s in all", model::speedOf(scene.winds));
      return text;
    }};

constexpr Cause kCauses[] = {
    {"the springs of",
     [](Scene&, Cloth& cloth, float factor) {
       for (model::Spring* spring : {&cloth.structural, &cloth.shear, &cloth.bend}) {
         spring->stiffness *= factor;
         spring->damping *= factor;
       }
     },
     [](const Scene&, const Cloth&, float factor) {
       return fmt::format("springs of at most {:.3g} times their stiffness and damping", factor);
     }},
    {"the drag and lift of",
     [](Scene&, Cloth& cloth, float factor) {
       cloth.drag *= factor;
       cloth.lift *= factor;
     },
     [](const Scene&, const Cloth& cloth, float) {
       return fmt::format("a drag of at most {:.3g} and a lift of at most {:.3g}", cloth.drag, cloth.lift);
     }},
    {"the damping of", [](Scene&, Cloth& cloth, float factor) { cloth.damping *= factor; },
     [](const Scene&, const Cloth& cloth, float) {
       return fmt::format("a damping of at most {:.3g} 1/s", cloth.damping);
     }},
    {"the dihedralBending of", [](Scene&, Cloth& cloth, float factor) { cloth.dihedralBending *= factor; },
     [](const Scene&, const Cloth& cloth, float) {
       return fmt::format("a dihedralBending of at most {:.3g} N m", cloth.dihedralBending);
     }}};

// The cloth of a scene that needs the most substeps. The others have no forces here.
class NeediestCloth {
 public:
  NeediestCloth(const Scene& scene, const model::StabilityBound& bound)
      : bound_(bound), scene_(parametersOf(scene)) {
    find();
  }

  std::size_t index() const { return at_; }
  const Cloth& cloth() const { return scene_.cloths[at_]; }

  // More than limits::kMaxSubsteps if these are not enough.
  std::uint32_t neededWith(const Cause& cause, float factor) const {
    return needed([&](Scene& scene) { cause.scale(scene, scene.cloths[at_], factor); });
  }

  // Limits of the parameters with which the scene's substeps are enough, with 1 % to spare. Nothing if they
  // are 0, or if other forces need too many.
  std::optional<std::string> limitsOf(const Cause& cause) const {
    const auto fits = [&](double factor) {
      return neededWith(cause, static_cast<float>(factor)) <= scene_.substeps;
    };
    if (!fits(kLeastFactor)) return std::nullopt;
    const auto factor = static_cast<float>(kRoundedDown * boundary(fits, kLeastFactor, 1));
    Scene changed = scene_;
    cause.scale(changed, changed.cloths[at_], factor);
    return cause.limits(changed, changed.cloths[at_], factor);
  }

  // Least mass in kg with which the scene's substeps are enough, with 1 % to spare. Nothing if none is.
  std::optional<double> leastMass() const {
    const auto fits = [&](double mass) {
      return needed([&](Scene& scene) { scene.cloths[at_].mass = static_cast<float>(mass); }) <=
             scene_.substeps;
    };
    const double most = limits::kMass.max;
    if (!fits(most)) return std::nullopt;
    return std::min(most, boundary(fits, most, double{cloth().mass}) / kRoundedDown);
  }

 private:
  static constexpr double kLeastFactor = 1e-6, kRoundedDown = 0.99;

  // The scene without lists of nodes and without colliders, which the bound does not need again.
  static Scene parametersOf(const Scene& scene) {
    Scene parameters;
    parameters.simulationRate = scene.simulationRate;
    parameters.substeps = scene.substeps;
    parameters.integrator = scene.integrator;
    parameters.environment = scene.environment;
    parameters.winds = scene.winds;
    for (const Cloth& cloth : scene.cloths) {
      Cloth& copy = parameters.cloths.emplace_back();
      copy.name = cloth.name;
      copy.mass = cloth.mass;
      copy.structural = cloth.structural, copy.shear = cloth.shear, copy.bend = cloth.bend;
      copy.dihedralBending = cloth.dihedralBending;
      copy.damping = cloth.damping, copy.drag = cloth.drag, copy.lift = cloth.lift;
      copy.solver = cloth.solver;
    }
    return parameters;
  }

  static std::uint32_t orMore(std::uint32_t substeps) {
    return substeps == 0 ? limits::kMaxSubsteps + 1 : substeps;
  }

  static void removeForces(Scene& scene, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i)
      for (const Cause& cause : kCauses) cause.scale(scene, scene.cloths[i], 0);
  }

  // Value between `fit`, which fits, and `over`, which does not, that nearly does not fit. Both are above 0.
  // Bisects factors, because the ranges have many orders of magnitude.
  template <typename Fits>
  static double boundary(const Fits& fits, double fit, double over) {
    constexpr int kBisections = 20;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = std::sqrt(fit * over);
      (fits(middle) ? fit : over) = middle;
    }
    return fit;
  }

  // Halves the cloths that may be the one, until one is left.
  void find() {
    std::size_t count = scene_.cloths.size();
    const std::uint32_t all = orMore(bound_.substeps(scene_));
    while (count > 1) {
      const std::size_t half = count / 2;
      const std::uint32_t withoutFirst = needed([&](Scene& scene) { removeForces(scene, at_, half); });
      if (withoutFirst < all) {
        removeForces(scene_, at_ + half, count - half);
        count = half;
      } else {
        removeForces(scene_, at_, half);
        at_ += half;
        count -= half;
      }
    }
  }

  template <typename Change>
  std::uint32_t needed(const Change& change) const {
    Scene changed = scene_;
    change(changed);
    return orMore(bound_.substeps(changed));
  }

  const model::StabilityBound& bound_;
  Scene scene_;
  std::size_t at_ = 0;
};

// The wind if the scene's substeps are enough without it, else the forces without which the cloth needs the
// fewest.
const Cause& mainCause(const NeediestCloth& cloth, std::uint32_t substeps) {
  if (cloth.neededWith(kWind, 0) <= substeps) return kWind;
  return *std::ranges::min_element(kCauses, {},
                                   [&](const Cause& cause) { return cloth.neededWith(cause, 0); });
}

// Values with which these substeps are enough. `area` is that of the cloth in m^2.
std::string remedy(const NeediestCloth& cloth, const Cause& cause, double area, std::uint32_t substeps) {
  std::string found;
  if (const auto mass = cloth.leastMass())
    found = fmt::format("with a mass of at least {:.3g} kg ({:.3g} kg/m^2)", *mass, *mass / area);
  if (const auto limits = cloth.limitsOf(cause))
    found += fmt::format("{}with {}", found.empty() ? "" : ", or ", *limits);
  if (found.empty()) return "use more substeps or a higher simulationRate";
  return fmt::format("{} would do {}", substeps, found);
}

}  // namespace

std::optional<std::string> instability(const Scene& scene, const model::StabilityBound& bound) {
  const std::uint32_t needed = bound.substeps(scene);
  if (needed != 0 && needed <= scene.substeps) return std::nullopt;
  const NeediestCloth cloth(scene, bound);
  const Cause& cause = mainCause(cloth, scene.substeps);
  const double area = model::areaOf(scene.cloths[cloth.index()]);
  const std::string why =
      fmt::format("because of {} \"{}\", whose mass is {:.3g} kg; {}", cause.what, cloth.cloth().name,
                  cloth.cloth().mass, remedy(cloth, cause, area, scene.substeps));
  if (needed != 0) return fmt::format("this scene needs at least {}, {}", needed, why);
  const bool isExplicit = scene.integrator == model::Integrator::explicitEuler;
  return fmt::format("no number up to {} keeps this scene stable, {}{}", limits::kMaxSubsteps, why,
                     isExplicit
                         ? "; INTEGRATOR_EXPLICIT_EULER needs springs with a damping of at least their "
                           "stiffness times the step, and also a cloth damping; or use "
                           "INTEGRATOR_SEMI_IMPLICIT_EULER"
                         : "");
}

}  // namespace clothstream::messages

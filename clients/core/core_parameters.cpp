// SPDX-License-Identifier: MIT
// The part of the C interface that reads and changes parameters.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"
#include "proto/parameters/apply_change.h"

using namespace clothstream::client;
using namespace clothstream::parameters;

namespace {

// Changes a field of the environment to these numbers; null: no change.
void setField(ParameterChange& change, EnvironmentField field, const float* numbers) {
  if (!numbers) return;
  std::copy_n(numbers, kEnvironmentParameters[field].numbers.size(),
              change.environment[field].emplace().data());
}

constexpr float kAsIs = std::numeric_limits<float>::quiet_NaN();

std::optional<float> given(float value) {
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

// Numbers that the settings change. The server replaces some groups as a whole: these get their current
// numbers where the settings give none.
ClothNumbers changed(const cs_cloth_settings& settings, const ClothNumbers& now) {
  ClothNumbers change;
  for (const ClothParameter& parameter : kClothParameters)
    change[parameter.number] = settingOf(settings, parameter.number);
  for (const ClothParameter& parameter : kClothParameters)
    if (parameter.group && parameter.group->isReplaced && change.hasAnyOf(*parameter.group) &&
        !change.has(parameter.number))
      change[parameter.number] = now[parameter.number];
  return change;
}

// Settings of a solver that this scene has not had, as in scene.proto.
Solver defaultSolver(std::uint32_t kind) {
  Solver solver;
  solver.kind = kind;
  if (kind == CS_SOLVER_XPBD) solver.iterations = clothstream::parameters::kXpbdIterations.initial;
  return solver;
}

std::optional<Solver> changed(const cs_cloth_settings& settings, const ClothParameters& now) {
  const bool any = settings.solver != CS_SOLVER_AS_IS || settings.bend_constraints >= 0 ||
                   settings.assembled >= 0 || settings.iterations != 0 || given(settings.tolerance) ||
                   given(settings.compliance) || given(settings.activation);
  if (!any) return std::nullopt;
  Solver solver = now.solver;
  if (settings.solver != CS_SOLVER_AS_IS && settings.solver != solver.kind) {
    const auto known = now.solvers.find(settings.solver);
    solver = known == now.solvers.end() ? defaultSolver(settings.solver) : known->second;
  }
  if (settings.bend_constraints >= 0) solver.bendConstraints = settings.bend_constraints != 0;
  if (settings.assembled >= 0) solver.path = settings.assembled != 0 ? kAssembled : kMatrixFree;
  if (settings.iterations != 0) solver.iterations = settings.iterations;
  solver.tolerance = given(settings.tolerance).value_or(solver.tolerance);
  if (given(settings.compliance)) solver.compliance = settings.compliance;
  solver.activation = given(settings.activation).value_or(solver.activation);
  return solver;
}

ClothChange changeOf(const Cloth& cloth, const cs_cloth_settings& settings) {
  return {.name = cloth.name,
          .numbers = changed(settings, cloth.parameters.numbers),
          .solver = changed(settings, cloth.parameters)};
}

}  // namespace

int cs_get_environment(const cs_client* client, cs_environment* out) noexcept {
  if (!client->client.stream().begun() || out->version != CS_ENVIRONMENT_VERSION) return 0;
  const EnvironmentValues& environment = client->client.stream().description().environment;
  copy(environment[kGravity], out->gravity);
  copy(environment[kWind], out->wind);
  out->air_density = environment[kAirDensity][0];
  out->gust_strength = environment[kGust][0];
  out->gust_seconds = environment[kGust][1];
  return 1;
}

int cs_get_cloth_settings(const cs_client* client, uint32_t index, cs_cloth_settings* out) noexcept {
  const Cloth* cloth = at(client->client.stream().description().cloths, index);
  if (!cloth || out->version != CS_CLOTH_SETTINGS_VERSION) return 0;
  const ClothParameters& parameters = cloth->parameters;
  cs_keep_cloth_settings(out);
  for (const ClothParameter& parameter : kClothParameters)
    settingOf(*out, parameter.number) = parameters.numbers[parameter.number];
  out->solver = parameters.solver.kind;
  const bool constrained = out->solver == CS_SOLVER_CONSTRAINT || out->solver == CS_SOLVER_ACAD;
  if (constrained || out->solver == CS_SOLVER_XPBD || out->solver == CS_SOLVER_IMPLICIT_EULER)
    out->iterations = parameters.solver.iterations;
  if (constrained || out->solver == CS_SOLVER_IMPLICIT_EULER) out->tolerance = parameters.solver.tolerance;
  if (constrained || out->solver == CS_SOLVER_XPBD)
    out->compliance = parameters.solver.compliance.value_or(kAsIs);
  if (!constrained) return 1;
  out->bend_constraints = parameters.solver.bendConstraints ? 1 : 0;
  if (out->solver == CS_SOLVER_CONSTRAINT) out->assembled = parameters.solver.path == kAssembled ? 1 : 0;
  if (out->solver == CS_SOLVER_ACAD) out->activation = parameters.solver.activation;
  return 1;
}

uint32_t cs_material_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.stream().description().materials.size());
}

const char* cs_material(const cs_client* client, uint32_t index) noexcept {
  const std::string* material = at(client->client.stream().description().materials, index);
  return material ? material->c_str() : "";
}

const char* cs_cloth_material(const cs_client* client, uint32_t cloth) noexcept {
  const Cloth* found = at(client->client.stream().description().cloths, cloth);
  return found ? found->parameters.material.c_str() : "";
}

uint64_t cs_parameters_participant(const cs_client* client) noexcept {
  return client->client.parametersParticipant();
}

void cs_set_environment(cs_client* client, const float* gravity3, const float* wind3,
                        const float* air_density) noexcept {
  ParameterChange change;
  setField(change, kGravity, gravity3);
  setField(change, kWind, wind3);
  setField(change, kAirDensity, air_density);
  client->client.change(change);
}

void cs_set_gust(cs_client* client, float strength, float seconds) noexcept {
  ParameterChange change;
  const float numbers[] = {strength, seconds};
  setField(change, kGust, numbers);
  client->client.change(change);
}

void cs_keep_cloth_settings(cs_cloth_settings* out) noexcept {
  *out = {};
  out->solver = CS_SOLVER_AS_IS;
  out->bend_constraints = out->assembled = -1;
  out->tolerance = out->compliance = out->activation = kAsIs;
  for (const ClothParameter& parameter : kClothParameters) settingOf(*out, parameter.number) = kAsIs;
}

int cs_set_cloth(cs_client* client, const char* cloth, const cs_cloth_settings* settings) noexcept {
  if (settings->version != CS_CLOTH_SETTINGS_VERSION) return 0;
  ParameterChange change;
  const std::string_view name = cloth;
  for (const Cloth& present : client->client.stream().description().cloths)
    if (clothstream::parameters::isFor(name, present.name))
      change.cloths.push_back(changeOf(present, *settings));
  if (change.cloths.empty()) return 0;
  client->client.change(change);
  return 1;
}

void cs_set_material(cs_client* client, const char* cloth, const char* material) noexcept {
  ParameterChange change;
  ClothChange& clothChange = change.cloths.emplace_back();
  clothChange.name = cloth;
  clothChange.material = material;
  client->client.change(change);
}

void cs_set_areal_mass(cs_client* client, const char* cloth, float areal_mass) noexcept {
  ParameterChange change;
  ClothChange& clothChange = change.cloths.emplace_back();
  clothChange.name = cloth;
  clothChange.arealMass = areal_mass;
  client->client.change(change);
}

void cs_keep_collider(cs_collider_change* out) noexcept {
  *out = {.version = CS_COLLIDER_CHANGE_VERSION,
          .position = {kAsIs, kAsIs, kAsIs},
          .orientation = {kAsIs, kAsIs, kAsIs, kAsIs},
          .radius = kAsIs,
          .length = kAsIs,
          .size = {kAsIs, kAsIs, kAsIs},
          .friction = kAsIs};
}

int cs_set_collider(cs_client* client, const char* collider, const cs_collider_change* change) noexcept {
  if (change->version != CS_COLLIDER_CHANGE_VERSION) return 0;
  client->client.changeCollider(collider, *change);
  return 1;
}

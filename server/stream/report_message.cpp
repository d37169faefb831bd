// SPDX-License-Identifier: MIT
// A tick's report as it travels with a frame.
#include "server/stream/report_message.h"

namespace clothstream::stream {

void write(std::span<const simulation::ClothReport> reports, double deviceSeconds,
           v1::SimulationReport& message) {
  message.Clear();
  message.set_device_seconds(deviceSeconds);
  for (const simulation::ClothReport& report : reports) {
    v1::ClothReport& cloth = *message.add_cloths();
    cloth.set_strain_max(report.strainMax);
    cloth.set_strain_p99(report.strainP99);
    cloth.set_strain_mean(report.strainMean);
    cloth.set_kinetic_energy(report.kineticEnergy);
    cloth.set_elastic_energy(report.elasticEnergy);
    cloth.set_gravity_energy(report.gravityEnergy);
    cloth.set_active_constraints(report.activeConstraints);
    cloth.set_iterations(report.iterations);
    cloth.set_residual(report.residual);
    cloth.set_penetration(report.penetration);
  }
}

}  // namespace clothstream::stream

// SPDX-License-Identifier: MIT
// C interface: statistics.

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

int cs_get_statistics(const cs_client* client, uint64_t now_us, cs_statistics* out) noexcept {
  if (out->version != CS_STATISTICS_VERSION) return 0;
  const FrameStatistics& frames = client->client.stream().statistics();
  *out = {};
  out->tick = frames.tick();
  out->frames = frames.frames();
  out->key_frames = frames.keyFrames();
  out->dropped = frames.dropped();
  out->decode_errors = frames.decodeErrors();
  out->bytes = frames.bytes();
  out->hash_mismatches = frames.hashMismatches();
  out->frames_per_second = frames.framesPerSecond(now_us);
  out->kbit_per_second = frames.kbitPerSecond(now_us);
  out->bits_per_vertex = frames.bitsPerVertex();
  out->round_trip_ms = client->client.clock().roundTripMs();
  out->clock_offset_us = client->client.clock().offsetUs(now_us);
  out->decode_ms = client->client.stream().newest().decodeMs();
  return 1;
}

int cs_get_quality(const cs_client* client, uint32_t* quality) noexcept {
  *quality = client->client.stream().quality();
  return client->client.stream().begun() ? 1 : 0;
}

double cs_stream_seconds(const cs_client* client) noexcept {
  return client->client.stream().statistics().streamSeconds();
}

int cs_get_stage_statistics(const cs_client* client, cs_stage_statistics* out) noexcept {
  if (out->version != CS_STAGE_STATISTICS_VERSION) return 0;
  *out = client->client.stages();
  return 1;
}

int cs_get_cloth_report(const cs_client* client, uint32_t index, cs_cloth_report* out) noexcept {
  const SimulationReport& report = client->client.stream().report();
  const ClothReport* cloth = at(report.cloths, index);
  if (!cloth || out->version != CS_CLOTH_REPORT_VERSION) return 0;
  *out = {.version = CS_CLOTH_REPORT_VERSION,
          .active_constraints = cloth->activeConstraints,
          .iterations = cloth->iterations,
          .residual = cloth->residual,
          .strain_max = cloth->strainMax,
          .strain_p99 = cloth->strainP99,
          .strain_mean = cloth->strainMean,
          .kinetic_energy = cloth->kineticEnergy,
          .elastic_energy = cloth->elasticEnergy,
          .gravity_energy = cloth->gravityEnergy,
          .penetration = cloth->penetration,
          .device_ms = static_cast<float>(1000 * report.deviceSeconds),
          .tick = client->client.stream().reportTick()};
  return 1;
}

const uint32_t* cs_constraint_ends(const cs_client* client, uint32_t index, uint32_t* count) noexcept {
  const ClothReport* cloth = at(client->client.stream().report().cloths, index);
  *count = cloth ? static_cast<std::uint32_t>(cloth->constraintEnds.size() / 2) : 0;
  return *count > 0 ? cloth->constraintEnds.data() : nullptr;
}

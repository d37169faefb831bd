// SPDX-License-Identifier: MIT
// Formats the figures.
#include "clients/cli/report.h"

#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "proto/text/printable.h"

namespace clothstream::cli {

std::string solverName(std::uint32_t solver) {
  switch (solver) {
    case CS_SOLVER_MASS_SPRING:
      return "massSpring";
    case CS_SOLVER_CONSTRAINT:
      return "constraint";
    case CS_SOLVER_ACAD:
      return "acad";
    case CS_SOLVER_XPBD:
      return "xpbd";
    case CS_SOLVER_IMPLICIT_EULER:
      return "implicitEuler";
    default:
      return fmt::format("solver {}", solver);
  }
}

std::string text(const ClothFigures& figures) {
  const cs_cloth_report& now = figures.report;
  std::string line = fmt::format(
      "{} ({}), tick {}: strain {:.2f} % at most, {:.2f} % p99, {:.2f} % mean; energy {:.4g} J kinetic, "
      "{:.4g} J elastic, {:.4g} J gravity",
      printable(figures.name), figures.solver, now.tick, 100 * now.strain_max, 100 * now.strain_p99,
      100 * now.strain_mean, now.kinetic_energy, now.elastic_energy, now.gravity_energy);
  if (now.iterations > 0 || now.active_constraints > 0)
    line += fmt::format("; {} constraints, {} iterations, residual {:.2g}", now.active_constraints,
                        now.iterations, now.residual);
  return line + fmt::format("; {:.2g} mm inside a collider; {:.2f} ms on the device", 1000 * now.penetration,
                            now.device_ms);
}

double lossOf(const cs_datagram_statistics& datagrams) {
  const std::uint64_t sent = datagrams.packets + datagrams.lost_packets;
  return sent > 0 ? static_cast<double>(datagrams.lost_packets) / static_cast<double>(sent) : 0;
}

std::string text(const cs_datagram_statistics& datagrams) {
  return fmt::format(
      "{} packets, {:.2f} % lost, {} with parity; {} frames, {} repaired, {} lost, {} requests",
      datagrams.packets, 100 * lossOf(datagrams), datagrams.parity_packets, datagrams.frames,
      datagrams.repaired_frames, datagrams.lost_frames, datagrams.requests);
}

nlohmann::ordered_json jsonOf(const cs_datagram_statistics& datagrams) {
  return {{"packets", datagrams.packets},
          {"lostPackets", datagrams.lost_packets},
          {"parityPackets", datagrams.parity_packets},
          {"frames", datagrams.frames},
          {"repairedFrames", datagrams.repaired_frames},
          {"lostFrames", datagrams.lost_frames},
          {"requests", datagrams.requests},
          {"heldFrames", datagrams.held_frames}};
}

Report Report::of(const cs_client* client, std::uint64_t nowUs) {
  Report report;
  report.scene = cs_scene_name(client);
  report.server = cs_server_name(client);
  report.device = cs_device_name(client);
  report.vertices = cs_vertex_count(client);
  report.streamRate = cs_stream_rate(client);
  report.frameDivisor = cs_frame_divisor(client);
  report.seconds = cs_stream_seconds(client);
  cs_get_statistics(client, nowUs, &report.statistics);
  cs_get_quality(client, &report.quality);
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i) {
    ClothFigures figures{.name = cloth.name, .solver = {}};
    if (cs_get_cloth_report(client, i, &figures.report) == 0) break;
    cs_cloth_settings settings{};
    if (cs_get_cloth_settings(client, i, &settings) != 0) figures.solver = solverName(settings.solver);
    report.cloths.push_back(std::move(figures));
  }
  return report;
}

double Report::framesPerSecond() const {
  return seconds > 0 ? static_cast<double>(statistics.frames - 1) / seconds : 0;
}

double Report::kbitPerSecond() const {
  return statistics.bits_per_vertex * vertices * framesPerSecond() / 1000;
}

std::string Report::json(bool hash) const {
  nlohmann::ordered_json object{
      {"scene", scene},
      {"server", server},
      {"device", device},
      {"vertices", vertices},
      {"seconds", seconds},
      {"ticks", statistics.tick},
      {"frames", statistics.frames},
      {"keyFrames", statistics.key_frames},
      {"fps", framesPerSecond()},
      {"kbitPerSecond", kbitPerSecond()},
      {"bitsPerVertex", statistics.bits_per_vertex},
      {"roundTripMs", statistics.round_trip_ms},
      {"dropped", statistics.dropped},
      {"quality", quality},
      {"decodeErrors", statistics.decode_errors},
      {"transport", usesDatagrams() ? "datagrams" : "tcp"},
      {"datagrams", nullptr},
  };
  if (datagrams) object["datagrams"] = jsonOf(*datagrams);
  object["cloths"] = nlohmann::ordered_json::array();
  for (const ClothFigures& figures : cloths) {
    const cs_cloth_report& now = figures.report;
    object["cloths"].push_back({{"name", figures.name},
                                {"solver", figures.solver},
                                {"tick", now.tick},
                                {"strainMax", now.strain_max},
                                {"strainP99", now.strain_p99},
                                {"strainMean", now.strain_mean},
                                {"kineticEnergy", now.kinetic_energy},
                                {"elasticEnergy", now.elastic_energy},
                                {"gravityEnergy", now.gravity_energy},
                                {"activeConstraints", now.active_constraints},
                                {"iterations", now.iterations},
                                {"residual", now.residual},
                                {"penetration", now.penetration},
                                {"deviceMs", now.device_ms}});
  }
  if (hash) object["hashMismatches"] = statistics.hash_mismatches;
  return jsonText(object, 2);
}

std::string Report::text(bool hash) const {
  std::string text = fmt::format(
      "{} of {} on {}: {} vertices, {} frames in {:.1f} s\n"
      "{:.1f} frames/s of {}, {:.0f} kbit/s, {:.2f} bits a vertex, {:.1f} ms round trip, {} dropped, {} "
      "refused",
      printable(scene), printable(server), printable(device), vertices, statistics.frames, seconds,
      framesPerSecond(), streamRate, kbitPerSecond(), statistics.bits_per_vertex, statistics.round_trip_ms,
      statistics.dropped, statistics.decode_errors);
  text += usesDatagrams() ? "\ntransport: datagrams" : "\ntransport: tcp";
  if (datagrams) text += "; " + cli::text(*datagrams);
  if (hash)
    text += fmt::format("\n{} of {} frames equal the server's",
                        statistics.frames - statistics.hash_mismatches, statistics.frames);
  for (const ClothFigures& figures : cloths) text += '\n' + cli::text(figures);
  return text;
}

void StatusLine::show(const Report& report) const {
  if (!shown_) return;
  const cs_statistics& now = report.statistics;
  showStatus(stdout, fmt::format("{}  tick {}  {:.0f} fps{}  {:.0f} kbit/s  {:.1f} ms round trip  {} dropped",
                                 report.scene, now.tick, now.frames_per_second,
                                 report.frameDivisor > 1
                                     ? fmt::format(" of {}: the server is overloaded", report.streamRate)
                                     : "",
                                 now.kbit_per_second, now.round_trip_ms, now.dropped));
}

void StatusLine::clear() const {
  if (!shown_) return;
  showStatus(stdout, "");
}

}  // namespace clothstream::cli

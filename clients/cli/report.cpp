// SPDX-License-Identifier: MIT
// Figures in words.
#include "clients/cli/report.h"

#include <cstdio>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace clothstream::cli {

Report Report::of(const cs_client* client, std::uint64_t nowUs) {
  Report report;
  report.scene = cs_scene_name(client);
  report.server = cs_server_name(client);
  report.device = cs_device_name(client);
  report.vertices = cs_vertex_count(client);
  report.streamRate = cs_stream_rate(client);
  report.seconds = cs_stream_seconds(client);
  cs_get_statistics(client, nowUs, &report.statistics);
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
      {"decodeErrors", statistics.decode_errors},
  };
  if (hash) object["hashMismatches"] = statistics.hash_mismatches;
  // Names come from the server and need not be UTF-8.
  return object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string Report::text(bool hash) const {
  std::string text = fmt::format(
      "{} of {} on {}: {} vertices, {} frames in {:.1f} s\n"
      "{:.1f} frames/s of {}, {:.0f} kbit/s, {:.2f} bits a vertex, {:.1f} ms round trip, {} dropped, {} "
      "refused",
      scene, server, device, vertices, statistics.frames, seconds, framesPerSecond(), streamRate,
      kbitPerSecond(), statistics.bits_per_vertex, statistics.round_trip_ms, statistics.dropped,
      statistics.decode_errors);
  if (hash)
    text += fmt::format("\n{} of {} frames are what the server holds",
                        statistics.frames - statistics.hash_mismatches, statistics.frames);
  return text;
}

void StatusLine::show(const Report& report) const {
  if (!shown_) return;
  const cs_statistics& now = report.statistics;
  fmt::print("\r\033[K{}  tick {}  {:.0f} fps  {:.0f} kbit/s  {:.1f} ms round trip  {} dropped", report.scene,
             now.tick, now.frames_per_second, now.kbit_per_second, now.round_trip_ms, now.dropped);
  std::fflush(stdout);
}

void StatusLine::clear() const {
  if (!shown_) return;
  fmt::print("\r\033[K");
  std::fflush(stdout);
}

}  // namespace clothstream::cli

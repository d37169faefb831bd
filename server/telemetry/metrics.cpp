// SPDX-License-Identifier: MIT
// Formats metrics as text.
#include "server/telemetry/metrics.h"

#include <initializer_list>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace clothstream::telemetry {
namespace {

using Counted = std::pair<std::string_view, std::uint64_t>;

void addLine(std::string& text, std::string_view name, const Summary& summary) {
  if (summary.count == 0) return;
  fmt::format_to(std::back_inserter(text), "  {:<26}{:>9}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}\n", name,
                 summary.count, summary.p50 * 1e3, summary.p90 * 1e3, summary.p99 * 1e3, summary.max * 1e3);
}

void addCounters(std::string& text, std::initializer_list<Counted> counters) {
  for (const auto& [name, value] : counters) fmt::format_to(std::back_inserter(text), "  {} {}", name, value);
  text += '\n';
}

}  // namespace

std::string table(const std::string& scene, const SceneMetrics& m) {
  std::string text = fmt::format("{:<28}{:>9}{:>10}{:>10}{:>10}{:>10}\n", fmt::format("scene {} (ms)", scene),
                                 "count", "p50", "p90", "p99", "max");
  addLine(text, "tick", m.tick.summary());
  addLine(text, "tick lateness", m.lateness.summary());
  addLine(text, "device", m.deviceTotal.summary());
  for (const auto& [stage, summary] : m.device.summaries())
    addLine(text, fmt::format("  {}", stage), summary);
  addLine(text, "entropy coding", m.encode.summary());
  addLine(text, "send", m.send.summary());
  addLine(text, "pose arrival to packet", m.inputToPacket.summary());
  addCounters(text, {{"ticks", m.ticks.value()},
                     {"late", m.lateTicks.value()},
                     {"slipped", m.slippedTicks.value()},
                     {"rollbacks", m.rollbacks.value()},
                     {"resets", m.resets.value()},
                     {"crowded", m.crowdedBalls.value()}});
  addCounters(text, {{"frames", m.frames.value()},
                     {"key", m.keyFrames.value()},
                     {"bytes", m.packetBytes.value()},
                     {"skipped", m.skippedFrames.value()},
                     {"taken", m.framesTaken.value()},
                     {"in datagrams", m.datagramFrames.value()},
                     {"dropped", m.framesDropped.value()}});
  addCounters(text, {{"steps down", m.stepsDown.value()}, {"steps up", m.stepsUp.value()}});
  if (m.overloadStepsDown.value() > 0)
    addCounters(text, {{"overload steps down", m.overloadStepsDown.value()},
                       {"overload steps up", m.overloadStepsUp.value()}});
  addCounters(text, {{"joins", m.joins.value()}, {"rejected messages", m.rejectedMessages.value()}});
  return text;
}

std::string table(const ServerMetrics& m) {
  std::string text = "server\n";
  addCounters(text, {{"connections", m.connections.value()},
                     {"dropped", m.droppedConnections.value()},
                     {"rejected messages", m.rejectedMessages.value()},
                     {"device rebuilds", m.deviceRebuilds.value()},
                     {"scenes in quarantine", m.quarantines.value()}});
  if (m.datagrams.packets.value() > 0)
    addCounters(text, {{"datagrams sent", m.datagrams.packets.value()},
                       {"bytes", m.datagrams.bytes.value()},
                       {"lost", m.datagrams.lost.value()},
                       {"repeated", m.datagrams.repeats.value()},
                       {"fallbacks", m.datagrams.fallbacks.value()}});
  if (m.nats.published.value() + m.nats.received.value() > 0)
    addCounters(text, {{"NATS messages sent", m.nats.published.value()},
                       {"received", m.nats.received.value()},
                       {"dropped", m.nats.dropped.value()},
                       {"refused", m.nats.refused.value()}});
  for (std::size_t i = 0; i < kRefusalNames.size(); ++i)
    if (m.refusals[i].value() > 0)
      addCounters(text, {{fmt::format("refused: {}", kRefusalNames[i]), m.refusals[i].value()}});
  return text;
}

}  // namespace clothstream::telemetry

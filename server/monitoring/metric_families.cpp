// SPDX-License-Identifier: MIT
#include "server/monitoring/metric_families.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <utility>

#include "server/hosting/scene_server.h"
#include "server/monitoring/process_usage.h"
#include "server/scene/scene_observer.h"
#include "server/scene/scene_store.h"
#include "server/telemetry/histogram.h"
#include "server/telemetry/log.h"

namespace clothstream::monitoring {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using scene::LiveScene;
using Labels = std::vector<ClientMetric::Label>;
using Metrics = telemetry::SceneMetrics;

MetricFamily& add(Families& families, MetricType type, std::string name, std::string help) {
  families.push_back({std::move(name), std::move(help), type, {}});
  return families.back();
}

// Adds a sample of a counter or a gauge.
void addSample(MetricFamily& family, double value, Labels labels = {}) {
  ClientMetric& sample = family.metric.emplace_back();
  sample.label = std::move(labels);
  (family.type == MetricType::Counter ? sample.counter.value : sample.gauge.value) = value;
}

void addSample(MetricFamily& family, const telemetry::Buckets& buckets, Labels labels) {
  if (buckets.count == 0) return;
  ClientMetric& sample = family.metric.emplace_back();
  sample.label = std::move(labels);
  sample.histogram.sample_count = buckets.count;
  sample.histogram.sample_sum = buckets.sum;
  for (std::size_t i = 0; i < buckets.cumulative.size(); ++i)
    sample.histogram.bucket.push_back({buckets.cumulative[i], telemetry::kBucketBounds[i]});
}

struct HistogramRow {
  const char* name;
  const char* help;
  telemetry::Histogram telemetry::SceneMetrics::*histogram;
};

constexpr HistogramRow kSceneHistograms[] = {
    {"tick_seconds", "Time from the start of a tick to its status on the CPU.", &Metrics::tick},
    {"tick_lateness_seconds", "Start of a tick behind its due time.", &Metrics::lateness},
    {"device_seconds", "Time of all stages of a tick on the device.", &Metrics::deviceTotal},
    {"encode_seconds", "Time from the end of a tick on the device to its packet.", &Metrics::encode},
    {"send_seconds", "Time from a packet to the moment an endpoint takes it.", &Metrics::send},
    {"input_to_packet_seconds", "Time from the arrival of a pose to the packet that shows its effect.",
     &Metrics::inputToPacket},
};

struct CounterRow {
  const char* name;
  const char* help;
  telemetry::Counter telemetry::SceneCounters::*counter;
};

constexpr CounterRow kSceneCounters[] = {
    {"ticks_total", "Ticks simulated.", &Metrics::ticks},
    {"late_ticks_total", "Ticks that started more than a quarter of a period late.", &Metrics::lateTicks},
    {"slipped_ticks_total", "Ticks by which simulated time fell behind real time.", &Metrics::slippedTicks},
    {"frames_total", "Packets encoded.", &Metrics::frames},
    {"key_frames_total", "Packets that are key frames.", &Metrics::keyFrames},
    {"packet_bytes_total", "Bytes of all packets, each counted once for all subscribers.",
     &Metrics::packetBytes},
    {"skipped_frames_total", "Frames not encoded because the encoder was behind.", &Metrics::skippedFrames},
    {"taken_frames_total", "Frames taken by endpoints, per subscriber.", &Metrics::framesTaken},
    {"datagram_frames_total", "Those of the taken frames that left in datagrams.", &Metrics::datagramFrames},
    {"dropped_frames_total", "Frames not sent because the subscriber was behind, per subscriber.",
     &Metrics::framesDropped},
    {"sent_bytes_total", "Bytes of all messages that endpoints have taken, per subscriber.",
     &Metrics::sentBytes},
    {"steps_down_total", "Subscribers moved to a coarser quality.", &Metrics::stepsDown},
    {"steps_up_total", "Subscribers moved to a finer quality.", &Metrics::stepsUp},
    {"overload_steps_down_total", "Reductions of frames or substeps because the device was overloaded.",
     &Metrics::overloadStepsDown},
    {"overload_steps_up_total", "Increases of frames or substeps after an overload.",
     &Metrics::overloadStepsUp},
    {"rollbacks_total", "Returns to the last good state.", &Metrics::rollbacks},
    {"resets_total", "Returns to the initial state.", &Metrics::resets},
    {"crowded_balls_total",
     "Full neighbour lists, balls with too many contacts, and substeps in which a bounded cloth stood still, "
     "in "
     "self-collision.",
     &Metrics::crowdedBalls},
    {"rejected_messages_total", "Messages answered by an error.", &Metrics::rejectedMessages},
    {"joins_total", "Joins, reconnections included.", &Metrics::joins},
};
static_assert(std::size(kSceneCounters) * sizeof(telemetry::Counter) == sizeof(telemetry::SceneCounters),
              "each counter of a scene has a row");

struct GaugeRow {
  const char* name;
  const char* help;
  double (*of)(const LiveScene&);
};

double number(std::size_t value) {
  return static_cast<double>(value);
}

constexpr GaugeRow kSceneGauges[] = {
    {"participants", "Participants, disconnected ones included.",
     [](const LiveScene& scene) { return number(scene.roster.size()); }},
    {"away_participants", "Participants that are disconnected and may come back.",
     [](const LiveScene& scene) { return number(scene.roster.away()); }},
    {"subscribers", "Connections that receive frames.",
     [](const LiveScene& scene) { return number(scene.subscribers.size()); }},
    {"running", "1 while ticks run, else 0.", [](const LiveScene& scene) { return number(scene.running); }},
    {"paused", "1 while the scene is paused, else 0.",
     [](const LiveScene& scene) { return number(scene.paused); }},
    {"frame_divisor", "Distance of the frames that the scene sends, in frames of its stream rate.",
     [](const LiveScene& scene) { return number(scene.work.load().frameDivisor); }},
    {"substeps", "Substeps of a tick.",
     [](const LiveScene& scene) { return number(scene.work.load().substeps); }},
    {"waiting_changes", "Parameter changes that wait for the next tick.",
     [](const LiveScene& scene) { return number(scene.inbox.depth().changes); }},
    {"waiting_poses", "Participants whose poses wait for the next tick.",
     [](const LiveScene& scene) { return number(scene.inbox.depth().poses); }},
    {"price", "Price of the scene: seconds of the device's time per second, by estimate.",
     [](const LiveScene& scene) { return scene.price(); }},
};

// Largest time since which a running scene has no newer state on the disk, in seconds; 0 without any.
double oldestState(const std::vector<std::shared_ptr<LiveScene>>& scenes) {
  double oldest = 0;
  for (const auto& scene : scenes) {
    const auto since = scene->running && scene->keeper ? scene->keeper->unsavedSince() : std::nullopt;
    if (since) oldest = std::max(oldest, schedule::seconds(schedule::Clock::now() - *since));
  }
  return oldest;
}

}  // namespace

Families programFamilies(const std::string& version, const std::string& device) {
  Families families;
  addSample(add(families, MetricType::Gauge, "clothstream_build_info",
                "Always 1. The labels are the version of the server and the name of the device."),
            1, {{"version", version}, {"device", device}});
  const auto gauge = [&](const char* name, const char* help, std::uint64_t value) {
    addSample(add(families, MetricType::Gauge, name, help), static_cast<double>(value));
  };
  const ProcessUsage usage = processUsage();
  gauge("clothstream_process_resident_memory_bytes", "Resident memory of the process.", usage.residentBytes);
  gauge("clothstream_process_open_descriptors", "Open file descriptors of the process.",
        usage.openDescriptors);
  gauge("clothstream_process_threads", "Threads of the process.", usage.threads);
  return families;
}

Families serverFamilies(const hosting::SceneServer& server) {
  const telemetry::ServerMetrics& metrics = server.metrics;
  Families families;
  const auto gauge = [&](const char* name, const char* help, double value) {
    addSample(add(families, MetricType::Gauge, name, help), value);
  };
  const auto counter = [&](const char* name, const char* help, const telemetry::Counter& counted) {
    addSample(add(families, MetricType::Counter, name, help), static_cast<double>(counted.value()));
  };
  gauge("clothstream_scenes", "Scenes of the server.", static_cast<double>(server.scenes.all().size()));
  gauge("clothstream_open_connections", "Open connections.",
        static_cast<double>(server.connections.peers().size()));
  counter("clothstream_connections_total", "Connections admitted.", metrics.connections);
  MetricFamily& sent =
      add(families, MetricType::Counter, "clothstream_sent_bytes_total",
          "Bytes of messages, answers and files that an endpoint has sent, without headers.");
  addSample(sent, static_cast<double>(metrics.grpcBytes.value()), {{"endpoint", "grpc"}});
  addSample(sent, static_cast<double>(metrics.webBytes.value()), {{"endpoint", "web"}});
  MetricFamily& refusals = add(families, MetricType::Counter, "clothstream_refusals_total",
                               "Connections, calls, messages and scenes refused, by reason.");
  for (std::size_t i = 0; i < telemetry::kRefusalNames.size(); ++i)
    addSample(refusals, static_cast<double>(metrics.refusals[i].value()),
              {{"reason", std::string(telemetry::kRefusalNames[i])}});
  counter("clothstream_dropped_connections_total",
          "Connections closed because they were silent, too slow or abusive.", metrics.droppedConnections);
  counter("clothstream_rejected_messages_total", "Messages answered by an error before the client joined.",
          metrics.rejectedMessages);
  counter("clothstream_device_rebuilds_total", "New devices after the device was lost.",
          metrics.deviceRebuilds);
  counter("clothstream_quarantines_total", "Scenes stopped because they harmed others.", metrics.quarantines);
  addSample(add(families, MetricType::Counter, "clothstream_log_lines_omitted_total",
                "Lines of the log that were left out (--profile)."),
            static_cast<double>(telemetry::omittedLogLines()));
  constexpr double kMegabyte = 1e6;
  const scene::Budget::Usage usage = server.budget->usage();
  gauge("clothstream_budget_used_load", "Price of what participants have added, of --max-load.", usage.load);
  gauge("clothstream_budget_free_load", "What is free of --max-load.", usage.freeLoad);
  gauge("clothstream_budget_used_memory_bytes", "Memory of what participants have added, of --max-memory.",
        kMegabyte * usage.megabytes);
  gauge("clothstream_budget_free_memory_bytes", "What is free of --max-memory.",
        kMegabyte * usage.freeMegabytes);
  gauge("clothstream_device_memory_bytes", "Memory of all buffers on the device.",
        static_cast<double>(server.device.deviceMemory()));
  gauge("clothstream_device_reserved_memory_bytes",
        "Memory of the device that the server has allocated, in blocks that buffers share.",
        static_cast<double>(server.device.reservedDeviceMemory()));
  gauge("clothstream_device_silence_seconds", "Time since the last answer of the device thread.",
        schedule::seconds(schedule::Clock::now() - server.device.lastAnswer()));
  gauge("clothstream_publisher_waiting_frames", "Frames that wait for an encoder thread.",
        static_cast<double>(server.publisher.waiting()));
  const scene::StoreStatus store =
      server.options.store ? server.options.store->status() : scene::StoreStatus();
  gauge("clothstream_state_bytes", "Size of the kept scenes on the disk.", static_cast<double>(store.bytes));
  gauge("clothstream_state_waiting", "Scenes with a state or a removal that is not on the disk yet.",
        static_cast<double>(store.waiting));
  gauge("clothstream_state_left_out", "Scenes whose states have no room (--state-limit).",
        static_cast<double>(store.leftOut));
  gauge("clothstream_state_age_seconds",
        "Largest age of the newest state on the disk of a running scene; without one, the time it has run.",
        oldestState(server.scenes.all()));
  const auto total = [&](const char* name, const char* help, std::uint64_t value) {
    addSample(add(families, MetricType::Counter, name, help), static_cast<double>(value));
  };
  const telemetry::DatagramMetrics& datagrams = metrics.datagrams;
  gauge("clothstream_datagram_peers", "Peers whose frames leave in datagrams.",
        static_cast<double>(datagrams.peers));
  counter("clothstream_datagram_packets_total", "Packets with pieces of frames, repeated ones included.",
          datagrams.packets);
  counter("clothstream_datagram_bytes_total", "Bytes of these packets, without headers and encryption.",
          datagrams.bytes);
  counter("clothstream_datagram_lost_packets_total",
          "Packets that have not arrived, by the receipts of peers.", datagrams.lost);
  counter("clothstream_datagram_repeats_total", "Pieces that peers requested and were sent again.",
          datagrams.repeats);
  counter("clothstream_datagram_fallbacks_total",
          "Times that the frames of a peer went back to its stream, because its receipts stopped.",
          datagrams.fallbacks);
  gauge("clothstream_nats_connected", "1 while there is a connection to NATS, else 0.",
        metrics.nats.connected ? 1 : 0);
  MetricFamily& natsMessages = add(
      families, MetricType::Counter, "clothstream_nats_messages_total",
      "Messages through NATS: sent, received, dropped on this side, or refused because they do not belong to "
      "their stream.");
  for (const auto& [kind, counted] : {std::pair{"sent", &metrics.nats.published},
                                      {"received", &metrics.nats.received},
                                      {"dropped", &metrics.nats.dropped},
                                      {"refused", &metrics.nats.refused}})
    addSample(natsMessages, static_cast<double>(counted->value()), {{"kind", kind}});
  MetricFamily& natsBytes = add(families, MetricType::Counter, "clothstream_nats_bytes_total",
                                "Bytes of the messages through NATS.");
  addSample(natsBytes, static_cast<double>(metrics.nats.publishedBytes.value()), {{"kind", "sent"}});
  addSample(natsBytes, static_cast<double>(metrics.nats.receivedBytes.value()), {{"kind", "received"}});
  const scene::ObserverStatus told =
      server.options.observer ? server.options.observer->status() : scene::ObserverStatus();
  MetricFamily& events =
      add(families, MetricType::Counter, "clothstream_events_total",
          "Events for a backend: delivered, dropped, and attempts that failed and are retried.");
  for (const auto& [result, counted] :
       {std::pair{"delivered", told.delivered}, {"retried", told.retried}, {"dropped", told.dropped}})
    addSample(events, static_cast<double>(counted), {{"result", result}});
  total("clothstream_state_writes_total", "Writes to the database of kept scenes.", store.writes);
  total("clothstream_state_failed_writes_total", "Writes to it that failed.", store.failedWrites);
  return families;
}

Families sceneFamilies(const std::vector<std::shared_ptr<LiveScene>>& scenes) {
  const std::string prefix = "clothstream_scene_";
  Families families;
  for (const HistogramRow& row : kSceneHistograms) {
    MetricFamily& family = add(families, MetricType::Histogram, prefix + row.name, row.help);
    for (const auto& scene : scenes)
      addSample(family, (scene->metrics.*row.histogram).buckets(), {{"scene", scene->name()}});
  }
  MetricFamily& stages = add(families, MetricType::Histogram, prefix + "device_stage_seconds",
                             "Time of one stage of a tick on the device.");
  for (const auto& scene : scenes)
    for (const auto& [stage, buckets] : scene->metrics.device.buckets())
      addSample(stages, buckets, {{"scene", scene->name()}, {"stage", std::string(stage)}});
  for (const CounterRow& row : kSceneCounters) {
    MetricFamily& family = add(families, MetricType::Counter, prefix + row.name, row.help);
    for (const auto& scene : scenes)
      addSample(family, static_cast<double>((scene->metrics.*row.counter).value()),
                {{"scene", scene->name()}});
  }
  for (const GaugeRow& row : kSceneGauges) {
    MetricFamily& family = add(families, MetricType::Gauge, prefix + row.name, row.help);
    for (const auto& scene : scenes) addSample(family, row.of(*scene), {{"scene", scene->name()}});
  }
  return families;
}

}  // namespace clothstream::monitoring

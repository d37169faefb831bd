// SPDX-License-Identifier: MIT
#include "server/monitoring/trace_events.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include <nlohmann/json.hpp>

#include "server/telemetry/trace.h"

namespace clothstream::monitoring {
namespace {

using Json = nlohmann::json;

double microseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

Json nameOf(const char* kind, std::uint64_t process, std::size_t thread, std::string_view name) {
  return {{"ph", "M"}, {"name", kind}, {"pid", process}, {"tid", thread}, {"args", {{"name", name}}}};
}

}  // namespace

std::string traceEvents(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes,
                        std::chrono::steady_clock::time_point begin) {
  Json events = Json::array();
  std::uint64_t process = 0;
  for (const std::shared_ptr<scene::LiveScene>& scene : scenes) {
    events.push_back(nameOf("process_name", ++process, 0, scene->name()));
    for (std::size_t i = 0; i < telemetry::kTraceTracks.size(); ++i)
      events.push_back(nameOf("thread_name", process, i, telemetry::kTraceTracks[i]));
    for (const telemetry::TraceSpan& span : scene->metrics.trace.since(begin))
      events.push_back({{"ph", "X"},
                        {"name", span.name},
                        {"cat", "clothstream"},
                        {"pid", process},
                        {"tid", static_cast<std::size_t>(span.track)},
                        {"ts", microseconds(span.start.time_since_epoch())},
                        {"dur", microseconds(span.length)},
                        {"args", {{"tick", span.tick}}}});
  }
  const Json trace{{"displayTimeUnit", "ms"}, {"traceEvents", std::move(events)}};
  // Names of scenes come from clients.
  return trace.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace clothstream::monitoring

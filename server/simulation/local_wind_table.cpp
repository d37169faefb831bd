// SPDX-License-Identifier: MIT
#include "server/simulation/local_wind_table.h"

#include <cassert>
#include <variant>

#include "server/simulation/texel.h"
#include "shaders/mass_spring/local_wind.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::size_t kBytes = model::kMaxLocalWinds * sizeof(shared::LocalWindRecord);

// Quotients are rounded exactly, so that kernels get the same numbers on every machine.
void write(const model::Fan& fan, float speed, shared::LocalWindRecord& record) {
  record.kind = CLOTHSTREAM_FAN;
  record.speed = speed;
  record.size = fan.radius;
  record.spread = fan.spread;
  record.reach = 1 / fan.range;
  record.behind = 1 / fan.radius;
}

void write(const model::Vortex& vortex, float speed, shared::LocalWindRecord& record) {
  record.kind = CLOTHSTREAM_VORTEX;
  record.speed = 2 * speed / vortex.radius;
  record.size = 1 / (vortex.radius * vortex.radius);
  record.reach = 1 / (vortex.reach * vortex.reach);
}

}  // namespace

LocalWindTable::LocalWindTable(const vulkan::Device& device, std::size_t count)
    : count_(static_cast<std::uint32_t>(count)),
      texels_(device, BufferPurpose::texels, kBytes),
      uploads_{Buffer(device, BufferPurpose::upload, kBytes), Buffer(device, BufferPurpose::upload, kBytes)} {
}

void LocalWindTable::recordUpload(vulkan::Recorder& recorder, std::span<const model::LocalWind> winds,
                                  std::uint32_t slot) {
  assert(winds.size() <= model::kMaxLocalWinds);
  count_ = static_cast<std::uint32_t>(winds.size());
  if (count_ == 0) return;
  const auto records = uploads_[slot].mapped<shared::LocalWindRecord>();
  for (std::size_t i = 0; i < winds.size(); ++i) {
    const model::LocalWind& wind = winds[i];
    shared::LocalWindRecord record{};
    record.position = vectorOf(wind.pose.position);
    record.axis = vectorOf(model::axisOf(wind));
    std::visit([&](const auto& kind) { write(kind, wind.speed, record); }, wind.kind);
    records[i] = record;
  }
  recorder.copy(uploads_[slot], texels_, count_ * sizeof(shared::LocalWindRecord));
}

}  // namespace clothstream::simulation

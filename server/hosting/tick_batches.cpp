// SPDX-License-Identifier: MIT
#include "server/hosting/tick_batches.h"

#include "server/scene/slices.h"

namespace clothstream::hosting {

void TickBatches::Members::add(SceneRun& run) {
  run.host->join(batch);
  runs.push_back(&run);
  work.push_back(static_cast<double>(run.host->recordedWork()));
  times.emplace_back();
}

TickBatches::Members& TickBatches::next(vulkan::Device& device) {
  if (used_ == batches_.size()) batches_.push_back(std::make_unique<Members>(device));
  Members& members = *batches_[used_];
  members.batch.begin();
  members.runs.clear();
  members.work.clear();
  members.times.clear();
  return members;
}

void TickBatches::submit(vulkan::Device& device, std::span<SceneRun* const> runs) {
  const double most = scene::Slices::firstSlice(device);
  for (auto run = runs.begin(); run != runs.end();) {
    Members& members = next(device);
    double work = 0;
    do {
      work += static_cast<double>((*run)->host->recordedWork());
      members.add(**run++);
    } while (run != runs.end() && work + static_cast<double>((*run)->host->recordedWork()) <= most);
    members.submitted = device.submit(members.batch);
    ++used_;
  }
}

void TickBatches::clear() {
  batches_.clear();
  used_ = 0;
}

}  // namespace clothstream::hosting

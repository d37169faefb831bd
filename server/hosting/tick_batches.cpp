// SPDX-License-Identifier: MIT
#include "server/hosting/tick_batches.h"

#include "server/scene/slices.h"

namespace clothstream::hosting {

TickBatches::Members& TickBatches::next(vulkan::Device& device) {
  if (used_ == batches_.size()) batches_.push_back(std::make_unique<Members>(device));
  Members& members = *batches_[used_++];
  members.batch.begin();
  members.runs.clear();
  members.submitted = 0;
  return members;
}

void TickBatches::submit(vulkan::Device& device, std::span<SceneRun* const> runs) {
  const double most = scene::Slices::firstSlice(device);
  Members* members = nullptr;
  double work = 0;
  for (SceneRun* run : runs) {
    const auto more = static_cast<double>(run->host->recordedWork());
    if (members == nullptr || (work > 0 && work + more > most)) {
      if (members != nullptr) members->submitted = device.submit(members->batch);
      members = &next(device);
      work = 0;
    }
    run->host->join(members->batch);
    members->runs.push_back(run);
    work += more;
  }
  if (members != nullptr) members->submitted = device.submit(members->batch);
}

void TickBatches::clear() {
  batches_.clear();
  used_ = 0;
}

}  // namespace clothstream::hosting

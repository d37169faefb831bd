// SPDX-License-Identifier: MIT
// Tethers of a scene on the device, with the present slack of the cloths.
#pragma once

#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/attachment/attachment.h"

namespace clothstream::simulation {

// Belongs to the device's thread.
class TetherTable {
 public:
  // `tethers` are by node of the scene, without slack; empty if there are none.
  TetherTable(const vulkan::Device& device, std::vector<shared::TetherRecord> tethers);

  bool empty() const { return rest_.empty(); }

  // Sets the slack from the next upload on. No upload may be in flight. With tethers it must be called before
  // the first upload.
  void setSlack(std::span<const model::Cloth> cloths);
  // Must be recorded before a kernel reads the table. Does nothing if the device has the present slack.
  void recordUpload(vulkan::Recorder& recorder);

  const vulkan::Buffer& texels() const { return table_.texels(); }

 private:
  DeviceTable table_;
  std::vector<shared::TetherRecord> rest_;  // without slack
  std::vector<float> factors_;              // of the lengths in the table, by cloth
  bool outdated_ = false;
};

}  // namespace clothstream::simulation

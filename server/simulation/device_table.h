// SPDX-License-Identifier: MIT
// A table that kernels read.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread.
class DeviceTable {
 public:
  // Bindings need a buffer even without records. Throws std::runtime_error if the device has too little
  // memory.
  template <typename Record>
  DeviceTable(const vulkan::Device& device, const std::vector<Record>& records)
      : upload_(device, vulkan::BufferPurpose::upload,
                std::max<std::size_t>(1, records.size()) * sizeof(Record)),
        texels_(device, vulkan::BufferPurpose::texels, upload_.bytes()) {
    if (!records.empty()) set(records);
  }

  // Replaces the records by as many others, from the next upload on. No upload may be in flight.
  template <typename Record>
  void set(const std::vector<Record>& records) {
    assert(records.size() * sizeof(Record) == upload_.bytes());
    std::memcpy(upload_.mapped().data(), records.data(), upload_.bytes());
  }

  // Must be recorded before a kernel reads the table.
  void recordUpload(vulkan::Recorder& recorder) const { recorder.copy(upload_, texels_, upload_.bytes()); }

  const vulkan::Buffer& texels() const { return texels_; }

 private:
  vulkan::Buffer upload_, texels_;
};

}  // namespace clothstream::simulation

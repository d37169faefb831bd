// SPDX-License-Identifier: MIT
// Speed at which the device moves bytes.
#include "tests/bench/bytes_moved.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "kernels/copy_texels.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {

using vulkan::Buffer;
using vulkan::BufferPurpose;

double secondsToCopyTexels(vulkan::Device& device, std::size_t texels) {
  const std::size_t bytes = texels * 16;
  const Buffer from(device, BufferPurpose::texels, bytes);
  const Buffer to(device, BufferPurpose::state, bytes);
  const Buffer sample(device, BufferPurpose::readback, 16);
  constexpr std::uint32_t kWorkgroup = 256;
  const vulkan::Bindings bindings(device, {device, kernels::copy_texels, kWorkgroup}, {&from, &to});
  vulkan::Recorder recorder(device);
  const bool kernelFits = (texels + kWorkgroup - 1) / kWorkgroup <= device.limits().maxDispatchX;

  double least = std::numeric_limits<double>::infinity();
  const auto measure = [&](std::uint32_t pattern, const auto& copy) {
    // Uses enough copies to hide the overhead of a call, and the best of several rounds.
    const std::size_t copies = std::clamp<std::size_t>((64u << 20) / bytes, 1, 256);
    for (int round = 0; round < 7; ++round) {
      runOn(device, recorder, [&] { recorder.fill(from, pattern, bytes); });
      const double seconds = secondsOf([&] {
        runOn(device, recorder, [&] {
          for (std::size_t i = 0; i < copies; ++i) {
            recorder.barrier();
            copy();
          }
        });
      });
      least = std::min(least, seconds / static_cast<double>(copies));
    }
    runOn(device, recorder, [&] { recorder.copy(to, sample, 16, bytes - 16); });
    for (const std::uint32_t word : sample.mapped<const std::uint32_t>())
      if (word != pattern) throw std::runtime_error("the device copied wrong bytes");
  };
  measure(0x3F800000u, [&] { recorder.copy(from, to, bytes); });
  if (kernelFits) measure(0x40000000u, [&] { recorder.dispatch(bindings, texels); });
  return least;
}

}  // namespace clothstream::bench

// SPDX-License-Identifier: MIT
// The shared form of a kernel: one dispatch of it runs the kernel for several sets of buffers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace clothstream::vulkan {

// One dispatch of the kernel within a dispatch of the shared form. Row y of workgroups (gl_WorkGroupID.y)
// runs entry y. The push constants of the shared form are one std::uint64_t, the address of the array of
// entries. A dispatch has as many rows as the array has entries, and as many workgroups in x as the largest
// entry: the others end at once. gl_NumWorkGroups reads as (groups, 1, 1).
struct SharedEntry {
  std::uint64_t record = 0;  // address of the buffers; not read if the kernel has no bindings
  std::uint64_t push = 0;    // address of the push constants; not read if the kernel has none
  std::uint32_t groups = 0;  // workgroups in x
  std::uint32_t unused = 0;
};
static_assert(sizeof(SharedEntry) == 24);

// A record describes the buffers of an entry: the address of each buffer in the order of the bindings
// (SpirvInterface::bindings), and then the bytes of each as std::uint32_t.
constexpr std::size_t addressInRecord(std::size_t binding) {
  return binding * sizeof(std::uint64_t);
}
constexpr std::size_t bytesInRecord(std::size_t bindings, std::size_t binding) {
  return bindings * sizeof(std::uint64_t) + binding * sizeof(std::uint32_t);
}
constexpr std::size_t bytesOfRecord(std::size_t bindings) {
  return bytesInRecord(bindings, bindings);
}

// Addresses of buffers and of push constants are multiples of kSharedAlignment, those of entries and records
// of 8. Entries, records and push constants do not change while the dispatch runs.
constexpr std::size_t kSharedAlignment = 16;

// Code of the shared form of a kernel, from the kernel's code (SPIR-V 1.5 with one entry point and bindings
// in set 0). Every invocation executes the instructions of the kernel on the same values, so that results
// have the same bits. Buffers, texels (RGBA32F) and push constants are read through addresses; accesses
// outside a buffer are undefined, those of texels too. Constants and workgroup size can be specialised as
// before. Needs the feature bufferDeviceAddress. Throws std::runtime_error that says what has no shared form.
std::vector<std::uint32_t> sharedCode(std::span<const std::uint32_t> spirv);

}  // namespace clothstream::vulkan

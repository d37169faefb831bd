// SPDX-License-Identifier: MIT
#include "tests/faults/lack_of_memory.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <new>
#include <span>
#include <string_view>
#include <utility>

#include <execinfo.h>
#include <link.h>
#include <sys/prctl.h>

namespace clothstream::tests {
namespace {

using Name = std::array<std::uint64_t, 2>;

// The failures that are in force. `mutex` guards all but the first two, which every allocation reads.
struct InForce {
  std::atomic<bool> inForce{false};
  std::array<std::atomic<std::uint64_t>, 2> thread{};
  std::mutex mutex;
  Failures failures;
  std::chrono::steady_clock::time_point end{};
  std::uint64_t allocations = 0, failed = 0, random = 0;
};
InForce state;

// True while the thread decides about an allocation: what that allocates succeeds.
thread_local bool deciding = false;

struct Range {
  std::uintptr_t begin = 0, end = 0;
};
// Code of the excluded modules that were loaded at the time of these counts. Guarded by `mutex`.
struct Excluded {
  std::array<Range, 64> ranges;
  std::size_t count = 0;
  unsigned long long loaded = 0, unloaded = 0;
};
Excluded excluded;

// Programs that end the process when an allocation fails: drivers, validation layers and gRPC.
constexpr std::array<std::string_view, 7> kExcluded{"libLLVM", "libvulkan", "VkLayer",   "libgrpc",
                                                    "libgpr.", "libabsl_",  "libgallium"};

// A server that rebuilds its device loads the driver again, often at another address.
void findExcluded() {
  bool isFirst = true;
  auto add = [&](const dl_phdr_info& module) {
    if (std::exchange(isFirst, false)) {
      if (module.dlpi_adds == excluded.loaded && module.dlpi_subs == excluded.unloaded) return 1;
      excluded.loaded = module.dlpi_adds;
      excluded.unloaded = module.dlpi_subs;
      excluded.count = 0;
    }
    const std::string_view name = module.dlpi_name;
    if (std::ranges::none_of(kExcluded, [&](auto part) { return name.find(part) != name.npos; })) return 0;
    for (int i = 0; i < module.dlpi_phnum; ++i) {
      const auto& part = module.dlpi_phdr[i];
      if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
      if (excluded.count == excluded.ranges.size()) std::abort();
      excluded.ranges[excluded.count++] = {module.dlpi_addr + part.p_vaddr,
                                           module.dlpi_addr + part.p_vaddr + part.p_memsz};
    }
    return 0;
  };
  ::dl_iterate_phdr(
      [](dl_phdr_info* module, std::size_t, void* to) { return (*static_cast<decltype(add)*>(to))(*module); },
      &add);
}

bool isExcluded() {
  findExcluded();
  std::array<void*, 96> frames{};
  const int count = ::backtrace(frames.data(), static_cast<int>(frames.size()));
  const auto ranges = std::span(excluded.ranges).first(excluded.count);
  return std::any_of(frames.begin(), frames.begin() + count, [&](void* frame) {
    const auto at = reinterpret_cast<std::uintptr_t>(frame);
    return std::ranges::any_of(ranges,
                               [&](const Range& range) { return at >= range.begin && at < range.end; });
  });
}

// A random number of 0 to 1 (splitmix64).
double random(std::uint64_t step) {
  std::uint64_t value = step * 0x9e3779b97f4a7c15u;
  value = (value ^ value >> 30) * 0xbf58476d1ce4e5b9u;
  value = (value ^ value >> 27) * 0x94d049bb133111ebu;
  return static_cast<double>((value ^ value >> 31) >> 11) * 0x1p-53;
}

Name nameOfThisThread() {
  Name name{};
  ::prctl(PR_GET_NAME, name.data());
  return name;
}

bool decide(std::size_t bytes) {
  const Name name = nameOfThisThread();
  if (name[0] != state.thread[0] || name[1] != state.thread[1]) return false;
  const std::lock_guard lock(state.mutex);
  const Failures& failures = state.failures;
  if (!state.inForce || bytes < failures.leastBytes || state.failed >= failures.count ||
      std::chrono::steady_clock::now() >= state.end || isExcluded() || state.allocations++ < failures.from ||
      random(failures.seed + ++state.random) >= failures.probability)
    return false;
  ++state.failed;
  return true;
}

bool fails(std::size_t bytes) {
  if (!state.inForce || deciding) return false;
  deciding = true;
  const bool result = decide(bytes);
  deciding = false;
  return result;
}

}  // namespace

std::string threadName() {
  return reinterpret_cast<const char*>(nameOfThisThread().data());
}

void setThreadName(const std::string& name) {
  ::prctl(PR_SET_NAME, name.c_str());
}

std::vector<int> threadsNamed(const std::string& name) {
  std::vector<int> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string found;
    if (!std::getline(std::ifstream(entry.path() / "comm"), found) || found != name) continue;
    threads.push_back(std::stoi(entry.path().filename().string()));
  }
  std::ranges::sort(threads);
  return threads;
}

void renameThread(int id, const std::string& name) {
  std::ofstream("/proc/self/task/" + std::to_string(id) + "/comm") << name;
}

LackOfMemory::LackOfMemory(const std::string& thread, const Failures& failures) {
  const std::lock_guard lock(state.mutex);
  isExcluded();  // the first call loads a library
  Name name{};
  std::memcpy(name.data(), thread.data(), std::min(thread.size(), sizeof name - 1));
  std::ranges::copy(name, state.thread.begin());
  state.failures = failures;
  state.end = std::chrono::steady_clock::now() + failures.time;
  state.allocations = state.failed = state.random = 0;
  state.inForce = true;
}

LackOfMemory::~LackOfMemory() {
  const std::lock_guard lock(state.mutex);
  state.inForce = false;
}

std::uint64_t LackOfMemory::failed() const {
  const std::lock_guard lock(state.mutex);
  return state.failed;
}

bool LackOfMemory::isOver() const {
  const std::lock_guard lock(state.mutex);
  return state.failed == state.failures.count || std::chrono::steady_clock::now() >= state.end;
}

}  // namespace clothstream::tests

// protobuf leaks the members of a message whose copy is interrupted.
#if defined(__SANITIZE_ADDRESS__)
extern "C" int __lsan_is_turned_off() {
  return 1;
}
#endif

// The thread sanitizer replaces these operators itself. The address sanitizer checks malloc() and free().
#if !defined(__SANITIZE_THREAD__)
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return clothstream::tests::fails(bytes) ? nullptr : std::malloc(std::max<std::size_t>(bytes, 1));
}

void* operator new(std::size_t bytes) {
  if (void* memory = ::operator new(bytes, std::nothrow)) return memory;
  throw std::bad_alloc();
}

void* operator new(std::size_t bytes, std::align_val_t alignment) {
  if (clothstream::tests::fails(bytes)) throw std::bad_alloc();
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (std::max<std::size_t>(bytes, 1) + step - 1) / step * step))
    return memory;
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
#endif

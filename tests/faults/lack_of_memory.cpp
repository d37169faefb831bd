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
#include <new>
#include <span>
#include <string_view>

#include <execinfo.h>
#include <link.h>
#include <sys/prctl.h>

namespace clothstream::tests {
namespace {

using Name = std::array<char, 16>;

// The failures that are in force. Threads read them while `inForce` is true, and nothing changes them then.
struct InForce {
  std::atomic<bool> inForce{false};
  Name thread{};
  Failures failures;
  std::chrono::steady_clock::time_point end{};
  std::atomic<std::uint64_t> allocations{0}, failed{0}, random{0};
};
InForce state;

// True while the thread decides about an allocation: what that allocates succeeds.
thread_local bool deciding = false;

struct Range {
  std::uintptr_t begin = 0, end = 0;
};
std::array<Range, 64> excluded;
std::size_t excludedCount = 0;

// Programs that end the process when an allocation fails: drivers, validation layers and gRPC.
constexpr std::array<std::string_view, 7> kExcluded{"libLLVM", "libvulkan", "VkLayer",   "libgrpc",
                                                    "libgpr.", "libabsl_",  "libgallium"};

void findExcluded() {
  excludedCount = 0;
  ::dl_iterate_phdr(
      [](dl_phdr_info* module, std::size_t, void*) {
        const std::string_view name = module->dlpi_name;
        if (std::ranges::none_of(kExcluded, [&](auto part) { return name.find(part) != name.npos; }))
          return 0;
        for (int i = 0; i < module->dlpi_phnum; ++i) {
          const auto& part = module->dlpi_phdr[i];
          if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
          if (excludedCount == excluded.size()) std::abort();
          excluded[excludedCount++] = {module->dlpi_addr + part.p_vaddr,
                                       module->dlpi_addr + part.p_vaddr + part.p_memsz};
        }
        return 0;
      },
      nullptr);
}

bool isExcluded() {
  std::array<void*, 96> frames{};
  const int count = ::backtrace(frames.data(), static_cast<int>(frames.size()));
  const auto ranges = std::span(excluded).first(excludedCount);
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

bool fails(std::size_t bytes) {
  if (!state.inForce.load(std::memory_order_acquire) || deciding || bytes < state.failures.leastBytes)
    return false;
  Name name{};
  ::prctl(PR_GET_NAME, name.data());
  if (name != state.thread || state.failed >= state.failures.count ||
      std::chrono::steady_clock::now() >= state.end)
    return false;
  deciding = true;
  bool result = !isExcluded() && state.allocations++ >= state.failures.from &&
                random(state.failures.seed + ++state.random) < state.failures.probability;
  if (result) result = state.failed++ < state.failures.count;
  deciding = false;
  return result;
}

}  // namespace

std::string threadName() {
  Name name{};
  ::prctl(PR_GET_NAME, name.data());
  return name.data();
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
  findExcluded();
  isExcluded();  // the first call loads a library
  state.thread = {};
  std::copy_n(thread.begin(), std::min(thread.size(), state.thread.size() - 1), state.thread.begin());
  state.failures = failures;
  state.end = std::chrono::steady_clock::now() + failures.time;
  state.allocations = state.failed = state.random = 0;
  state.inForce.store(true, std::memory_order_release);
}

LackOfMemory::~LackOfMemory() {
  state.inForce = false;
}

std::uint64_t LackOfMemory::failed() const {
  return std::min<std::uint64_t>(state.failed, state.failures.count);
}

bool LackOfMemory::isOver() const {
  return failed() == state.failures.count || std::chrono::steady_clock::now() >= state.end;
}

}  // namespace clothstream::tests

// The sanitizers have allocators that check more than these.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void* operator new(std::size_t bytes) {
  if (clothstream::tests::fails(bytes)) throw std::bad_alloc();
  if (void* memory = std::malloc(std::max<std::size_t>(bytes, 1))) return memory;
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

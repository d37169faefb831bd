// SPDX-License-Identifier: MIT
// Replaces operator new and delete inside the library. The library contains its own C++ library and exports
// neither, so the program's operators stay as they are.
#include "clients/library/allocation.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#ifdef _WIN32
#include <malloc.h>
#endif

namespace clothstream {
namespace {

#ifdef _WIN32
void* allocateFromC(void*, std::size_t bytes, std::size_t alignment) noexcept {
  return _aligned_malloc(bytes, alignment);
}

void releaseToC(void*, void* memory) noexcept {
  _aligned_free(memory);
}
#else
void* allocateFromC(void*, std::size_t bytes, std::size_t alignment) noexcept {
  if (alignment <= alignof(std::max_align_t)) return std::malloc(bytes);
  return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}

void releaseToC(void*, void* memory) noexcept {
  std::free(memory);
}
#endif

// Written only before the library allocates anything for a stream.
constinit clothstream_allocator active{CLOTHSTREAM_ALLOCATOR_VERSION, nullptr, &allocateFromC, &releaseToC};

// Memory from the C library, which goes back to it although the allocator has changed. Constructors of static
// objects allocate a few bytes when the library is loaded (Boost.Asio: its use of OpenSSL).
constinit std::array<std::atomic<void*>, 8> early{};
constinit std::atomic<std::size_t> earlyCount{0};  // all allocations so far, while the allocator is that of C

void* allocate(std::size_t bytes, std::size_t alignment) noexcept {
  void* const memory = active.allocate(active.context, bytes == 0 ? 1 : bytes, alignment);
  if (active.allocate == &allocateFromC && earlyCount.load(std::memory_order_relaxed) <= early.size())
    if (const std::size_t i = earlyCount.fetch_add(1, std::memory_order_relaxed); i < early.size())
      early[i].store(memory, std::memory_order_relaxed);
  return memory;
}

void* allocateOrThrow(std::size_t bytes, std::size_t alignment) {
  void* const memory = allocate(bytes, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void release(void* memory) noexcept {
  if (memory == nullptr) return;
  for (std::atomic<void*>& kept : early) {
    if (kept.load(std::memory_order_relaxed) != memory) continue;
    kept.store(nullptr, std::memory_order_relaxed);
    return releaseToC(nullptr, memory);
  }
  active.release(active.context, memory);
}

}  // namespace

std::string useAllocator(const clothstream_allocator& allocator) {
  if (active.allocate != &allocateFromC || earlyCount.load(std::memory_order_relaxed) > early.size())
    return "The library already uses memory; call clothstream_set_allocator once, before all other "
           "functions.";
  active = allocator;
  return {};
}

}  // namespace clothstream

namespace {
constexpr std::size_t kDefaultAlignment = __STDCPP_DEFAULT_NEW_ALIGNMENT__;
}  // namespace

void* operator new(std::size_t bytes) {
  return clothstream::allocateOrThrow(bytes, kDefaultAlignment);
}
void* operator new[](std::size_t bytes) {
  return clothstream::allocateOrThrow(bytes, kDefaultAlignment);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return clothstream::allocateOrThrow(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return clothstream::allocateOrThrow(bytes, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return clothstream::allocate(bytes, kDefaultAlignment);
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return clothstream::allocate(bytes, kDefaultAlignment);
}
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return clothstream::allocate(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return clothstream::allocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  clothstream::release(memory);
}
void operator delete[](void* memory) noexcept {
  clothstream::release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  clothstream::release(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  clothstream::release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  clothstream::release(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  clothstream::release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  clothstream::release(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  clothstream::release(memory);
}

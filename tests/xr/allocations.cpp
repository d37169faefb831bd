// SPDX-License-Identifier: MIT
// The linker redirects malloc, calloc and realloc to these functions (--wrap).
#include "tests/xr/allocations.h"

#include <cstdlib>
#include <new>
#include <stdexcept>

#include <clothstream/clothstream.h>

namespace {
thread_local std::size_t allocations = 0, libraryAllocations = 0;
}

extern "C" {
void* __real_malloc(std::size_t);
void* __real_calloc(std::size_t, std::size_t);
void* __real_realloc(void*, std::size_t);
void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* memory, std::size_t size) {
  ++allocations;
  return __real_realloc(memory, size);
}
}

void* operator new(std::size_t size) {
  void* memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace clothstream::xr::tests {

Allocations::Allocations() : before_(allocations), libraryBefore_(libraryAllocations) {}
std::size_t Allocations::count() const {
  return allocations - before_;
}

std::size_t Allocations::ofLibrary() const {
  return libraryAllocations - libraryBefore_;
}

void countAllocationsOfLibrary() {
  clothstream_allocator allocator{};
  allocator.version = CLOTHSTREAM_ALLOCATOR_VERSION;
  allocator.allocate = [](void*, std::size_t bytes, std::size_t alignment) -> void* {
    ++libraryAllocations;
    if (alignment <= alignof(std::max_align_t)) return __real_malloc(bytes);
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  };
  allocator.release = [](void*, void* memory) { std::free(memory); };
  if (clothstream_set_allocator(&allocator) != CLOTHSTREAM_OK)
    throw std::runtime_error(clothstream_error_text());
}

}  // namespace clothstream::xr::tests

// SPDX-License-Identifier: MIT
// What the C++ run-time library would need a terminal and exceptions for: in WebAssembly a throw and lack of
// memory trap.
//
// No throw is reached by bytes from outside: wire.h checks a message before protozero reads it. Without these
// the module would import file functions only to print why it ends.
#include <cstddef>
#include <cstdlib>
#include <new>

// NOLINTBEGIN(bugprone-reserved-identifier): names of the C++ ABI.
extern "C" {

[[noreturn]] void* __cxa_allocate_exception(std::size_t) {
  __builtin_trap();
}

[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) {
  __builtin_trap();
}

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier)

void* operator new(std::size_t bytes) {
  void* memory = std::malloc(bytes == 0 ? 1 : bytes);
  if (!memory) __builtin_trap();
  return memory;
}

void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(bytes == 0 ? 1 : bytes);
}

void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(bytes == 0 ? 1 : bytes);
}

void operator delete(void* memory) noexcept {
  std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

// SPDX-License-Identifier: MIT
// Replaces the parts of the C++ runtime that need exceptions or a terminal. In WebAssembly, a throw and a
// failed allocation trap.
//
// Input bytes cannot cause a throw: wire.h checks a message before protozero reads it. Without these
// functions the module would import file functions, only to print an error.
#include <cstddef>
#include <cstdlib>
#include <new>

// NOLINTBEGIN(bugprone-reserved-identifier): the C++ ABI defines these names.
extern "C" {

[[noreturn]] void* __cxa_allocate_exception(std::size_t) {
  __builtin_trap();
}

[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) {
  __builtin_trap();
}

// libc++ calls this for errors that cannot be reported otherwise.
[[noreturn]] void abort_message(const char*, ...) {
  __builtin_trap();
}

}  // extern "C"

// And this since its release 15, for those of its own checks.
#ifndef _LIBCPP_VERBOSE_ABORT_NOEXCEPT  // since release 20
#define _LIBCPP_VERBOSE_ABORT_NOEXCEPT
#endif
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) _LIBCPP_VERBOSE_ABORT_NOEXCEPT {
  __builtin_trap();
}
_LIBCPP_END_NAMESPACE_STD
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

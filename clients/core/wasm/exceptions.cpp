// SPDX-License-Identifier: MIT
// What a throw of a header-only library links to in WebAssembly, where there are no exceptions: a trap.
//
// None is reached by bytes from outside: wire.h checks a message before protozero reads it.
#include <cstddef>

extern "C" {

[[noreturn]] void* __cxa_allocate_exception(std::size_t) { __builtin_trap(); }

[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }

}  // extern "C"

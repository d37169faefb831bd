// SPDX-License-Identifier: MIT
// Keeps Vulkan drivers and layers loaded until the program ends, for programs with the address sanitizer.
// After dlclose(), memory that a driver's variables point at counts as leaked (for example Mesa's table of
// caches of AMD processors), and a suppression cannot name a library that is not loaded.

extern "C" int dlclose(void* /*library*/) noexcept {
  return 0;
}

// SPDX-License-Identifier: MIT
// tinygltf, compiled once from its header. Debian's shared library is not available on machines that programs
// are carried to.
#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>

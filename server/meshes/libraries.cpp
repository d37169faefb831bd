// SPDX-License-Identifier: MIT
// Compiles tinyobjloader and tinygltf from their headers. Programs that are copied to other machines cannot
// rely on shared libraries there.
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>

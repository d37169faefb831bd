// SPDX-License-Identifier: MIT
// tinyobjloader and tinygltf, compiled in from their headers: programs that are carried to other machines
// cannot count on Debian's shared ones.
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>

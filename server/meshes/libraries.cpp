// SPDX-License-Identifier: MIT
// tinyobjloader, compiled from its header. Debian's shared library is not available on machines that programs
// are carried to.
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

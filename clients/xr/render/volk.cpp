// SPDX-License-Identifier: MIT
// The functions of volk, which loads Vulkan at run time. Debian has them as a header.
#define VOLK_IMPLEMENTATION
#include <volk.h>

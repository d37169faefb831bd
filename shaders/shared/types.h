// SPDX-License-Identifier: MIT
// The scalar types and the namespace of what C++ and GLSL both include.
#ifndef CLOTHSTREAM_SHADERS_SHARED_TYPES_H
#define CLOTHSTREAM_SHADERS_SHARED_TYPES_H

#ifdef __cplusplus

#include <cstddef>
#include <cstdint>

#define CLOTHSTREAM_SHARED_BEGIN namespace clothstream::shared {
#define CLOTHSTREAM_SHARED_END }
#define CLOTHSTREAM_SHARED_FUNCTION inline

namespace clothstream::shared {
using std::uint32_t;

struct alignas(16) vec4 {
  float x, y, z, w;
};
}  // namespace clothstream::shared

#else

#define CLOTHSTREAM_SHARED_BEGIN
#define CLOTHSTREAM_SHARED_END
#define CLOTHSTREAM_SHARED_FUNCTION
#define uint32_t uint

#endif

#endif

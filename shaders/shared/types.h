// SPDX-License-Identifier: MIT
// Scalar types, vectors and the namespace of headers that C++ and GLSL both include.
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

// Three floats without padding. A float follows a vec3 in every shared struct, so that C++ and std430 agree.
struct vec3 {
  float x, y, z;
};

struct alignas(16) vec4 {
  float x, y, z, w;
};
}  // namespace clothstream::shared

#else

#define CLOTHSTREAM_SHARED_BEGIN
#define CLOTHSTREAM_SHARED_END
#define CLOTHSTREAM_SHARED_FUNCTION
#define uint32_t uint

// Arguments of a record's constructor from a texel: four floats, or a vec3 and a float.
#define CLOTHSTREAM_FLOATS(texel) (texel).x, (texel).y, (texel).z, (texel).w
#define CLOTHSTREAM_VECTOR(texel) (texel).xyz, (texel).w

#endif

#endif

// SPDX-License-Identifier: MIT
// Local winds as the kernels read them. server/model/local_wind.h has their fields of velocity.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_LOCAL_WIND_H
#define CLOTHSTREAM_SHADERS_MASS_SPRING_LOCAL_WIND_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

#define CLOTHSTREAM_LOCAL_WIND_TEXELS 3
#define CLOTHSTREAM_FAN 0.0
#define CLOTHSTREAM_VORTEX 1.0
struct LocalWindRecord {
  vec3 position;  // m
  float kind;

  vec3 axis;
  float speed;  // m/s; of a vortex, 1/s: twice the speed divided by the radius

  float size;    // of a fan, m: the radius; of a vortex, 1/m^2: the inverse square of the radius
  float spread;  // of a fan
  // A fan has the inverse of its range here (1/m), a vortex the inverse square of its reach (1/m^2).
  float reach;
  float behind;  // of a fan, 1/m: the inverse of the radius
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(LocalWindRecord) == CLOTHSTREAM_LOCAL_WIND_TEXELS * sizeof(vec4));
}  // namespace clothstream::shared
#else

LocalWindRecord localWindRecordAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_LOCAL_WIND_TEXELS * int(number);
  vec4 place = texelFetch(table, first);
  vec4 motion = texelFetch(table, first + 1);
  vec4 shape = texelFetch(table, first + 2);
  return LocalWindRecord(CLOTHSTREAM_VECTOR(place), CLOTHSTREAM_VECTOR(motion), CLOTHSTREAM_FLOATS(shape));
}

#endif

#endif

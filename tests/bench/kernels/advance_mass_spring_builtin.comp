// SPDX-License-Identifier: MIT
// advance_mass_spring with the device's own arithmetic. The difference is the cost of identical bits on all
// devices.
#version 450
#extension GL_GOOGLE_include_directive : require

#define CLOTHSTREAM_BUILTIN_ARITHMETIC
#define precise

#include "shaders/mass_spring/advance_mass_spring.glsl"

// SPDX-License-Identifier: MIT
// One substep of the mass-spring model for every node of a scene's grids.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/mass_spring/advance_mass_spring.glsl"

// SPDX-License-Identifier: MIT
// Places of the numbers that a solve for stretched springs keeps, for the kernels that read them.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_STRETCHED_TABLES_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_STRETCHED_TABLES_GLSL

// Tables in `lists`, each with a number for every node of the scene. A head of each system follows.
// - kMasks, by walk: the nodes that are solved for (4 bits), and those of the round before (4 bits).
// - kFirsts, by walk: the place of its first such node in kNodes.
// - kFlags, by walk: 1 if it must be tested.
// - kTested: the walks to test. kWalks: the walks with nodes to solve for. kNodes: these nodes.
const uint kMasks = 0, kFirsts = 1, kFlags = 2, kTested = 3, kWalks = 4, kNodes = 5, kTables = 6;
// A head in `lists`: walks and nodes listed, most texels of springs, stretched springs, round, 1 if a wide
// workgroup continues.
const uint kHead = 8;
// A vector of the solve (linear_system.glsl), by place in kNodes: the position; w: texels of springs.
const uint kPlaces = 6;

#endif

// SPDX-License-Identifier: MIT
// Tables and push constants of the report, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_REPORT_REPORT_H
#define CLOTHSTREAM_SHADERS_REPORT_REPORT_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Sums are made in an order that is fixed by these numbers alone: a cloth is cut into blocks of nodes that
// follow each other, node i of a block belongs to run i % kReportRuns, and the runs of a cloth add up in
// kReportLanes lanes and a tree.
const uint32_t kReportBlock = 4096;
const uint32_t kReportRuns = 64;
const uint32_t kReportLanes = 256;
// Nodes of a block that are looked for in colliders by one invocation.
const uint32_t kReportDepths = 8;

// Bins of stretch. The first counts all below 2^-20, contracted springs too; from there on 32 of equal width
// an octave, up to 2^6; the last counts what is beyond.
const uint32_t kStretchOctave = 32;
const uint32_t kStretchFirst = (127 - 20) * 32;  // the upper 14 bits of 2^-20 as a float
const uint32_t kStretchBins = 26 * 32 + 2;
// Of a cloth: its bins, then the bits of its deepest penetration, m.
const uint32_t kReportCounts = 26 * 32 + 3;

// A cloth; texels.
#define CLOTHSTREAM_REPORT_CLOTH_TEXELS 2
struct ReportClothRecord {
  vec4 stiffness;  // structural, shear, bend, whether they are forces or constraints
  vec4 blocks;     // the first, how many
};

// A block; a texel.
struct ReportBlockRecord {
  vec4 place;  // cloth; the first node, of the cloth, and of all meshes where the cloth is one
};

// Of a run, and of a cloth.
struct ReportSums {
  float largest;  // stretch
  float strain;   // sum of absolute stretches
  float kinetic;  // J
  float elastic;
  float gravity;
  float reserved0, reserved1, reserved2;
};

struct MeasurePush {
  vec4 gravity;
  uint32_t blockCount;
  uint32_t reserved0, reserved1, reserved2;
};

struct PenetrationPush {
  CollisionPush collision;
  uint32_t blockCount;
  uint32_t reserved0, reserved1, reserved2;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(ReportClothRecord) == CLOTHSTREAM_REPORT_CLOTH_TEXELS * sizeof(vec4));
static_assert(sizeof(ReportSums) == 32 && sizeof(MeasurePush) == 32 && sizeof(PenetrationPush) == 48);
static_assert(kReportCounts == kStretchBins + 1 && kReportBlock % (kReportRuns * kReportDepths) == 0);
}  // namespace clothstream::shared
#endif

#endif

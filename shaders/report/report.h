// SPDX-License-Identifier: MIT
// Tables and push constants of the report. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_REPORT_REPORT_H
#define CLOTHSTREAM_SHADERS_REPORT_REPORT_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// These numbers alone fix the order of the sums. A cloth is cut into blocks of consecutive nodes, and node i
// of a block belongs to run i % kReportRuns. The runs of a cloth add up in kReportLanes lanes and a tree.
const uint32_t kReportBlock = 4096;
const uint32_t kReportRuns = 64;
const uint32_t kReportLanes = 256;
// Nodes of a block whose penetration one invocation measures.
const uint32_t kReportDepths = 8;

// Bins of stretch. The first bin counts every stretch below 2^-20, and contracted springs. From there each
// octave up to 2^6 has 32 bins of equal width. The last bin counts the rest.
const uint32_t kStretchOctave = 32;
const uint32_t kStretchFirst = (127 - 20) * 32;  // upper 14 bits of 2^-20 as a float
const uint32_t kStretchBins = 26 * 32 + 2;
// Words per cloth: its bins, then the bits of its deepest penetration, m.
const uint32_t kReportCounts = 26 * 32 + 3;

// One cloth.
#define CLOTHSTREAM_REPORT_CLOTH_TEXELS 2
struct ReportClothRecord {
  float structuralStiffness;  // N/m, also of springs that are constraints
  float shearStiffness;
  float bendStiffness;
  float reserved0;
  float firstBlock;
  float blockCount;
  float reserved1, reserved2;
};

// One block of nodes.
struct ReportBlockRecord {
  float cloth;
  float firstNode;      // in the cloth
  float firstMeshNode;  // among the nodes of all meshes, if the cloth is a mesh
  float reserved;
};

// Sums of a run or of a cloth.
struct ReportSums {
  float largest;  // stretch
  float strain;   // sum of absolute stretches
  float kinetic;  // J
  float elastic;
  float gravity;
  float reserved0, reserved1, reserved2;
};

struct MeasurePush {
  vec4 gravity;  // w: gravity times the origin of the positions
  uint32_t blockCount;
  uint32_t reserved0, reserved1, reserved2;
};

struct PenetrationPush {
  CollisionPush collision;
  uint32_t blockCount;
  uint32_t solidCount;  // colliders that are triangle meshes; their numbers follow those of the others
  uint32_t reserved0, reserved1;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(ReportClothRecord) == CLOTHSTREAM_REPORT_CLOTH_TEXELS * sizeof(vec4));
static_assert(sizeof(ReportBlockRecord) == 16 && sizeof(ReportSums) == 32 && sizeof(MeasurePush) == 32 &&
              sizeof(PenetrationPush) == 48);
static_assert(kReportCounts == kStretchBins + 1 && kReportBlock % (kReportRuns * kReportDepths) == 0);
}  // namespace clothstream::shared
#else

ReportClothRecord reportClothAt(samplerBuffer table, uint cloth) {
  int first = CLOTHSTREAM_REPORT_CLOTH_TEXELS * int(cloth);
  vec4 stiffness = texelFetch(table, first);
  vec4 blocks = texelFetch(table, first + 1);
  return ReportClothRecord(CLOTHSTREAM_FLOATS(stiffness), CLOTHSTREAM_FLOATS(blocks));
}

ReportBlockRecord reportBlockAt(samplerBuffer table, uint block) {
  vec4 texel = texelFetch(table, int(block));
  return ReportBlockRecord(CLOTHSTREAM_FLOATS(texel));
}

#endif

#endif

// SPDX-License-Identifier: MIT
// Adds up the sums of a cloth from those of its runs, one workgroup per cloth. The lanes and the tree of the
// sums do not depend on the workgroup's size. Writes cannot race: between barriers a lane belongs to one
// invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/report/report.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer reportCloths;  // ReportClothRecord
layout(std430, binding = 1) readonly buffer Runs {
  ReportSums runs[];
};
layout(std430, binding = 2) writeonly buffer Sums {
  ReportSums sums[];  // by cloth
};

shared float largest[kReportLanes];
shared vec4 lanes[kReportLanes];

void main() {
  ReportClothRecord cloth = reportClothAt(reportCloths, gl_WorkGroupID.x);
  uint first = uint(cloth.firstBlock) * kReportRuns;
  uint end = first + uint(cloth.blockCount) * kReportRuns;
  for (uint lane = gl_LocalInvocationID.x; lane < kReportLanes; lane += gl_WorkGroupSize.x) {
    float most = -1e30;
    precise vec4 sum = vec4(0.0);
    for (uint run = first + lane; run < end; run += kReportLanes) {
      ReportSums of = runs[run];
      most = max(most, of.largest);
      sum = sum + vec4(of.strain, of.kinetic, of.elastic, of.gravity);
    }
    largest[lane] = most;
    lanes[lane] = sum;
  }
  barrier();
  for (uint half_ = kReportLanes / 2; half_ > 0; half_ /= 2) {
    for (uint lane = gl_LocalInvocationID.x; lane < half_; lane += gl_WorkGroupSize.x) {
      precise vec4 sum = lanes[lane] + lanes[lane + half_];
      lanes[lane] = sum;
      largest[lane] = max(largest[lane], largest[lane + half_]);
    }
    barrier();
  }
  if (gl_LocalInvocationID.x == 0) {
    vec4 sum = lanes[0];
    sums[gl_WorkGroupID.x] = ReportSums(largest[0], sum.x, sum.y, sum.z, sum.w, 0.0, 0.0, 0.0);
  }
}

// SPDX-License-Identifier: MIT
// rows[y] = y: reads the row of a workgroup, which has no shared form.
#version 450
layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0) writeonly buffer Rows {
  uint rows[];
};

void main() {
  // All invocations of a row write the same value.
  rows[gl_WorkGroupID.y] = gl_WorkGroupID.y;
}

// SPDX-License-Identifier: MIT
// A kernel without buffers and push constants.
#version 450
layout(local_size_x_id = 0) in;

void main() {}

// SPDX-License-Identifier: MIT
// Owner of the precompiled header that most rooms share (cmake/options.cmake).

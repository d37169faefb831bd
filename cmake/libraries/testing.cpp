// SPDX-License-Identifier: MIT
// Owner of the precompiled header that all test programs share (cmake/testing.cmake).

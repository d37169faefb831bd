// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Scenes of clients, as messages and as uploaded bytes: conversion, price, description and the tables of the
// host. Promises: an accepted scene is written and read without a change, and its host memory is within its
// price.
extern const Target kSceneTarget;

}  // namespace clothstream::fuzz

// SPDX-License-Identifier: MIT
// A wavy sheet, compressed with Draco's encoder, alone and in a .glb file.
#pragma once

#include <cstddef>
#include <string>

#include "server/model/mesh.h"

namespace clothstream::meshes {

struct DracoCoding {
  bool isSequential;  // else the encoder's edgebreaker method
  int quantization;   // bits; 0: floats
  int speed;          // 10: the fastest
};

inline constexpr DracoCoding kDracoCodings[] = {
    {false, 14, 0}, {false, 14, 5}, {false, 0, 5},  {false, 11, 9},
    {true, 14, 5},  {true, 0, 5},   {true, 12, 10},
};

// Point of a sheet of `side` x `side` quads with edges of 1 m.
model::Vec3 wave(int x, int y, int side);

// The attributes are 0: positions, and 1: texture coordinates. Throws std::runtime_error if the encoder
// fails.
std::string compressedSheet(const DracoCoding& coding, int side, bool hasMetadata = false);

// A .glb file. `points` and `indices` are the counts of its accessors.
std::string glbOf(const std::string& compressed, std::size_t points, std::size_t indices);

}  // namespace clothstream::meshes

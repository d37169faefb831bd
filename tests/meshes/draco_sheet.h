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

// The attributes are 0: positions, 1: texture coordinates, and with a skin 2: joints 0 and 1, and 3: their
// weights, which are x and 1 - x of the position. Throws std::runtime_error if the encoder
// fails.
std::string compressedSheet(const DracoCoding& coding, int side, bool hasMetadata = false,
                            bool hasSkin = false);

// A .glb file. `points` and `indices` are the counts of its accessors. With a skin, joint 0 moves vertices by
// 1 m along X, and joint 1 by 3 m.
std::string glbOf(const std::string& compressed, std::size_t points, std::size_t indices,
                  bool hasSkin = false);

}  // namespace clothstream::meshes

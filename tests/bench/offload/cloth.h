// SPDX-License-Identifier: MIT
// The cloth that a client without a server simulates: one grid that hangs by pins, and one moving sphere.
//
// The forces, the integrator, the contact and the order of the springs are those of the server's kernels
// (docs/simulation.md), without air. The code is written for one thread of a processor with vectors of four
// floats: structure of arrays, no gathers, every spring computed once.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tests/bench/offload/lanes.h"

namespace clothstream::bench::offload {

struct Spring {
  float stiffness;  // N/m
  float damping;    // N s/m
};

// Floats in the order of this struct, so that JavaScript can write them.
struct Settings {
  float columnSpacing, rowSpacing, diagonalSpacing;  // m, at rest
  float inverseMass;                                 // 1/kg, of a node that is not pinned
  Spring structural, shear, bend;
  float damping;   // 1/s, of nodes
  float gravity;   // m/s^2, along Y
  float friction;  // product of cloth and sphere
  float reach;     // m, radius of the sphere plus thickness of the cloth
  float substep;   // s
};

// The sphere during one substep.
struct Ball {
  float before[3], after[3];  // centre, m
  float velocity[3];          // m/s
};

// Three arrays in memory that belongs to Arrays. Loops hold a copy, because the compiler must assume that a
// stored vector changes every pointer in memory.
struct Pointers {
  float *x, *y, *z;

  Triple at(std::size_t index) const { return {load(x + index), load(y + index), load(z + index)}; }
  void set(std::size_t index, const Triple& value) const {
    store(x + index, value.x);
    store(y + index, value.y);
    store(z + index, value.z);
  }
};

// Vectors of x, y and z in separate arrays.
struct Arrays {
  std::vector<float> x, y, z;

  explicit Arrays(std::size_t size = 0) : x(size), y(size), z(size) {}
  Triple at(std::size_t index) const { return {load(&x[index]), load(&y[index]), load(&z[index])}; }
  void set(std::size_t index, const Triple& value) {
    store(&x[index], value.x);
    store(&y[index], value.y);
    store(&z[index], value.z);
  }
  Pointers pointers() { return {x.data(), y.data(), z.data()}; }
};

// Inverse mass of a place beyond the edges of the grid. Every sum with it is below zero.
inline constexpr float kAbsent = -1e30f;

// One solver with the state of its cloth.
class Solver {
 public:
  virtual ~Solver() = default;
  // One node; the inverse mass is 0 if it is pinned.
  virtual void setNode(std::uint32_t row, std::uint32_t column, const float* position, const float* velocity,
                       float inverseMass) = 0;
  virtual void substep(const Ball& ball) = 0;
  // Positions as rows of `stride` floats for each of x, y and z.
  virtual void copyPositions(Arrays& to, std::uint32_t stride) const = 0;
  virtual void getNode(std::uint32_t row, std::uint32_t column, float* position, float* velocity) const = 0;
};

std::unique_ptr<Solver> makeMassSpring(std::uint32_t rows, std::uint32_t columns, const Settings& settings);
std::unique_ptr<Solver> makeXpbd(std::uint32_t rows, std::uint32_t columns, const Settings& settings);

}  // namespace clothstream::bench::offload

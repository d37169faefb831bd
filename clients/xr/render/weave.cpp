// SPDX-License-Identifier: MIT
#include "clients/xr/render/weave.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace clothstream::xr {
namespace {

constexpr float kPi = 3.14159265F;
constexpr float kFactorOne = 200;
constexpr auto kThreadCount = static_cast<float>(kThreads);

// Height in units of the distance between threads, and brightness.
struct Texel {
  float height = 0, tone = 1;
};

float clamped(float value) {
  return std::clamp(value, 0.0F, 1.0F);
}
float smooth(float t) {
  return t * t * (3 - 2 * t);
}
int modulo(int value, int period) {
  return ((value % period) + period) % period;
}

// Pseudo-random number in [0, 1) of two whole numbers.
float hash(int x, int y) {
  std::uint32_t bits =
      (static_cast<std::uint32_t>(x) * 0x27d4eb2dU) ^ (static_cast<std::uint32_t>(y) * 0x165667b1U);
  bits = (bits ^ (bits >> 15)) * 0x2c1b3c6dU;
  bits = (bits ^ (bits >> 12)) * 0x297a2d39U;
  return static_cast<float>(static_cast<double>(bits ^ (bits >> 15)) / 4294967296.0);
}

// Smooth value noise in [0, 1), which repeats after the given numbers of cells.
float noise(float x, float y, float columns, float rows) {
  const int wide = std::max(1, static_cast<int>(std::lround(columns)));
  const int high = std::max(1, static_cast<int>(std::lround(rows)));
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const float s = smooth(x - static_cast<float>(i)), t = smooth(y - static_cast<float>(j));
  const auto at = [&](int column, int row) { return hash(modulo(column, wide), modulo(row, high)); };
  const float upper = at(i, j) + s * (at(i + 1, j) - at(i, j));
  const float lower = at(i, j + 1) + s * (at(i + 1, j + 1) - at(i, j + 1));
  return upper + t * (lower - upper);
}

// Distance to the edge between the two nearest of random points, one per cell (Worley 1996).
float cellEdge(float x, float y, int cells) {
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  float nearest = 9, second = 9;
  for (int row = j - 1; row <= j + 1; ++row) {
    for (int column = i - 1; column <= i + 1; ++column) {
      const int wrappedColumn = modulo(column, cells), wrappedRow = modulo(row, cells);
      const float dx = static_cast<float>(column) + hash(wrappedColumn, wrappedRow) - x;
      const float dy = static_cast<float>(row) + hash(wrappedRow + 977, wrappedColumn) - y;
      const float distance = std::hypot(dx, dy);
      if (distance < nearest) {
        second = nearest;
        nearest = distance;
      } else {
        second = std::min(second, distance);
      }
    }
  }
  return second - nearest;
}

bool isWoven(Pattern pattern) {
  return pattern == Pattern::kPlain || pattern == Pattern::kTwill || pattern == Pattern::kSatin ||
         pattern == Pattern::kRipstop;
}

// 1 if the warp thread, which runs along v, lies over the weft thread at a crossing, else -1.
float levelOf(Pattern pattern, int warp, int weft) {
  const int x = modulo(warp, static_cast<int>(kThreads)), y = modulo(weft, static_cast<int>(kThreads));
  bool isOver = (x + y) % 2 == 0;
  if (pattern == Pattern::kTwill) isOver = (x + y) % 4 != 0;
  if (pattern == Pattern::kSatin) isOver = (2 * x + y) % 5 != 0;
  return isOver ? 1.0F : -1.0F;
}

float roundness(float across) {
  return std::sqrt(std::max(0.0F, 1 - (2 * across - 1) * (2 * across - 1)));
}
// From 0 in the middle of a crossing to 1/2 at its edge, where the neighbour's half begins.
float ease(float distance) {
  return 0.5F * (1 - std::cos(kPi * distance));
}

// Round threads that pass over and under each other.
Texel wovenTexel(const Fabric& fabric, float u, float v) {
  const float x = u * kThreadCount, y = v * kThreadCount;
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const float across = x - static_cast<float>(i), along = y - static_cast<float>(j);
  const auto level = [&](int warp, int weft) { return levelOf(fabric.pattern, warp, weft); };
  // Every tenth thread of ripstop is a thick one.
  const auto thick = [&](int thread) {
    return fabric.pattern == Pattern::kRipstop && thread % 10 == 0 ? 1.6F : 1.0F;
  };
  const auto toneOf = [&](int thread, int seed) {
    return 1 + fabric.variation * (2 * hash(thread, seed) - 1);
  };
  // The thread's level between the middles of two crossings.
  const float here = level(i, j);
  const float warpNext = along < 0.5F ? level(i, j - 1) : level(i, j + 1);
  const float weftNext = across < 0.5F ? level(i - 1, j) : level(i + 1, j);
  const float warpHeight =
      thick(i) * roundness(across) + 0.22F * (here + (warpNext - here) * ease(std::abs(along - 0.5F)));
  const float weftHeight =
      thick(j) * roundness(along) - 0.22F * (here + (weftNext - here) * ease(std::abs(across - 0.5F)));
  const bool isWarp = warpHeight >= weftHeight;
  // Slubs: a thread is thicker and paler for some length.
  const float slub = isWarp
                         ? noise(static_cast<float>(3 * i) + 0.5F, y / 7, 3 * kThreadCount, kThreadCount / 7)
                         : noise(x / 7, static_cast<float>(3 * j) + 0.5F, kThreadCount / 7, 3 * kThreadCount);
  const float height = std::max(warpHeight, weftHeight);
  const float tone =
      (isWarp ? toneOf(i, 17) : fabric.weft * toneOf(j, 91)) * (1 + fabric.variation * (slub - 0.5F));
  return {height, tone * (0.72F + 0.4F * clamped(height))};
}

float layers(float u, float v, float cells) {
  return (noise(u * cells, v * cells, cells, cells) +
          0.5F * noise(2 * u * cells, 2 * v * cells, 2 * cells, 2 * cells)) /
         1.5F;
}

Texel flatTexel(const Fabric& fabric, float u, float v) {
  if (fabric.pattern == Pattern::kGrain) {
    // Creases between the cells of the skin, and pores.
    const float warp = 0.6F * (layers(u, v, 10) - 0.5F);
    const float crease = std::min(
        1.0F, 2.2F * cellEdge(u * kThreadCount + warp, v * kThreadCount + warp, static_cast<int>(kThreads)));
    return {1.2F * crease + 0.4F * layers(u, v, 20),
            (0.8F + 0.2F * crease) * (1 + fabric.variation * (2 * layers(u, v, 5) - 1))};
  }
  if (fabric.pattern == Pattern::kFibres) {
    const float pulp = layers(u, v, 40) + layers(u + 0.31F, v, 80);
    return {pulp, 1 + fabric.variation * (pulp - 1)};
  }
  const float bump = layers(u, v, 80);
  return {bump, 1 + fabric.variation * (bump - 0.5F)};
}

std::uint8_t byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0F, 255.0F));
}

}  // namespace

WeaveTexels weave(const Fabric& fabric, std::uint32_t size) {
  const std::size_t count = std::size_t{size} * size;
  std::vector<Texel> texels(count);
  for (std::uint32_t row = 0; row < size; ++row) {
    for (std::uint32_t column = 0; column < size; ++column) {
      const float u = (static_cast<float>(column) + 0.5F) / static_cast<float>(size);
      const float v = (static_cast<float>(row) + 0.5F) / static_cast<float>(size);
      texels[std::size_t{row} * size + column] =
          isWoven(fabric.pattern) ? wovenTexel(fabric, u, v) : flatTexel(fabric, u, v);
    }
  }
  WeaveTexels out;
  out.colours.resize(4 * count);
  out.reliefs.resize(4 * count);
  const float perThread = static_cast<float>(size) / kThreadCount;
  const auto heightAt = [&](std::uint32_t row, std::uint32_t column) {
    return texels[std::size_t{row % size} * size + column % size].height;
  };
  for (std::uint32_t row = 0; row < size; ++row) {
    for (std::uint32_t column = 0; column < size; ++column) {
      const std::size_t at = std::size_t{row} * size + column;
      const float x = 0.25F * perThread * (heightAt(row, column + size - 1) - heightAt(row, column + 1));
      const float y = 0.25F * perThread * (heightAt(row + size - 1, column) - heightAt(row + 1, column));
      const float scale = 127.5F / std::hypot(x, y, 1.0F);
      const Texel& texel = texels[at];
      // A pale weft is undyed: its texels are nearly white, whatever the colour of the fabric.
      const bool isPale = fabric.weft > 1 && texel.tone > 1.3F;
      const float value = std::min(255.0F, kFactorOne * std::pow(std::max(0.0F, texel.tone), 1 / 2.2F));
      const std::array<float, 4> colour{(isPale ? 1.25F : 1) * value, (isPale ? 1.1F : 1) * value, value,
                                        255};
      const std::array<float, 4> relief{127.5F + scale * x, 127.5F + scale * y, 255,
                                        255 * (1 - 0.18F * clamped(texel.height))};
      for (std::size_t k = 0; k < 4; ++k) {
        out.colours[4 * at + k] = byte(colour[k]);
        out.reliefs[4 * at + k] = byte(relief[k]);
      }
    }
  }
  return out;
}

}  // namespace clothstream::xr

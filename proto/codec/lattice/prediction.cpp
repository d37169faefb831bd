// SPDX-License-Identifier: MIT
// Integer prediction of one channel from neighbours and the reference frame.
#include "proto/codec/lattice/prediction.h"

#include <bit>
#include <type_traits>

namespace clothstream::codec {
namespace {

enum class Shape : std::uint8_t { none, average, planar };

// Modulo the width of T.
template <typename T>
constexpr T add(T a, T b) {
  return static_cast<T>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}
template <typename T>
constexpr T subtract(T a, T b) {
  return static_cast<T>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
}
template <typename T>
constexpr T halfSum(T a, T b) {
  return static_cast<T>(
      static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b)) >> 1);
}

struct GridShape {
  std::uint32_t rows, columns;
};
GridShape gridShape(const ClothLayout& cloth) {
  return cloth.rows == 0 ? GridShape{1, cloth.vertexCount} : GridShape{cloth.rows, cloth.columns};
}

// The change of vertex i since the reference.
template <bool kTemporal, typename T>
T change(const T* values, const T* reference, std::size_t i) {
  if constexpr (kTemporal) return subtract(values[i], reference[i]);
  return values[i];
}

// The predicted value of vertex i of a grid whose former vertices are known. `w` is dW.
template <Shape kShape, bool kTemporal, typename T>
T predicted(const T* values, const T* reference, std::size_t i, std::uint32_t columns, bool hasUp,
            bool hasLeft, T w) {
  T d = 0;
  if constexpr (kShape != Shape::none) {
    if (!hasUp) {
      d = w;
    } else {
      const T n = change<kTemporal>(values, reference, i - columns);
      if (!hasLeft) {
        d = n;
      } else if constexpr (kShape == Shape::average) {
        d = halfSum(w, n);
      } else {
        d = subtract(add(w, n), change<kTemporal>(values, reference, i - columns - 1));
      }
    }
  }
  if constexpr (kTemporal) d = add(d, reference[i]);
  return d;
}

// Calls step(i, prediction of vertex i) in the order of vertices; step returns the vertex's value.
template <Shape kShape, bool kTemporal, typename T, typename Step>
void walk(const StreamLayout& layout, const T* values, const T* reference, Step&& step) {
  std::size_t i = 0;
  for (const ClothLayout& cloth : layout.cloths) {
    const GridShape grid = gridShape(cloth);
    for (std::uint32_t row = 0; row < grid.rows; ++row) {
      T w = 0;
      for (std::uint32_t column = 0; column < grid.columns; ++column, ++i) {
        const T guess =
            predicted<kShape, kTemporal>(values, reference, i, grid.columns, row > 0, column > 0, w);
        const T value = step(i, guess);
        w = kTemporal ? subtract(value, reference[i]) : value;
      }
    }
  }
}

template <typename T, typename Step>
void walk(const StreamLayout& layout, Prediction prediction, const T* values, const T* reference,
          Step&& step) {
  switch (prediction) {
    case Prediction::average:
      return walk<Shape::average, false>(layout, values, reference, step);
    case Prediction::planar:
      return walk<Shape::planar, false>(layout, values, reference, step);
    case Prediction::temporal:
      return walk<Shape::none, true>(layout, values, reference, step);
    case Prediction::temporalAverage:
      return walk<Shape::average, true>(layout, values, reference, step);
    case Prediction::temporalPlanar:
      return walk<Shape::planar, true>(layout, values, reference, step);
  }
}

}  // namespace

template <typename T>
void predict(const StreamLayout& layout, Prediction prediction, const T* values, const T* reference,
             T* residuals) {
  walk(layout, prediction, values, reference, [&](std::size_t i, T guess) {
    residuals[i] = subtract(values[i], guess);
    return values[i];
  });
}

template <typename T>
void reconstruct(const StreamLayout& layout, Prediction prediction, const T* residuals, const T* reference,
                 T* values) {
  const T* known = values;
  walk(layout, prediction, known, reference,
       [&](std::size_t i, T guess) { return values[i] = add(residuals[i], guess); });
}

template <typename T>
void measure(const StreamLayout& layout, const T* values, const T* reference, PredictionCosts& costs) {
  for (std::size_t p = 0; p < kPredictionCount; ++p) {
    const auto prediction = static_cast<Prediction>(p);
    if (needsReference(prediction) && reference == nullptr) {
      costs[p] = ~0u;
      continue;
    }
    walk(layout, prediction, values, reference, [&](std::size_t i, T guess) {
      if (i % kCostStride == 0) {
        costs[p] += static_cast<std::uint32_t>(std::bit_width(zigzag(subtract(values[i], guess))));
      }
      return values[i];
    });
  }
}

Prediction cheapest(std::span<const std::uint32_t, kPredictionCount> costs, bool hasReference) {
  auto best = Prediction::average;
  for (std::size_t p = 1; p < kPredictionCount; ++p) {
    const auto prediction = static_cast<Prediction>(p);
    if (needsReference(prediction) && !hasReference) break;
    if (costs[p] < costs[static_cast<std::size_t>(best)]) best = prediction;
  }
  return best;
}

template void predict(const StreamLayout&, Prediction, const std::int32_t*, const std::int32_t*,
                      std::int32_t*);
template void predict(const StreamLayout&, Prediction, const std::int8_t*, const std::int8_t*, std::int8_t*);
template void reconstruct(const StreamLayout&, Prediction, const std::int32_t*, const std::int32_t*,
                          std::int32_t*);
template void reconstruct(const StreamLayout&, Prediction, const std::int8_t*, const std::int8_t*,
                          std::int8_t*);
template void measure(const StreamLayout&, const std::int32_t*, const std::int32_t*, PredictionCosts&);
template void measure(const StreamLayout&, const std::int8_t*, const std::int8_t*, PredictionCosts&);

}  // namespace clothstream::codec

// SPDX-License-Identifier: MIT
// Motion of a .npz file: positions per frame, and the cloth at rest from arrays or an OBJ file.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "clients/cli/motion.h"
#include "clients/files/npz_reader.h"
#include "clients/files/obj_surface.h"

namespace clothstream::cli {
namespace {

using files::NpzArray;
using files::NpzReader;

constexpr std::uint64_t kMaxFrames = 10'000'000;
constexpr std::uint64_t kMaxCloths = 256;
constexpr double kMaxRate = 100'000;

template <typename T>
using Expected = tl::expected<T, Error>;

// Reads a whole array of numbers with these counts in each row. Memory grows only with bytes that exist.
template <typename T>
Expected<std::vector<T>> readAll(const NpzReader& file, const std::string& path, const char* name,
                                 std::vector<std::uint64_t> row, std::uint64_t most) {
  auto array = orError(kUnreadable, file.array(name));
  if (!array) return tl::unexpected(array.error());
  const std::vector<std::uint64_t>& shape = array->header().shape;
  if (shape.size() != row.size() + 1 || !std::equal(row.begin(), row.end(), shape.begin() + 1) ||
      shape[0] > most)
    return makeError(kUnreadable, "{}: array {} has the shape ({}); allowed are up to {} rows{}", path, name,
                     fmt::join(shape, ", "), most,
                     row.empty() ? "" : fmt::format(" of {}", fmt::join(row, " x ")));
  constexpr std::uint64_t kAtOnce = 1 << 20;
  std::vector<T> values;
  for (std::uint64_t left = array->header().elements(); left > 0;) {
    const std::uint64_t count = std::min(left, kAtOnce);
    const std::size_t before = values.size();
    values.resize(before + count);
    if (auto read = orError(kUnreadable, array->read(std::span(values).subspan(before))); !read)
      return tl::unexpected(read.error());
    left -= count;
  }
  if (auto finished = orError(kUnreadable, array->finish()); !finished)
    return tl::unexpected(finished.error());
  return values;
}

class ArrayMotion : public Motion {
 public:
  ArrayMotion(std::string path, NpzReader file, NpzArray positions, std::uint32_t maxVertices)
      : path_(std::move(path)),
        file_(std::move(file)),
        array_(std::move(positions)),
        maxVertices_(maxVertices) {}

  Expected<void> open(const ArrayOptions& options) {
    return checkPositions()
        .and_then([&] { return readSurface(options); })
        .and_then([&] { return readTicks(options); })
        .and_then([&] { return readRate(options); });
  }

  Expected<bool> next() override {
    if (next_ == frames_) {
      if (auto finished = orError(kUnreadable, array_.finish()); !finished)
        return tl::unexpected(finished.error());
      return false;
    }
    if (auto read = orError(kUnreadable, array_.read(std::span(positions_))); !read)
      return tl::unexpected(read.error());
    const auto wrong = std::ranges::find_if_not(positions_, [](float x) { return std::isfinite(x); });
    if (wrong != positions_.end())
      return makeError(
          kUnreadable,
          "{}: in frame {} (of 0 to {}), vertex {} has the coordinate {}; only finite numbers that "
          "float32 can hold are allowed",
          path_, next_, frames_ - 1, (wrong - positions_.begin()) / 3, *wrong);
    frame_.tick = ticks_[next_];
    frame_.seconds = static_cast<double>(frame_.tick) / rate_;
    frame_.positions = positions_;
    ++next_;
    return true;
  }
  const MotionFrame& frame() const override { return frame_; }
  const measure::Surface& surface() const override { return surface_; }
  double rate() const override { return rate_; }
  std::uint64_t frames() const override { return frames_; }

 private:
  Expected<void> checkPositions() {
    const std::vector<std::uint64_t>& shape = array_.header().shape;
    if (shape.size() != 3 || shape[0] < 1 || shape[0] > kMaxFrames || shape[1] < 1 ||
        shape[1] > maxVertices_ || shape[2] != 3)
      return makeError(
          kUnreadable,
          "{}: array positions has the shape ({}); it must be (frames, vertices, 3) with 1 to {} "
          "frames and 1 to {} vertices (--max-vertices)",
          path_, fmt::join(shape, ", "), kMaxFrames, maxVertices_);
    frames_ = shape[0];
    return {};
  }

  Expected<void> readSurface(const ArrayOptions& options) {
    const std::uint64_t vertices = array_.header().shape[1];
    if (!options.mesh.empty()) {
      auto mesh = orError(kUnreadable, files::readObjSurface(options.mesh));
      if (!mesh) return tl::unexpected(mesh.error());
      surface_.rest = std::move(mesh->positions);
      surface_.triangles = std::move(mesh->triangles);
      if (surface_.vertexCount() != vertices)
        return makeError(kUnreadable, "{} has {} vertices, but the positions of {} have {}", options.mesh,
                         surface_.vertexCount(), path_, vertices);
    } else {
      if (!file_.has("triangles") || !file_.has("rest_positions"))
        return makeError(kUsage,
                         "{} has no arrays triangles and rest_positions; give the cloth at rest with --mesh",
                         path_);
      auto rest = readAll<float>(file_, path_, "rest_positions", {3}, maxVertices_);
      if (!rest) return tl::unexpected(rest.error());
      surface_.rest = std::move(*rest);
      if (surface_.vertexCount() != vertices)
        return makeError(kUnreadable, "{}: rest_positions has {} vertices, positions {}", path_,
                         surface_.vertexCount(), vertices);
      auto triangles =
          readAll<std::uint64_t>(file_, path_, "triangles", {3}, 2 * std::uint64_t{maxVertices_});
      if (!triangles) return tl::unexpected(triangles.error());
      const std::uint64_t largest = triangles->empty() ? 0 : std::ranges::max(*triangles);
      if (largest >= vertices)
        return makeError(kUnreadable, "{}: triangles has vertex {}; 0 to {} are allowed", path_, largest,
                         vertices - 1);
      for (std::size_t i = 0; i + 2 < triangles->size(); i += 3)
        surface_.triangles.push_back({static_cast<std::uint32_t>((*triangles)[i]),
                                      static_cast<std::uint32_t>((*triangles)[i + 1]),
                                      static_cast<std::uint32_t>((*triangles)[i + 2])});
    }
    if (!std::ranges::all_of(surface_.rest, [](float x) { return std::isfinite(x); }))
      return makeError(kUnreadable, "{}: a position at rest is not finite",
                       options.mesh.empty() ? path_ : options.mesh);
    positions_.resize(surface_.rest.size());
    return readCloths(options);
  }

  // Without arrays of cloths, everything is one cloth.
  Expected<void> readCloths(const ArrayOptions& options) {
    surface_.cloths = {
        {"cloth", 0, static_cast<std::uint32_t>(surface_.vertexCount()), 0, 0, 0, surface_.triangles.size()}};
    if (!options.mesh.empty() || !file_.has("cloths")) return {};
    // First vertex, vertices, first triangle, triangles, rows, columns.
    const auto rows = readAll<std::uint64_t>(file_, path_, "cloths", {6}, kMaxCloths);
    if (!rows) return tl::unexpected(rows.error());
    surface_.cloths.clear();
    std::uint64_t vertex = 0, triangle = 0;
    for (std::size_t i = 0; i + 5 < rows->size(); i += 6) {
      const std::span<const std::uint64_t> row = std::span(*rows).subspan(i, 6);
      const bool isGrid = row[4] > 0 || row[5] > 0;
      const bool fits = row[0] == vertex && row[1] > 0 && row[1] <= surface_.vertexCount() - vertex &&
                        row[2] == triangle && row[3] <= surface_.triangles.size() - triangle &&
                        row[4] <= row[1] && row[5] <= row[1] && (!isGrid || row[4] * row[5] == row[1]);
      if (!fits || !isWithin(row[2], row[3], row[0], row[1]))
        return makeError(
            kUnreadable,
            "{}: row {} of cloths is ({}): vertices and triangles must follow those of the row before, "
            "and triangles must have vertices of their cloth",
            path_, i / 6, fmt::join(row, ", "));
      vertex += row[1];
      triangle += row[3];
      surface_.cloths.push_back({fmt::format("cloth_{}", i / 6), static_cast<std::uint32_t>(row[0]),
                                 static_cast<std::uint32_t>(row[1]), static_cast<std::uint32_t>(row[4]),
                                 static_cast<std::uint32_t>(row[5]), row[2], row[3]});
    }
    if (vertex != surface_.vertexCount() || triangle != surface_.triangles.size())
      return makeError(kUnreadable, "{}: cloths has {} vertices and {} triangles of {} and {}", path_, vertex,
                       triangle, surface_.vertexCount(), surface_.triangles.size());
    return readNames();
  }

  bool isWithin(std::uint64_t firstTriangle, std::uint64_t triangles, std::uint64_t firstVertex,
                std::uint64_t vertices) const {
    const auto range = std::span(surface_.triangles).subspan(firstTriangle, triangles);
    return std::ranges::all_of(range, [&](const measure::Triangle& triangle) {
      return std::ranges::all_of(triangle, [&](std::uint32_t vertex) {
        return vertex >= firstVertex && vertex - firstVertex < vertices;
      });
    });
  }

  Expected<void> readNames() {
    if (!file_.has("cloth_names")) return {};
    auto array = orError(kUnreadable, file_.array("cloth_names"));
    if (!array) return tl::unexpected(array.error());
    if (array->header().shape != std::vector<std::uint64_t>{surface_.cloths.size()})
      return makeError(kUnreadable, "{}: cloth_names has the shape ({}); it must have {} names", path_,
                       fmt::join(array->header().shape, ", "), surface_.cloths.size());
    for (measure::Cloth& cloth : surface_.cloths) {
      auto name = orError(kUnreadable, array->readText());
      if (!name) return tl::unexpected(name.error());
      cloth.name = std::move(*name);
    }
    return orError(kUnreadable, array->finish());
  }

  Expected<void> readTicks(const ArrayOptions& options) {
    if (options.first || !file_.has("ticks")) {
      ticks_.resize(frames_);
      for (std::uint64_t i = 0; i < frames_; ++i) ticks_[i] = options.first.value_or(1) + i;
      return {};
    }
    auto ticks = readAll<std::uint64_t>(file_, path_, "ticks", {}, kMaxFrames);
    if (!ticks) return tl::unexpected(ticks.error());
    ticks_ = std::move(*ticks);
    if (ticks_.size() != frames_)
      return makeError(kUnreadable, "{}: ticks has {} numbers for {} frames", path_, ticks_.size(), frames_);
    const auto wrong = std::ranges::adjacent_find(ticks_, std::ranges::greater_equal());
    if (wrong != ticks_.end())
      return makeError(kUnreadable, "{}: ticks must ascend, but {} follows {}", path_, wrong[1], wrong[0]);
    return {};
  }

  Expected<void> readRate(const ArrayOptions& options) {
    if (options.rate) {
      rate_ = *options.rate;
      return {};
    }
    if (!file_.has("rate"))
      return makeError(kUsage, "{} has no array rate; give the ticks per second with --rate", path_);
    auto array = orError(kUnreadable, file_.array("rate"));
    if (!array) return tl::unexpected(array.error());
    if (array->header().elements() != 1) return makeError(kUnreadable, "{}: rate must be one number", path_);
    if (auto read = orError(kUnreadable, array->read(std::span(&rate_, 1))); !read)
      return tl::unexpected(read.error());
    if (!(rate_ > 0 && rate_ <= kMaxRate))
      return makeError(kUnreadable, "{}: rate is {}; above 0 to {} ticks per second are allowed", path_,
                       rate_, kMaxRate);
    return {};
  }

  std::string path_;
  NpzReader file_;
  NpzArray array_;  // positions
  const std::uint32_t maxVertices_;
  measure::Surface surface_;
  std::vector<std::uint64_t> ticks_;
  std::vector<float> positions_;
  double rate_ = 0;
  std::uint64_t frames_ = 0, next_ = 0;
  MotionFrame frame_;
};

}  // namespace

tl::expected<std::unique_ptr<Motion>, Error> openArrays(const std::string& path, const ArrayOptions& options,
                                                        std::uint32_t maxVertices) {
  auto file = orError(kUnreadable, NpzReader::open(path));
  if (!file) return tl::unexpected(file.error());
  auto positions = orError(kUnreadable, file->array("positions"));
  if (!positions) return tl::unexpected(positions.error());
  auto motion = std::make_unique<ArrayMotion>(path, std::move(*file), std::move(*positions), maxVertices);
  if (auto opened = motion->open(options); !opened) return tl::unexpected(opened.error());
  return motion;
}

}  // namespace clothstream::cli

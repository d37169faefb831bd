// SPDX-License-Identifier: MIT
#include "clients/cli/npz_export.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "clients/measure/surface.h"

namespace clothstream::cli {
namespace {

constexpr std::size_t kNameCharacters = 64;

// A name as numpy stores text: 64 characters of 4 bytes.
std::array<std::uint32_t, kNameCharacters> textOf(const std::string& name) {
  std::array<std::uint32_t, kNameCharacters> text{};
  for (std::size_t i = 0; i < std::min(name.size(), text.size()); ++i)
    text[i] = static_cast<unsigned char>(name[i]);
  return text;
}

template <typename T>
std::span<const T> one(const T& value) {
  return std::span(&value, 1);
}

}  // namespace

tl::expected<NpzExport, Error> NpzExport::begin(const std::string& path,
                                                const client::PlayedRecording& played) {
  auto writer = orError(kNotWritten, files::NpzWriter::create(path));
  if (!writer) return tl::unexpected(writer.error());
  NpzExport npz(std::move(*writer));
  const measure::Surface surface = measure::surfaceOf(played.client());
  std::vector<std::uint64_t> cloths;
  std::vector<std::uint32_t> names, triangles;
  for (const measure::Cloth& cloth : surface.cloths) {
    cloths.insert(cloths.end(), {cloth.firstVertex, cloth.vertexCount, cloth.firstTriangle,
                                 cloth.triangleCount, cloth.rows, cloth.columns});
    const auto text = textOf(cloth.name);
    names.insert(names.end(), text.begin(), text.end());
  }
  for (const measure::Triangle& triangle : surface.triangles)
    triangles.insert(triangles.end(), triangle.begin(), triangle.end());
  const double rate = cs_simulation_rate(played.client());
  const std::uint64_t vertices = surface.vertexCount();
  const auto growing = [&](std::size_t& place, const char* name, const char* type,
                           std::vector<std::uint64_t> row) {
    return npz.writer_.add(name, type, std::move(row)).map([&](std::size_t array) { place = array; });
  };
  auto done =
      growing(npz.ticks_, "ticks", "<u8", {})
          .and_then([&] { return growing(npz.seconds_, "seconds", "<f8", {}); })
          .and_then([&] {
            return growing(npz.positions_, "positions", "<f4", {vertices, 3});
          })
          .and_then([&] {
            return growing(npz.normals_, "normals", "<f4", {vertices, 3});
          })
          .and_then([&] { return growing(npz.reconstructionHashes_, "reconstruction_hashes", "<u8", {}); })
          .and_then([&] { return growing(npz.stateHashes_, "state_hashes", "<u8", {}); })
          .and_then([&] { return npz.writer_.addWhole<float>("rest_positions", "<f4", {3}, surface.rest); })
          .and_then([&] { return npz.writer_.addWhole<std::uint32_t>("triangles", "<u4", {3}, triangles); })
          .and_then([&] { return npz.writer_.addWhole<std::uint64_t>("cloths", "<u8", {6}, cloths); })
          .and_then([&] { return npz.writer_.addWhole<std::uint32_t>("cloth_names", "<U64", {}, names); })
          .and_then([&] { return npz.writer_.addWhole<double>("rate", "<f8", {}, one(rate)); });
  if (auto error = orError(kNotWritten, std::move(done)); !error) return tl::unexpected(error.error());
  return npz;
}

tl::expected<void, Error> NpzExport::add(const client::PlayedRecording& played) {
  const cs_client* const client = played.client();
  const std::size_t numbers = 3 * std::size_t{cs_vertex_count(client)};
  cs_statistics now;
  cs_get_statistics(client, 0, &now);
  const std::uint64_t tick = now.tick, reconstruction = cs_reconstruction_hash(client);
  const std::uint64_t state = played.stateHash();
  const double seconds = played.seconds();
  return orError(
      kNotWritten,
      writer_.append(ticks_, one(tick))
          .and_then([&] { return writer_.append(seconds_, one(seconds)); })
          .and_then([&] { return writer_.append(positions_, std::span(cs_positions(client), numbers)); })
          .and_then([&] { return writer_.append(normals_, std::span(cs_normals(client), numbers)); })
          .and_then([&] { return writer_.append(reconstructionHashes_, one(reconstruction)); })
          .and_then([&] { return writer_.append(stateHashes_, one(state)); }));
}

tl::expected<void, Error> NpzExport::finish() {
  return orError(kNotWritten, writer_.finish());
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
// Rasterises with librsvg on a cairo surface.
#include "tests/bench/picture/rasterise.h"

#include <cmath>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>
#include <librsvg/rsvg.h>

namespace clothstream::bench {
namespace {

constexpr double kPixelsPerUnit = 2;

}  // namespace

void writePng(const std::string& svg, const std::filesystem::path& file) {
  const std::unique_ptr<RsvgHandle, decltype(&g_object_unref)> drawing(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), nullptr),
      &g_object_unref);
  double width = 0, height = 0;
  if (!drawing || rsvg_handle_get_intrinsic_size_in_pixels(drawing.get(), &width, &height) == 0)
    throw std::runtime_error(fmt::format("{}: not a drawing with a size", file.string()));
  const RsvgRectangle page{0, 0, kPixelsPerUnit * width, kPixelsPerUnit * height};
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::ceil(page.width)),
                                 static_cast<int>(std::ceil(page.height))),
      &cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> canvas(cairo_create(surface.get()),
                                                                  &cairo_destroy);
  if (rsvg_handle_render_document(drawing.get(), canvas.get(), &page, nullptr) == 0 ||
      cairo_surface_write_to_png(surface.get(), file.c_str()) != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(fmt::format("{} cannot be written", file.string()));
}

}  // namespace clothstream::bench

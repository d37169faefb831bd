// SPDX-License-Identifier: MIT
#include "server/tls/qr_code.h"

#include <iterator>
#include <memory>

#include <fmt/format.h>
#include <qrencode.h>

namespace clothstream::tls {
namespace {

// Light modules that surround a code (ISO/IEC 18004).
constexpr int kQuietZone = 4;

using Code = std::unique_ptr<QRcode, decltype(&QRcode_free)>;

Code encode(const std::string& text) {
  return {QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_M), &QRcode_free};
}

bool isDark(const QRcode& code, int x, int y) {
  if (x < 0 || y < 0 || x >= code.width || y >= code.width) return false;
  return (code.data[y * code.width + x] & 1) != 0;
}

}  // namespace

std::string qrCode(const std::string& text) {
  const Code code = encode(text);
  if (!code) return {};
  // Black on white, whatever the colours of the terminal are.
  constexpr const char* kColours = "\x1b[30;47m";
  constexpr const char* kReset = "\x1b[0m";
  std::string lines;
  for (int y = -kQuietZone / 2; y < code->width + kQuietZone / 2; y += 2) {
    lines += kColours;
    for (int x = -kQuietZone / 2; x < code->width + kQuietZone / 2; ++x) {
      const bool upper = isDark(*code, x, y), lower = isDark(*code, x, y + 1);
      lines += upper && lower ? "█" : upper ? "▀" : lower ? "▄" : " ";
    }
    lines += kReset;
    lines += '\n';
  }
  return lines;
}

std::string qrImage(const std::string& text) {
  const Code code = encode(text);
  if (!code) return {};
  const int size = code->width + 2 * kQuietZone;
  std::string path;
  for (int y = 0; y < code->width; ++y)
    for (int x = 0; x < code->width; ++x)
      if (isDark(*code, x, y))
        fmt::format_to(std::back_inserter(path), "M{} {}h1v1h-1z", x + kQuietZone, y + kQuietZone);
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {0}\" shape-rendering=\"crispEdges\">"
      "<path fill=\"#fff\" d=\"M0 0h{0}v{0}H0z\"/><path d=\"{1}\"/></svg>\n",
      size, path);
}

}  // namespace clothstream::tls

// SPDX-License-Identifier: MIT
// QR codes for terminals and pages.
#pragma once

#include <string>

namespace clothstream::tls {

// The text as a QR code of block characters, two modules per character, dark on light: lines that end with a
// newline. Empty if the text is too long for a QR code.
std::string qrCode(const std::string& text);

// The same as an SVG image.
std::string qrImage(const std::string& text);

}  // namespace clothstream::tls

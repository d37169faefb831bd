// SPDX-License-Identifier: MIT
// Text of Windows: UTF-16, and errors.
#pragma once

#include <string>
#include <string_view>

namespace clothstream {

// Characters that are not valid become U+FFFD.
std::wstring utf16(std::string_view utf8);
std::string utf8(std::wstring_view utf16);

// Message for an error of Windows, WinHTTP or cryptography, in the language of the system, with its number.
std::string windowsErrorText(unsigned long error);

}  // namespace clothstream

// SPDX-License-Identifier: MIT
#include "clients/websocket/winhttp/windows_text.h"

#include <array>
#include <charconv>

#include <windows.h>

namespace clothstream {

std::wstring utf16(std::string_view utf8) {
  const int bytes = static_cast<int>(utf8.size());
  std::wstring text(utf8.size(), L'\0');  // UTF-16 never has more units than UTF-8 has bytes
  text.resize(
      static_cast<std::size_t>(MultiByteToWideChar(CP_UTF8, 0, utf8.data(), bytes, text.data(), bytes)));
  return text;
}

std::string utf8(std::wstring_view utf16) {
  constexpr std::size_t kMostBytes = 3;  // of one unit
  const int units = static_cast<int>(utf16.size());
  std::string text(kMostBytes * utf16.size(), '\0');
  text.resize(static_cast<std::size_t>(WideCharToMultiByte(CP_UTF8, 0, utf16.data(), units, text.data(),
                                                           static_cast<int>(text.size()), nullptr, nullptr)));
  return text;
}

std::string windowsErrorText(unsigned long error) {
  constexpr DWORD kUnits = 512;
  wchar_t text[kUnits];
  const HMODULE winhttp = GetModuleHandleW(L"winhttp.dll");
  DWORD units =
      FormatMessageW(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_FROM_HMODULE | FORMAT_MESSAGE_IGNORE_INSERTS,
                     winhttp, error, 0, text, kUnits, nullptr);
  constexpr std::wstring_view kEnd = L" .\r\n";
  while (units > 0 && kEnd.find(text[units - 1]) != std::wstring_view::npos) --units;
  // Errors of cryptography are known by their hexadecimal numbers.
  std::array<char, 2 * sizeof error> digits{};
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), error, error > 0xffff ? 16 : 10);
  const std::string number =
      (error > 0xffff ? "Windows error 0x" : "Windows error ") + std::string(digits.data(), end.ptr);
  return units > 0 ? utf8({text, units}) + ", " + number : number;
}

}  // namespace clothstream

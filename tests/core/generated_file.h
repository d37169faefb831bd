// SPDX-License-Identifier: MIT
// Command line of programs that write a committed file, or check that it is up to date.
#pragma once

#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <string_view>

namespace clothstream {

// Arguments: [--check] FILE. Returns the exit code: 1 if the file cannot be written or is out of date, 2 for
// wrong arguments.
inline int writeOrCheck(int count, char** arguments, const std::string& program, std::string (*text)()) {
  const bool check = count == 3 && std::string_view(arguments[1]) == "--check";
  if (count != 2 && !check) {
    std::cerr << "Usage: " << program << " [--check] FILE\n";
    return 2;
  }
  const std::string path = arguments[count - 1], expected = text();
  if (!check) {
    std::ofstream out(path, std::ios::binary);
    out << expected << std::flush;
    if (out) return 0;
    std::cerr << program << ": " << path << " cannot be written\n";
    return 1;
  }
  std::ifstream in(path, std::ios::binary);
  const std::string committed{std::istreambuf_iterator<char>(in), {}};
  if (committed == expected) return 0;
  std::cerr << path << " is out of date. Run: " << arguments[0] << " " << path << "\n";
  return 1;
}

}  // namespace clothstream

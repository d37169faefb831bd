// SPDX-License-Identifier: MIT
// Reads arrays of a .npz file row by row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/files/npy_header.h"

struct zip;
struct zip_file;

namespace clothstream::files {

// One array, read from its first row to its last. Memory does not depend on sizes in the file. Errors name
// the file and the array.
class NpzArray {
 public:
  const NpyHeader& header() const { return header_; }
  // Reads the next values of an array of numbers and converts them. Reading past the end is an error, and so
  // is a whole number that a double cannot hold.
  [[nodiscard]] tl::expected<void, std::string> read(std::span<double> values);
  // Likewise. A number that float32 cannot hold becomes infinite.
  [[nodiscard]] tl::expected<void, std::string> read(std::span<float> values);
  [[nodiscard]] tl::expected<void, std::string> read(std::span<std::uint64_t> values);
  // Reads the next value of an array of text, without its padding. Characters other than ASCII become '?'.
  [[nodiscard]] tl::expected<std::string, std::string> readText();
  // Verifies the checksum. Call it after the last value.
  [[nodiscard]] tl::expected<void, std::string> finish();

 private:
  friend class NpzReader;
  struct CloseEntry {
    void operator()(zip_file* entry) const;
  };
  NpzArray(std::string name, std::unique_ptr<zip_file, CloseEntry> entry)
      : name_(std::move(name)), entry_(std::move(entry)) {}
  tl::unexpected<std::string> broken(const std::string& why) const;
  [[nodiscard]] tl::expected<void, std::string> readBytes(std::size_t count);

  std::string name_;  // "FILE: array NAME"
  NpyHeader header_;
  std::unique_ptr<zip_file, CloseEntry> entry_;
  std::vector<std::byte> bytes_;  // the values that are converted
};

class NpzReader {
 public:
  [[nodiscard]] static tl::expected<NpzReader, std::string> open(const std::string& path);

  bool has(const std::string& name) const;
  // The error lists the arrays that exist if this one does not.
  [[nodiscard]] tl::expected<NpzArray, std::string> array(const std::string& name) const;

 private:
  struct CloseZip {
    void operator()(zip* file) const;
  };
  NpzReader(std::string path, std::unique_ptr<zip, CloseZip> zip)
      : path_(std::move(path)), zip_(std::move(zip)) {}

  std::string path_;
  std::unique_ptr<zip, CloseZip> zip_;  // outlives its arrays
};

}  // namespace clothstream::files

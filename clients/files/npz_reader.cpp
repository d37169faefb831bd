// SPDX-License-Identifier: MIT
// Reads arrays with libzip.
#include "clients/files/npz_reader.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zip.h>

#include "clients/files/regular_file.h"

namespace clothstream::files {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kValuesAtOnce = 65'536;
constexpr zip_int64_t kMaxEntries = 1000;

template <typename From>
From valueAt(std::span<const std::byte> bytes, std::size_t index) {
  From value;
  std::memcpy(&value, bytes.data() + index * sizeof(From), sizeof(From));
  return value;
}

// Calls `convert` with a value of the array's type.
template <typename Convert>
bool convertAll(std::span<const std::byte> bytes, const NpyHeader& header, const Convert& convert) {
  const std::size_t count = bytes.size() / header.elementBytes();
  const auto all = [&]<typename From>(From) {
    for (std::size_t i = 0; i < count; ++i)
      if (!convert(i, valueAt<From>(bytes, i))) return false;
    return true;
  };
  const std::string_view type = std::string_view(header.type).substr(1);
  if (type == "f4") return all(float{});
  if (type == "f8") return all(double{});
  if (type == "i1") return all(std::int8_t{});
  if (type == "i2") return all(std::int16_t{});
  if (type == "i4") return all(std::int32_t{});
  if (type == "i8") return all(std::int64_t{});
  if (type == "u1") return all(std::uint8_t{});
  if (type == "u2") return all(std::uint16_t{});
  if (type == "u4") return all(std::uint32_t{});
  if (type == "u8") return all(std::uint64_t{});
  return false;
}

// Stores a value as another type. Returns false if it is not the same number there.
bool store(double value, std::uint64_t& out) {
  constexpr double kEnd = 18'446'744'073'709'551'616.0;  // 2^64
  if (!(value >= 0 && value < kEnd)) return false;
  out = static_cast<std::uint64_t>(value);
  return static_cast<double>(out) == value;
}
template <typename From>
bool store(From value, std::uint64_t& out) {
  out = static_cast<std::uint64_t>(value);
  return std::cmp_greater_equal(value, 0);
}
bool store(float value, std::uint64_t& out) {
  return store(double{value}, out);
}
template <typename From>
bool store(From value, double& out) {
  out = static_cast<double>(value);
  if constexpr (std::is_integral_v<From>) return std::abs(out) <= 9'007'199'254'740'992.0;  // 2^53
  return true;
}
template <typename From>
bool store(From value, float& out) {
  out = static_cast<float>(value);
  return true;
}

}  // namespace

void NpzArray::CloseEntry::operator()(zip_file* entry) const {
  zip_fclose(entry);
}

void NpzReader::CloseZip::operator()(zip* file) const {
  zip_discard(file);
}

tl::unexpected<std::string> NpzArray::broken(const std::string& why) const {
  return tl::unexpected(fmt::format("{}: {}", name_, why));
}

tl::expected<void, std::string> NpzArray::readBytes(std::size_t count) {
  bytes_.resize(count);
  const zip_int64_t got = zip_fread(entry_.get(), bytes_.data(), count);
  if (got < 0) return broken(zip_file_strerror(entry_.get()));
  if (static_cast<std::size_t>(got) != count) return broken("it ends before its last value");
  return {};
}

namespace {

template <typename To, typename Read>
tl::expected<void, std::string> readAll(std::span<To> values, const NpyHeader& header,
                                        const std::vector<std::byte>& bytes, const Read& read,
                                        std::string& problem) {
  while (!values.empty()) {
    const std::size_t count = std::min(values.size(), kValuesAtOnce);
    if (auto done = read(count * header.elementBytes()); !done) return done;
    const bool converted = convertAll(std::span(bytes), header, [&](std::size_t i, auto value) {
      if (store(value, values[i])) return true;
      problem = fmt::format("{} is not allowed there", value);
      return false;
    });
    if (!converted) return tl::unexpected(std::string());
    values = values.subspan(count);
  }
  return {};
}

}  // namespace

tl::expected<void, std::string> NpzArray::read(std::span<double> values) {
  std::string problem = fmt::format("its type {} is not a number", header_.type);
  auto done = readAll(
      values, header_, bytes_, [&](std::size_t n) { return readBytes(n); }, problem);
  return !done && done.error().empty() ? broken(problem) : done;
}

tl::expected<void, std::string> NpzArray::read(std::span<float> values) {
  std::string problem = fmt::format("its type {} is not a number", header_.type);
  auto done = readAll(
      values, header_, bytes_, [&](std::size_t n) { return readBytes(n); }, problem);
  return !done && done.error().empty() ? broken(problem) : done;
}

tl::expected<void, std::string> NpzArray::read(std::span<std::uint64_t> values) {
  std::string problem = fmt::format("its type {} is not a number", header_.type);
  auto done = readAll(
      values, header_, bytes_, [&](std::size_t n) { return readBytes(n); }, problem);
  return !done && done.error().empty() ? broken(problem) : done;
}

tl::expected<std::string, std::string> NpzArray::readText() {
  if (header_.type[1] != 'U') return broken(fmt::format("its type {} is not text", header_.type));
  if (auto read = readBytes(header_.elementBytes()); !read) return tl::unexpected(read.error());
  std::string text;
  constexpr std::uint32_t kAsciiEnd = 0x80;
  for (std::size_t i = 0; i < bytes_.size() / sizeof(std::uint32_t); ++i) {
    const auto character = valueAt<std::uint32_t>(bytes_, i);
    if (character == 0) break;
    text.push_back(character < kAsciiEnd ? static_cast<char>(character) : '?');
  }
  return text;
}

tl::expected<void, std::string> NpzArray::finish() {
  std::byte more{};
  const zip_int64_t got = zip_fread(entry_.get(), &more, 1);
  if (got < 0) return broken(zip_file_strerror(entry_.get()));
  if (got > 0) return broken("it has more values than its header says");
  return {};
}

tl::expected<NpzReader, std::string> NpzReader::open(const std::string& path) {
  if (auto regular = openRegularFile(path); !regular) return tl::unexpected(regular.error());
  int code = 0;
  zip_t* const file = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (file == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    return tl::unexpected(fmt::format("{} is not a .npz file, which numpy.savez writes: {}", path, why));
  }
  NpzReader reader(path, std::unique_ptr<zip, CloseZip>(file));
  if (const zip_int64_t entries = zip_get_num_entries(file, 0); entries > kMaxEntries)
    return tl::unexpected(
        fmt::format("{} has {} entries; at most {} are allowed", path, entries, kMaxEntries));
  return reader;
}

bool NpzReader::has(const std::string& name) const {
  return zip_name_locate(zip_.get(), (name + ".npy").c_str(), 0) >= 0;
}

tl::expected<NpzArray, std::string> NpzReader::array(const std::string& name) const {
  const std::string label = fmt::format("{}: array {}", path_, name);
  const zip_int64_t place = zip_name_locate(zip_.get(), (name + ".npy").c_str(), 0);
  if (place < 0) {
    std::vector<std::string> names;
    for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(zip_get_num_entries(zip_.get(), 0)); ++i)
      if (const char* entry = zip_get_name(zip_.get(), i, 0); entry != nullptr && names.size() < 20)
        names.emplace_back(entry);
    return tl::unexpected(fmt::format("{} has no array {}; it has {}", path_, name,
                                      names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  const auto index = static_cast<zip_uint64_t>(place);
  zip_stat_t about;
  zip_file* const entry = zip_fopen_index(zip_.get(), index, 0);
  if (entry == nullptr || zip_stat_index(zip_.get(), index, 0, &about) != 0) {
    if (entry != nullptr) zip_fclose(entry);
    return tl::unexpected(fmt::format("{}: {}", label, zip_strerror(zip_.get())));
  }
  NpzArray array(label, std::unique_ptr<zip_file, NpzArray::CloseEntry>(entry));
  if (auto read = array.readBytes(kNpyPreambleBytes); !read) return tl::unexpected(read.error());
  const auto byteAt = [&](std::size_t i) { return std::to_integer<std::size_t>(array.bytes_[i]); };
  if (std::memcmp(array.bytes_.data(), kNpyMagic.data(), kNpyMagic.size()) != 0)
    return array.broken("it is not an array of numpy: its first bytes differ");
  const std::size_t version = byteAt(6);
  std::size_t headerBytes = byteAt(8) + 256 * byteAt(9);
  std::size_t preamble = kNpyPreambleBytes;
  if (version == 2 || version == 3) {
    if (auto read = array.readBytes(2); !read) return tl::unexpected(read.error());
    headerBytes += (byteAt(0) << 16) + (byteAt(1) << 24);
    preamble += 2;
  } else if (version != 1) {
    return array.broken(fmt::format("version {} of the format is unknown; 1 to 3 are allowed", version));
  }
  if (headerBytes > kMaxNpyHeaderBytes)
    return array.broken(
        fmt::format("its header has {} bytes; at most {} are allowed", headerBytes, kMaxNpyHeaderBytes));
  if (auto read = array.readBytes(headerBytes); !read) return tl::unexpected(read.error());
  auto header = parseNpyHeader({reinterpret_cast<const char*>(array.bytes_.data()), array.bytes_.size()});
  if (!header) return array.broken(header.error());
  array.header_ = std::move(*header);
  const std::uint64_t whole = preamble + headerBytes + array.header_.bytes();
  if ((about.valid & ZIP_STAT_SIZE) == 0 || about.size != whole)
    return array.broken(fmt::format("it has {} bytes; shape ({}) of {} needs {}", about.size,
                                    fmt::join(array.header_.shape, ", "), array.header_.type, whole));
  return array;
}

}  // namespace clothstream::files

// SPDX-License-Identifier: MIT
#include "clients/cli/golden_manifest.h"

#include <charconv>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/json_text.h"
#include "clients/files/new_file.h"
#include "clients/files/regular_file.h"
#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/frame_check.h"
#include "proto/recording/message_types.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {
namespace {

using recording::RecordingReader;
using recording::Topic;

constexpr int kManifestFormat = 1;
constexpr std::uint64_t kMaxManifestBytes = std::uint64_t{16} << 20;

// FNV-1a over 64-bit numbers, byte by byte.
class Hash {
 public:
  void add(std::uint64_t number) {
    for (int shift = 0; shift < 64; shift += 8) {
      constexpr std::uint64_t kPrime = 0x100000001b3;
      hash_ = (hash_ ^ ((number >> shift) & 0xff)) * kPrime;
    }
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325;
};

std::string hexOf(std::uint64_t hash) {
  return fmt::format("{:016x}", hash);
}

bool parseHex(const nlohmann::json& text, std::uint64_t& hash) {
  if (!text.is_string()) return false;
  const auto& digits = text.get_ref<const std::string&>();
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), hash, 16);
  return error == std::errc() && end == digits.data() + digits.size();
}

}  // namespace

tl::expected<GoldenRecording, std::string> readGolden(const std::string& path,
                                                      const recording::ReadLimits& limits) {
  auto reader = RecordingReader::open(path, recording::CutFiles::refused, limits);
  if (!reader) return tl::unexpected(reader.error());
  if (const auto checked = reader->check(); !checked) return tl::unexpected(checked.error());
  const auto damaged = [&](const std::string& how) { return tl::unexpected(path + " is damaged: " + how); };
  const auto description = recording::readDescription(*reader);
  if (!description) return damaged(description.error());
  auto check = recording::FrameCheck::make(recording::layoutOf(*description));
  if (!check) return damaged(check.error());
  GoldenRecording golden;
  Hash frames, ticks;
  v1::Frame frame;
  v1::RecordedTick tick;
  for (;;) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    const std::string_view bytes = (*message)->bytes;
    const auto size = static_cast<int>(bytes.size());
    if ((*message)->topic == Topic::frames)
      check->take(bytes, static_cast<double>((*message)->time - reader->start()) * 1e-9);
    else if (!recording::isReadable((*message)->topic, bytes))
      return damaged(fmt::format("a message of {} cannot be read", nameOf((*message)->topic)));
    if ((*message)->topic == Topic::frames && frame.ParseFromArray(bytes.data(), size)) {
      const auto packet = codec::parsePacket(std::as_bytes(std::span(frame.packet())));
      frames.add(packet ? packet->header.tick : 0);
      frames.add(frame.state_hash());
      frames.add(frame.reconstruction_hash());
      ++golden.frames;
    } else if ((*message)->topic == Topic::ticks && tick.ParseFromArray(bytes.data(), size)) {
      ticks.add(tick.tick());
      ticks.add(tick.state_hash());
      ++golden.ticks;
    }
  }
  if (check->faults().any()) return damaged(check->faults().text());
  golden.frameHash = frames.value();
  if (golden.ticks > 0) golden.tickHash = ticks.value();
  return golden;
}

tl::expected<Manifest, std::string> readFolder(const std::string& directory,
                                               const recording::ReadLimits& limits) {
  Manifest manifest;
  std::error_code problem;
  for (const auto& entry : std::filesystem::directory_iterator(directory, problem)) {
    if (entry.path().extension() != ".mcap") continue;
    const auto golden = readGolden(entry.path().string(), limits);
    if (!golden) return tl::unexpected(golden.error());
    manifest.emplace(entry.path().filename().string(), *golden);
  }
  if (problem) return tl::unexpected(fmt::format("cannot read {}: {}", directory, problem.message()));
  return manifest;
}

tl::expected<Manifest, std::string> readManifest(const std::string& directory) {
  const std::string path = (std::filesystem::path(directory) / kManifestName).string();
  auto file = files::openRegularFile(path);
  if (!file)
    return tl::unexpected(
        fmt::format("{}; `clothstream golden {} --update` makes it", file.error(), directory));
  const auto broken = [&](const std::string& why) {
    return tl::unexpected(fmt::format("{} is broken: {}", path, why));
  };
  if (file->bytes > kMaxManifestBytes) return broken("it is too large");
  std::string text(file->bytes, '\0');
  file->stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return broken("it is not a JSON object");
  if (json.value("format", nlohmann::json()) != kManifestFormat)
    return broken(fmt::format("its format is not {}", kManifestFormat));
  const auto recordings = json.find("recordings");
  if (recordings == json.end() || !recordings->is_object()) return broken("it has no object \"recordings\"");
  Manifest manifest;
  for (const auto& [name, entry] : recordings->items()) {
    GoldenRecording golden;
    const auto number = [&](const char* key, std::uint64_t& value) {
      const auto found = entry.find(key);
      if (found == entry.end() || !found->is_number_unsigned()) return false;
      value = found->template get<std::uint64_t>();
      return true;
    };
    if (!entry.is_object() || !number("frames", golden.frames) || !number("ticks", golden.ticks) ||
        !parseHex(entry.value("frameHash", nlohmann::json()), golden.frameHash) ||
        !parseHex(entry.value("tickHash", nlohmann::json()), golden.tickHash))
      return broken(fmt::format("the entry of {} needs frames, ticks, frameHash and tickHash", name));
    // A name with a folder could point to any file.
    if (name.empty() || name.find('/') != name.npos)
      return broken(fmt::format("{} is not the name of a file in this folder", name));
    manifest.emplace(name, golden);
  }
  return manifest;
}

tl::expected<void, std::string> writeManifest(const std::string& directory, const Manifest& manifest) {
  nlohmann::ordered_json json{{"format", kManifestFormat}, {"recordings", nlohmann::ordered_json::object()}};
  for (const auto& [name, golden] : manifest)
    json["recordings"][name] = {{"frames", golden.frames},
                                {"frameHash", hexOf(golden.frameHash)},
                                {"ticks", golden.ticks},
                                {"tickHash", hexOf(golden.tickHash)}};
  auto file = files::NewFile::create((std::filesystem::path(directory) / kManifestName).string());
  if (!file) return tl::unexpected(file.error());
  return file->write(jsonText(json, 1) + '\n').and_then([&] { return file->finish(); });
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
// Reads the index, then every chunk and every frame.
#include "clients/cli/info.h"

#include <array>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clients/recording/played_recording.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/message_types.h"
#include "proto/text/printable.h"

namespace clothstream::cli {
namespace {

using client::PlayedRecording;
using recording::RecordingReader;
using recording::Topic;

struct ChannelFigures {
  std::uint64_t messages = 0, bytes = 0;
};

struct RecordingFigures {
  std::array<ChannelFigures, recording::kTopicNames.size()> channels{};
  std::uint64_t chunksLost = 0;
  std::array<std::uint64_t, codec::kMaxQualities> qualities{};  // frames by their quality
  std::uint64_t unreadable = 0;  // messages that are not of their channel's type
  std::string firstUnreadable;   // channel of the first of them
  std::string damage;            // first damage found; empty: none
  std::optional<cs_statistics> stream;
  recording::FrameFaults faults;
};

double seconds(const RecordingReader& reader) {
  return static_cast<double>(reader.end() - reader.start()) * 1e-9;
}

void countByIndex(const RecordingReader& reader, RecordingFigures& figures) {
  if (!reader.mcap().statistics()) return;
  for (const auto& [channel, count] : reader.mcap().statistics()->counts)
    if (const auto topic = reader.topicOf(channel))
      figures.channels[static_cast<std::size_t>(*topic)].messages = count;
}

void countQuality(std::string_view frame, RecordingFigures& figures) {
  const auto content = recording::frameContentOf(frame);
  const auto packet = content ? codec::parsePacket(content->packet) : std::nullopt;
  if (packet && packet->header.quality < figures.qualities.size())
    ++figures.qualities[packet->header.quality];
}

// Reads chunk by chunk, so that a damaged chunk does not hide the others.
tl::expected<void, Error> countByReading(recording::McapReader& mcap, const RecordingReader& reader,
                                         RecordingFigures& figures) {
  Progress progress("read", static_cast<std::uint32_t>(mcap.chunks().size()));
  for (std::size_t i = 0; i < mcap.chunks().size(); ++i) {
    if (interrupted()) return makeError(kUnreadable, "interrupted");
    progress.show(static_cast<std::uint32_t>(i));
    const auto messages = mcap.read(i);
    if (!messages) {
      ++figures.chunksLost;
      if (figures.damage.empty()) figures.damage = messages.error();
      continue;
    }
    for (const recording::Message& message : *messages) {
      const auto topic = reader.topicOf(message.channel);
      if (!topic) continue;
      ChannelFigures& channel = figures.channels[static_cast<std::size_t>(*topic)];
      ++channel.messages;
      channel.bytes += message.bytes.size();
      if (*topic == Topic::frames) countQuality(message.bytes, figures);
      if (recording::isReadable(*topic, message.bytes)) continue;
      if (figures.unreadable++ == 0) figures.firstUnreadable = nameOf(*topic);
    }
  }
  return {};
}

tl::expected<void, Error> decode(PlayedRecording& played, RecordingFigures& figures) {
  const auto all = figures.channels[static_cast<std::size_t>(Topic::frames)].messages;
  Progress progress("decode", static_cast<std::uint32_t>(all));
  for (std::uint32_t frame = 0;; ++frame) {
    if (interrupted()) return makeError(kUnreadable, "interrupted");
    progress.show(frame);
    const auto more = played.next();
    if (more && !*more) break;
    // Chunks that cannot be read are known, and faults are counted.
    if (more || cs_get_state(played.client()) != CS_STATE_FAILED) continue;
    if (figures.damage.empty()) figures.damage = more.error();
    break;
  }
  cs_get_statistics(played.client(), 0, &figures.stream.emplace());
  figures.faults = played.faults();
  return {};
}

std::string damageOf(const RecordingReader& reader, const RecordingFigures& figures,
                     const InfoOptions& options) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
  if (!reader.mcap().indexed()) add("the end is missing or damaged");
  if (!figures.damage.empty()) add(figures.damage);
  if (figures.faults.any()) add(figures.faults.text());
  if (figures.unreadable > 0)
    add(fmt::format("{} messages cannot be read, the first is in {}", figures.unreadable,
                    figures.firstUnreadable));
  if (!text.empty()) add(fmt::format("run clothstream recover {} OUT", options.recording));
  return text;
}

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.2f} MiB", static_cast<double>(bytes) / (1 << 20));
}

// Says how precise the frames are. Without reading them, as the program that made the recording states.
std::string qualityText(const RecordingReader& reader, const RecordingFigures& figures,
                        const InfoOptions& options) {
  if (options.quick) {
    const auto stated = reader.metadata().find(recording::kQualitiesEntry);
    return stated == reader.metadata().end()
               ? std::string()
               : fmt::format("quality   {} frames of quality 0, 1, 2, 3\n", printable(stated->second));
  }
  std::string list;
  for (std::size_t quality = 0; quality < figures.qualities.size(); ++quality)
    if (figures.qualities[quality] > 0)
      list += fmt::format("{}{} frames of quality {}", list.empty() ? "" : ", ", figures.qualities[quality],
                          quality);
  return list.empty() ? list : fmt::format("quality   {}\n", list);
}

std::string toText(const RecordingReader& reader, const RecordingFigures& figures, const std::string& damage,
                   const InfoOptions& options) {
  const auto value = [&](const char* name) { return printable(reader.metadata(name)); };
  std::string text = fmt::format(
      "file      {}, {}, {} chunks\n"
      "scene     {}, started {}, {:.1f} s, {} vertices\n"
      "server    {}\n"
      "device    {}; {}; processor {}\n"
      "stream    {} ticks/s, {} frames/s, codec {}, max error {} m\n",
      options.recording, mebibytes(reader.mcap().bytes()), reader.mcap().chunks().size(), value("scene"),
      value("started"), seconds(reader), value("vertices"), value("server"), value("device"), value("driver"),
      value("processor"), value("simulation_rate"), value("stream_rate"), value("codec"), value("max_error"));
  for (std::size_t i = 0; i < figures.channels.size(); ++i) {
    const ChannelFigures& channel = figures.channels[i];
    if (channel.messages == 0) continue;
    text += fmt::format("{:<14}{:>10} messages", recording::kTopicNames[i], channel.messages);
    if (!options.quick) text += fmt::format("{:>14}", mebibytes(channel.bytes));
    text += '\n';
  }
  if (figures.stream)
    text += fmt::format(
        "frames    {} decoded, {} of them key frames, {:.2f} bits a vertex; {} cannot be decoded; {} differ "
        "from the server's\n",
        figures.stream->frames, figures.stream->key_frames, figures.stream->bits_per_vertex,
        figures.faults.undecodable(), figures.faults.different());
  text += qualityText(reader, figures, options);
  if (!damage.empty()) return text + fmt::format("damaged   {}\n", printable(damage));
  return text +
         (options.quick ? "index     complete; the rest was not read\n" : "complete  all checksums match\n");
}

std::string toJson(const RecordingReader& reader, const RecordingFigures& figures, const std::string& damage,
                   const InfoOptions& options) {
  nlohmann::ordered_json json{{"file", options.recording},
                              {"bytes", reader.mcap().bytes()},
                              {"chunks", reader.mcap().chunks().size()},
                              {"seconds", seconds(reader)},
                              {"facts", reader.metadata()}};
  for (std::size_t i = 0; i < figures.channels.size(); ++i) {
    nlohmann::ordered_json channel{{"messages", figures.channels[i].messages}};
    if (!options.quick) channel["bytes"] = figures.channels[i].bytes;
    json["channels"][std::string(recording::kTopicNames[i])] = channel;
  }
  if (figures.stream)
    json["frames"] = {{"decoded", figures.stream->frames},
                      {"keyFrames", figures.stream->key_frames},
                      {"bitsPerVertex", figures.stream->bits_per_vertex},
                      {"undecodable", figures.faults.undecodable()},
                      {"hashMismatches", figures.faults.different()},
                      {"firstFault", nullptr},
                      {"qualities", figures.qualities}};
  if (figures.faults.any())
    json["frames"]["firstFault"] = {
        {"tick", figures.faults.firstTick() ? nlohmann::ordered_json(*figures.faults.firstTick())
                                            : nlohmann::ordered_json(nullptr)},
        {"seconds", figures.faults.firstSeconds()}};
  json["unreadableMessages"] = figures.unreadable;
  if (!options.quick || !damage.empty()) json["whole"] = damage.empty();
  if (!damage.empty()) json["damage"] = damage;
  return jsonText(json, 1) + '\n';
}

tl::expected<ExitCode, Error> run(const InfoOptions& options) {
  const auto open = [&] {
    return orError(kUnreadable,
                   RecordingReader::open(options.recording, recording::CutFiles::read, options.limits));
  };
  auto reader = open();
  if (!reader) return tl::unexpected(reader.error());
  RecordingFigures figures;
  if (options.quick) {
    countByIndex(*reader, figures);
  } else {
    {
      // Its largest chunk is freed before frames are decoded.
      auto file = orError(kUnreadable, recording::openFile(options.recording));
      if (!file) return tl::unexpected(file.error());
      auto mcap = orError(kUnreadable, recording::McapReader::open(std::move(*file), options.limits.mcap()));
      if (!mcap) return tl::unexpected(mcap.error());
      if (auto counted = countByReading(*mcap, *reader, figures); !counted)
        return tl::unexpected(counted.error());
      if (mcap->indexed() && figures.damage.empty())
        if (auto checked = mcap->check(); !checked) figures.damage = checked.error();
    }
    auto toPlay = open();
    if (!toPlay) return tl::unexpected(toPlay.error());
    auto played = PlayedRecording::open(std::move(*toPlay));
    if (!played && figures.damage.empty()) figures.damage = played.error();
    if (played)
      if (auto decoded = decode(*played, figures); !decoded) return tl::unexpected(decoded.error());
  }
  const std::string damage = damageOf(*reader, figures, options);
  put((options.json ? toJson : toText)(*reader, figures, damage, options));
  return damage.empty() ? kOk : kUnreadable;
}

}  // namespace

ExitCode info(const InfoOptions& options) {
  const auto code = run(options);
  return code ? *code : printError(code.error());
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
// Reads the index, then every chunk and every frame.
#include "clients/cli/info.h"

#include <array>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/error.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clients/recording/played_recording.h"
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
  std::string damage;  // first damage found; empty: none
  std::optional<cs_statistics> stream;
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
    if (!more && figures.damage.empty()) figures.damage = more.error();
    if (!more || !*more) break;
  }
  cs_get_statistics(played.client(), 0, &figures.stream.emplace());
  return {};
}

std::string damageOf(const RecordingReader& reader, const RecordingFigures& figures,
                     const InfoOptions& options) {
  if (!reader.mcap().indexed())
    return fmt::format("the end is missing or damaged; run clothstream recover {} OUT", options.recording);
  if (!figures.damage.empty()) return figures.damage;
  if (figures.stream && figures.stream->hash_mismatches > 0)
    return fmt::format("{} frames differ from the server's", figures.stream->hash_mismatches);
  return {};
}

std::string mebibytes(std::uint64_t bytes) {
  return fmt::format("{:.2f} MiB", static_cast<double>(bytes) / (1 << 20));
}

std::string toText(const RecordingReader& reader, const RecordingFigures& figures, const std::string& damage,
                   const InfoOptions& options) {
  const auto value = [&](const char* name) { return printable(reader.metadata(name)); };
  std::string text = fmt::format(
      "file      {}, {}, {} chunks\nscene     {}, started {}, {:.1f} s, {} vertices\nserver    {}\ndevice    "
      "{}; {}; "
      "processor {}\nstream    {} ticks/s, {} frames/s, codec {}, max error {} m\n",
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
        "frames    {} decoded, {} of them key frames, {:.2f} bits a vertex; {} differ from the server's\n",
        figures.stream->frames, figures.stream->key_frames, figures.stream->bits_per_vertex,
        figures.stream->hash_mismatches);
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
                      {"hashMismatches", figures.stream->hash_mismatches}};
  json["whole"] = damage.empty();
  if (!damage.empty()) json["damage"] = damage;
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

tl::expected<ExitCode, Error> run(const InfoOptions& options) {
  const auto open = [&] {
    return orError(kUnreadable, RecordingReader::open(options.recording, recording::CutFiles::read));
  };
  auto reader = open();
  if (!reader) return tl::unexpected(reader.error());
  RecordingFigures figures;
  if (options.quick) {
    countByIndex(*reader, figures);
  } else {
    auto file = orError(kUnreadable, recording::openFile(options.recording));
    if (!file) return tl::unexpected(file.error());
    auto mcap = orError(kUnreadable, recording::McapReader::open(std::move(*file)));
    if (!mcap) return tl::unexpected(mcap.error());
    if (auto counted = countByReading(*mcap, *reader, figures); !counted)
      return tl::unexpected(counted.error());
    if (auto checked = mcap->check(); !checked && figures.damage.empty()) figures.damage = checked.error();
    auto toPlay = open();
    if (!toPlay) return tl::unexpected(toPlay.error());
    auto played = PlayedRecording::open(std::move(*toPlay));
    if (!played && figures.damage.empty()) figures.damage = played.error();
    if (played)
      if (auto decoded = decode(*played, figures); !decoded) return tl::unexpected(decoded.error());
  }
  const std::string damage = damageOf(*reader, figures, options);
  fmt::print("{}", (options.json ? toJson : toText)(*reader, figures, damage, options));
  return damage.empty() ? kOk : kUnreadable;
}

}  // namespace

ExitCode info(const InfoOptions& options) {
  const auto code = run(options);
  return code ? *code : printError(code.error());
}

}  // namespace clothstream::cli

// SPDX-License-Identifier: MIT
// Reads the messages of a recording in playback order.
#include "server/recording/recorded_stream.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "proto/recording/recorded_description.h"
#include "server/messages/limits.h"

namespace clothstream::recording {
namespace {

bool isName(const std::string& text) {
  return !text.empty() && text.size() <= messages::limits::kMaxNameLength &&
         std::ranges::all_of(text, [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
         });
}

// Announcements about the scene. The others concern the server that recorded it.
bool isOfScene(v1::NoticeKind kind) {
  return kind == v1::NOTICE_KIND_ROLLED_BACK || kind == v1::NOTICE_KIND_DEVICE_REBUILT ||
         kind == v1::NOTICE_KIND_RUNNING_SLOW || kind == v1::NOTICE_KIND_CHANGE_UNDONE ||
         kind == v1::NOTICE_KIND_SCENE_RESET || kind == v1::NOTICE_KIND_LOAD_CHANGED;
}

template <typename MessageType>
bool parse(std::string_view bytes, MessageType* message) {
  return message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace

tl::expected<RecordedStream, std::string> RecordedStream::open(const std::string& path,
                                                               const ReadLimits& limits) {
  auto reader = RecordingReader::open(path, CutFiles::read, limits);
  if (!reader) return tl::unexpected(reader.error());
  const auto refused = [&](const std::string& why) {
    return tl::unexpected(fmt::format("{} cannot be played: {}", path, why));
  };
  auto stream = of(std::move(*reader));
  if (!stream) return refused(stream.error());
  for (;;) {
    const Next next = stream->next();
    const auto* timed = std::get_if<TimedMessage>(&next);
    if (timed != nullptr && timed->isFrame()) break;
    if (!std::holds_alternative<End>(next)) continue;
    if (stream->faults().any()) return refused(stream->faults().text());
    break;
  }
  stream->seek(0);
  stream->check_.clear();
  return stream;
}

tl::expected<void, std::string> RecordedStream::check() {
  if (auto checked = reader_.check(); !checked) return checked;
  for (;;) {
    const Next next = this->next();
    if (std::holds_alternative<End>(next)) break;
    if (const auto* lost = std::get_if<Lost>(&next); lost != nullptr && !faults().any())
      return tl::unexpected(fmt::format("{} is damaged: {}", reader_.name(), lost->reason));
  }
  if (faults().any())
    return tl::unexpected(fmt::format("{} is damaged: {}", reader_.name(), faults().text()));
  seek(0);
  check_.clear();
  return {};
}

tl::expected<RecordedStream, std::string> RecordedStream::of(RecordingReader reader) {
  auto description = readDescription(reader);
  if (!description) return tl::unexpected(description.error());
  const auto isRate = [](std::uint32_t rate) { return rate >= 1 && rate <= 1000; };
  if (!isRate(description->simulation_rate()) || !isRate(description->stream_rate()))
    return tl::unexpected(fmt::format("its rates of {} and {} per second are invalid for a stream",
                                      description->simulation_rate(), description->stream_rate()));
  auto check = FrameCheck::make(layoutOf(*description));
  if (!check) return tl::unexpected(check.error());
  return RecordedStream(std::move(reader), std::move(*description), std::move(*check));
}

RecordedStream::RecordedStream(RecordingReader reader, v1::StreamDescription description, FrameCheck check)
    : reader_(std::move(reader)),
      description_(std::move(description)),
      parameters_(reader_, description_),
      scene_(isName(description_.scene()) ? description_.scene() : "recording"),
      check_(std::move(check)) {}

double RecordedStream::secondsAt(std::uint64_t time) const {
  return time <= reader_.start() ? 0 : static_cast<double>(time - reader_.start()) * 1e-9;
}

std::uint64_t RecordedStream::timeAt(double seconds) const {
  return reader_.start() + static_cast<std::uint64_t>(std::llround(std::clamp(seconds, 0.0, length()) * 1e9));
}

void RecordedStream::restart() {
  newest_.reset();
  check_.restart();
}

void RecordedStream::lose(double from, std::string reason) {
  restart();
  if (!lost_) lost_ = Lost{.start = from, .end = from, .reason = std::move(reason)};
}

RecordedStream::Next RecordedStream::next() {
  while (!held_) {
    const auto message = reader_.next();
    if (!message) {
      const ChunkPlace passed = reader_.passChunk();
      lose(secondsAt(passed.start), message.error());
      lost_->end = std::max(lost_->end, secondsAt(passed.end));
      continue;
    }
    if (!*message) break;
    held_ = timedMessage(**message);
  }
  // A loss ends at the next frame that can be decoded.
  if (lost_ && (!held_ || held_->isFrame())) {
    if (held_) lost_->end = held_->time;
    return *std::exchange(lost_, std::nullopt);
  }
  if (!held_) return End{};
  return *std::exchange(held_, std::nullopt);
}

void RecordedStream::seek(double seconds) {
  std::uint64_t time = timeAt(seconds);
  restart();
  lost_.reset();
  held_.reset();
  // Skips unreadable parts backwards to the previous readable one.
  while (!reader_.seek(time)) {
    const ChunkPlace place = reader_.mcap().chunks()[reader_.mcap().chunkAt(time)];
    if (place.start <= reader_.start()) return reader_.rewind();
    time = place.start - 1;
  }
}

ParametersInForce RecordedStream::parametersAt(double seconds) {
  return parameters_.at(timeAt(seconds), reader_);
}

std::optional<RecordedStream::TimedMessage> RecordedStream::timedMessage(const RecordedMessage& message) {
  TimedMessage timed{.time = secondsAt(message.time)};
  switch (message.topic) {
    case Topic::frames:
      return frame(message);
    case Topic::parameters:
      if (parse(message.bytes, timed.message.mutable_parameter_changed())) return timed;
      break;
    case Topic::events:
      if (parse(message.bytes, timed.message.mutable_tick_events())) return timed;
      break;
    case Topic::notices:
      if (!parse(message.bytes, timed.message.mutable_notice())) break;
      if (isOfScene(timed.message.notice().kind())) return timed;
      return std::nullopt;
    default:
      return std::nullopt;
  }
  lose(timed.time, "a message in it cannot be read");
  return std::nullopt;
}

std::optional<RecordedStream::TimedMessage> RecordedStream::frame(const RecordedMessage& message) {
  TimedMessage timed{.time = secondsAt(message.time)};
  const auto refuse = [&](std::string reason) -> std::optional<TimedMessage> {
    lose(timed.time, std::move(reason));
    return std::nullopt;
  };
  const FrameCheck::Outcome outcome = check_.take(message.bytes, timed.time);
  if (outcome == FrameCheck::Outcome::repeated) return std::nullopt;
  if (outcome == FrameCheck::Outcome::faulty) return refuse(check_.reason());
  if (!parse(message.bytes, timed.message.mutable_frame())) return refuse("a frame in it cannot be read");
  timed.header = codec::parsePacket(std::as_bytes(std::span(timed.message.frame().packet())))->header;
  const bool key = timed.header.kind == codec::PacketKind::key;
  if (!key && newest_ && timed.header.tick - *newest_ > kMaxTickStep)
    return refuse("a frame in it is too far from the frame before");
  newest_ = timed.header.tick;
  return timed;
}

}  // namespace clothstream::recording

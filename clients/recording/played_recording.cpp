// SPDX-License-Identifier: MIT
// Gives recorded messages to a client, as a server would send them.
#include "clients/recording/played_recording.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include <protozero/pbf_writer.hpp>

#include "proto/codec/packet_header.h"

namespace clothstream::client {
namespace {

using recording::RecordedMessage;
using recording::Topic;
using Writer = protozero::pbf_writer;

constexpr std::size_t kChunkBytes = 256 * 1024;
constexpr std::uint64_t kContentId = 1;

Bytes bytesOf(std::string_view bytes) {
  return {bytes.data(), bytes.size()};
}

// CS_RECORDED value; 0 for messages that are not reported.
std::uint32_t kindOf(Topic topic) {
  switch (topic) {
    case Topic::frames:
      return CS_RECORDED_FRAME;
    case Topic::parameters:
      return CS_RECORDED_PARAMETERS;
    case Topic::events:
      return CS_RECORDED_EVENTS;
    case Topic::notices:
      return CS_RECORDED_NOTICE;
    case Topic::participants:
      return CS_RECORDED_PARTICIPANT;
    case Topic::scene:
      return CS_RECORDED_SCENE;
    case Topic::ticks:
      return CS_RECORDED_TICK;
    case Topic::checkpoints:
      return CS_RECORDED_CHECKPOINT;
    case Topic::description:
    case Topic::reports:
      return 0;
  }
  return 0;
}

std::uint64_t varintOf(std::string_view message, field::Field wanted) {
  std::uint64_t value = 0;
  const bool read = readFields(bytesOf(message), [&](std::uint32_t tag, Reader& reader) {
    return tag == wanted.tag ? set(value, reader.get_uint64()) : skip(reader);
  });
  return read ? value : 0;
}

std::optional<codec::PacketHeader> headerOf(Bytes packet) {
  const auto parsed = codec::parsePacket(std::as_bytes(std::span(packet.data(), packet.size())));
  if (!parsed) return std::nullopt;
  return parsed->header;
}

cs_client* createCore() {
  cs_client_options options{};
  options.client_name = "recording";
  return cs_create(&options);
}

}  // namespace

PlayedRecording::PlayedRecording(recording::RecordingReader reader)
    : reader_(std::move(reader)), client_(createCore(), &cs_destroy) {}

tl::expected<PlayedRecording, std::string> PlayedRecording::open(recording::RecordingReader reader) {
  PlayedRecording played(std::move(reader));
  cs_limits limits;
  cs_default_limits(&limits);
  limits.max_vertices = played.reader_.limits().vertices;
  limits.max_triangles = 2 * limits.max_vertices;
  if (cs_set_limits(played.client_.get(), &limits) == 0)
    return tl::unexpected("a recording of up to " + std::to_string(limits.max_vertices) +
                          " vertices cannot be played; use 1 to " + std::to_string(codec::kMaxVertices));
  played.frameTime_ = played.time_ = played.reader_.start();
  std::string welcome;
  Writer message(welcome);
  message.add_uint32(field::Welcome::kProtocolVersion.number, CS_PROTOCOL_VERSION);
  message.add_uint64(field::Welcome::kDescriptionContentId.number, kContentId);
  message.add_string(field::Welcome::kServerName.number, played.reader_.metadata("server"));
  message.add_string(field::Welcome::kDeviceName.number, played.reader_.metadata("device"));
  message.add_string(field::Welcome::kScene.number, played.reader_.metadata("scene"));
  message.add_uint32(field::Welcome::kCodec.number, codec::kCodecHierarchical);
  played.give(field::ServerMessage::kWelcome, welcome, played.time_);
  if (auto described = played.describe(); !described) return tl::unexpected(described.error());
  return played;
}

tl::expected<void, std::string> PlayedRecording::describe() {
  const auto description = reader_.description();
  if (!description) return tl::unexpected(description.error());
  const std::size_t count = std::max<std::size_t>(1, (description->size() + kChunkBytes - 1) / kChunkBytes);
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string_view piece = std::string_view(*description).substr(i * kChunkBytes, kChunkBytes);
    bytes.clear();
    Writer chunk(bytes);
    chunk.add_uint64(field::Chunk::kContentId.number, kContentId);
    chunk.add_enum(field::Chunk::kKind.number, field::ContentKind::kStreamDescription);
    chunk.add_uint32(field::Chunk::kIndex.number, static_cast<std::uint32_t>(i));
    chunk.add_uint32(field::Chunk::kCount.number, static_cast<std::uint32_t>(count));
    chunk.add_uint64(field::Chunk::kTotalBytes.number, description->size());
    chunk.add_bytes(field::Chunk::kData.number, piece.data(), piece.size());
    give(field::ServerMessage::kChunk, bytes, time_);
  }
  if (cs_get_state(client()) == CS_STATE_JOINED) return {};
  return tl::unexpected(std::string("the recorded stream cannot be played: ") + cs_error_text(client()));
}

std::uint32_t PlayedRecording::give(field::Field body, std::string_view message, std::uint64_t time) {
  envelope_.clear();
  Writer(envelope_).add_bytes(body.number, message.data(), message.size());
  const std::uint32_t events = cs_receive(
      client_.get(), reinterpret_cast<const std::uint8_t*>(envelope_.data()), envelope_.size(), time / 1000);
  // Discards requests and acknowledgements of the client.
  for (std::size_t size = 0; cs_next_outgoing(client_.get(), &size) != nullptr;) {
  }
  return events;
}

std::uint32_t PlayedRecording::givePresence(std::uint32_t kind, const cs_participant& participant,
                                            std::uint64_t time) {
  std::string bytes;
  Writer presence(bytes);
  presence.add_uint32(field::Presence::kKind.number, kind);
  {
    Writer message(presence, field::Presence::kParticipant.number);
    message.add_uint64(field::Participant::kId.number, participant.id);
    message.add_string(field::Participant::kDisplayName.number, participant.name);
    message.add_string(field::Participant::kClientName.number, participant.client_name);
  }
  return give(field::ServerMessage::kPresence, bytes, time);
}

bool PlayedRecording::applyParticipant(std::string_view message, PlayedMessage& played) {
  const std::optional<ParticipantEvent> event = readParticipantEvent(bytesOf(message));
  if (!event) return false;
  cs_participant participant{.id = event->id,
                             .name = event->name.c_str(),
                             .client_name = event->clientName.c_str(),
                             .role = 0,
                             .away = 0};
  if (event->kind == field::ParticipantEventKind::kJoined) {
    played.events = givePresence(CS_PRESENCE_JOINED, participant, played.time);
  } else if (event->kind == field::ParticipantEventKind::kLeft) {
    // The event has no names; the client knows them.
    cs_participant known{};
    std::string name, clientName;
    for (std::uint32_t i = 0; cs_get_participant(client(), i, &known) != 0; ++i) {
      if (known.id != participant.id) continue;
      name = known.name;
      clientName = known.client_name;
    }
    participant.name = name.c_str();
    participant.client_name = clientName.c_str();
    played.events = givePresence(CS_PRESENCE_LEFT, participant, played.time);
  }
  return true;
}

bool PlayedRecording::applyJournal(const RecordedMessage& message, PlayedMessage& played) {
  if (message.topic == Topic::ticks) {
    tick_ = readRecordedTick(bytesOf(message.bytes));
    if (!tick_) return false;
    played.tick = tick_->tick;
    played.stateHash = tick_->stateHash;
  } else if (message.topic == Topic::checkpoints) {
    checkpoint_ = readCheckpoint(bytesOf(message.bytes));
    if (!checkpoint_) return false;
    played.tick = checkpoint_->tick;
  }
  return true;
}

PlayedRecording::Played PlayedRecording::applyFrame(const RecordedMessage& message, PlayedMessage played) {
  if (!readFrame(bytesOf(message.bytes), frame_)) frame_ = {};
  const double seconds = secondsOf(message.time);
  const auto header = headerOf(frame_.packet);
  const auto tick = header ? std::optional(header->tick) : std::nullopt;
  const std::string name = "the frame of " + recording::FrameFaults::nameOf(tick, seconds);
  played.key = header && header->kind == codec::PacketKind::key;
  const bool mayFollow = faults_.mayFollow(played.key);
  if (mayFollow) played.events = give(field::ServerMessage::kFrame, message.bytes, message.time);
  if (cs_get_state(client()) == CS_STATE_FAILED) return tl::unexpected(std::string(cs_error_text(client())));
  if ((played.events & CS_EVENT_FRAME) == 0) {
    const bool repeats = mayFollow && newestFrame_ && tick == newestFrame_->tick &&
                         frame_.reconstructionHash == newestFrame_->reconstructionHash;
    if (repeats) {
      faults_.addGood();
      return std::nullopt;
    }
    faults_.addUndecodable(tick, seconds);
    return fault(name + " cannot be decoded");
  }
  if (cs_reconstruction_hash(client()) != frame_.reconstructionHash) {
    faults_.addDifferent(*tick, seconds);
    return fault(name + " differs from its recorded hash");
  }
  faults_.addGood();
  isLost_ = false;
  played.tick = *tick;
  played.reconstructionHash = frame_.reconstructionHash;
  played.stateHash = frame_.stateHash;
  frameTime_ = message.time;
  newestFrame_ = played;
  newestFrame_->bytes = {};
  return played;
}

// Frames after a fault refer to it, up to the next key frame.
PlayedRecording::Played PlayedRecording::fault(std::string what) {
  if (std::exchange(isLost_, true)) return std::nullopt;
  return tl::unexpected(std::move(what));
}

bool PlayedRecording::readToTheEnd() {
  for (;;) {
    const Played frame = next(CS_RECORDED_FRAME);
    if (frame && !*frame) return true;
    if (!frame && cs_get_state(client()) == CS_STATE_FAILED) return false;
  }
}

PlayedRecording::Played PlayedRecording::apply(const RecordedMessage& message) {
  PlayedMessage played{.kind = kindOf(message.topic), .time = message.time, .bytes = message.bytes};
  if (played.kind == 0) return std::nullopt;
  time_ = message.time;
  const auto malformed = [&](const char* what) {
    return tl::unexpected(std::string("the recording has a malformed ") + what);
  };
  switch (message.topic) {
    case Topic::frames:
      return applyFrame(message, played);
    case Topic::parameters:
      played.events = give(field::ServerMessage::kParameterChanged, message.bytes, message.time);
      played.tick = varintOf(message.bytes, field::ParameterChanged::kTick);
      break;
    case Topic::events:
      played.events = give(field::ServerMessage::kTickEvents, message.bytes, message.time);
      played.tick = varintOf(message.bytes, field::TickEvents::kTick);
      break;
    case Topic::notices:
      played.events = give(field::ServerMessage::kNotice, message.bytes, message.time);
      break;
    case Topic::participants:
      if (!applyParticipant(message.bytes, played)) return malformed("ParticipantEvent");
      break;
    case Topic::ticks:
      if (!applyJournal(message, played)) return malformed("RecordedTick");
      break;
    case Topic::checkpoints:
      if (!applyJournal(message, played)) return malformed("Checkpoint");
      break;
    case Topic::scene:
    case Topic::description:
    case Topic::reports:
      break;
  }
  if (cs_get_state(client()) == CS_STATE_FAILED) return tl::unexpected(std::string(cs_error_text(client())));
  return played;
}

PlayedRecording::Played PlayedRecording::next(std::uint32_t kinds) {
  for (;;) {
    if (cs_get_state(client()) == CS_STATE_FAILED)
      return tl::unexpected(std::string(cs_error_text(client())));
    const auto message = reader_.next();
    if (!message) {
      reader_.passChunk();
      isLost_ = true;
      return tl::unexpected(message.error());
    }
    if (!*message) return std::nullopt;
    Played played = apply(**message);
    if (!played || (*played && ((*played)->kind & kinds) != 0)) return played;
  }
}

tl::expected<bool, std::string> PlayedRecording::next() {
  const Played frame = next(CS_RECORDED_FRAME);
  if (!frame) return tl::unexpected(frame.error());
  return frame->has_value();
}

// Applies what holds at `to` besides its frame. Chunks that cannot be read are left out.
void PlayedRecording::applyHistory(const Place& from, const Place& to) {
  const std::size_t chunks = reader_.mcap().chunks().size();
  for (std::size_t chunk = from.chunk; chunk <= to.chunk && chunk < chunks; ++chunk) {
    const std::size_t first = chunk == from.chunk ? from.message : 0;
    const std::size_t end = chunk == to.chunk ? to.message : std::numeric_limits<std::size_t>::max();
    for (const Topic topic : {Topic::parameters, Topic::participants}) {
      const auto messages = reader_.messages(chunk, topic, first, end);
      if (!messages) break;
      for (const RecordedMessage& message : *messages) static_cast<void>(apply(message));
    }
  }
}

PlayedRecording::Played PlayedRecording::seekTo(std::uint64_t time, std::optional<std::uint64_t> tick) {
  if (cs_get_state(client()) == CS_STATE_FAILED) return tl::unexpected(std::string(cs_error_text(client())));
  const Place here = reader_.place();
  isLost_ = false;
  if (auto sought = reader_.seek(time); !sought) {
    reader_.go(here);
    return tl::unexpected(sought.error());
  }
  const Place key = reader_.place();
  const bool isPast = time_ > time || (tick && newestFrame_ && newestFrame_->tick > *tick);
  if (isPast || key > here) {
    newestFrame_.reset();
    tick_.reset();
    checkpoint_.reset();
    if (isPast) {
      if (auto described = describe(); !described) return tl::unexpected(described.error());
      for (cs_participant participant; cs_get_participant(client(), 0, &participant) != 0;)
        if (givePresence(CS_PRESENCE_LEFT, participant, time) == 0) break;
    }
    applyHistory(isPast ? Place{} : here, key);
    reader_.go(key);
  } else {
    reader_.go(here);
  }
  for (;;) {
    const Place place = reader_.place();
    const auto message = reader_.next();
    if (!message) {
      reader_.passChunk();
      isLost_ = true;
      return tl::unexpected(message.error());
    }
    if (!*message) break;
    const bool isLater =
        (*message)->time > time ||
        (tick && (*message)->topic == Topic::frames && readFrame(bytesOf((*message)->bytes), frame_) &&
         headerOf(frame_.packet).value_or(codec::PacketHeader{}).tick > *tick);
    if (isLater) {
      reader_.go(place);
      break;
    }
    if (Played played = apply(**message); !played) return played;
  }
  return newestFrame_;
}

PlayedRecording::Played PlayedRecording::seek(std::uint64_t time) {
  return seekTo(time, std::nullopt);
}

std::optional<std::uint64_t> PlayedRecording::firstTickIn(std::size_t chunk) {
  const auto frames = reader_.messages(chunk, Topic::frames);
  if (!frames) return std::nullopt;
  for (const RecordedMessage& message : *frames) {
    if (!readFrame(bytesOf(message.bytes), frame_)) continue;
    if (const auto header = headerOf(frame_.packet)) return header->tick;
  }
  return std::nullopt;
}

PlayedRecording::Played PlayedRecording::seekTick(std::uint64_t tick) {
  // Bisection: chunks before `low` start with ticks that are not later, those from `high` on with later ones.
  std::size_t low = 0;
  for (std::size_t high = reader_.mcap().chunks().size(); low < high;) {
    const std::size_t middle = low + (high - low) / 2;
    std::size_t chunk = middle;
    std::optional<std::uint64_t> first;
    while (chunk < high && !(first = firstTickIn(chunk))) ++chunk;
    if (first && *first <= tick)
      low = chunk + 1;
    else
      high = middle;
  }
  std::uint64_t time = 0;
  if (low > 0)
    if (const auto frames = reader_.messages(low - 1, Topic::frames)) {
      for (const RecordedMessage& message : *frames) {
        if (!readFrame(bytesOf(message.bytes), frame_)) continue;
        const auto header = headerOf(frame_.packet);
        if (header && header->tick <= tick) time = message.time;
      }
    }
  return seekTo(time, tick);
}

}  // namespace clothstream::client

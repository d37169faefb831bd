// SPDX-License-Identifier: MIT
// Field by field through the messages of session.proto that a client gets.
#include "clients/core/server_message.h"

#include <array>
#include <cmath>

#include "clients/core/collider.h"

namespace clothstream::client {
namespace {

bool readClothReport(Bytes message, ClothReport& report) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case fixed32(1):
        return setFinite(report.strainMax, reader);
      case fixed32(2):
        return setFinite(report.strainP99, reader);
      case fixed32(3):
        return setFinite(report.strainMean, reader);
      case fixed32(4):
        return setFinite(report.kineticEnergy, reader);
      case fixed32(5):
        return setFinite(report.elasticEnergy, reader);
      case fixed32(6):
        return setFinite(report.gravityEnergy, reader);
      case varint(7):
        return set(report.activeConstraints, reader.get_uint32());
      case varint(8):
        return set(report.iterations, reader.get_uint32());
      case fixed32(9):
        return setFinite(report.residual, reader);
      case fixed32(10):
        return setFinite(report.penetration, reader);
      default:
        return skip(reader);
    }
  });
}

bool readParticipant(Bytes message, Participant& out) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(out.id, reader.get_uint64());
      case bytes(2):
        return setText(out.name, reader);
      case bytes(3):
        return setText(out.clientName, reader);
      case varint(4):
        return set(out.role, reader.get_uint32());
      case varint(5):
        return set(out.away, reader.get_bool());
      default:
        return skip(reader);
    }
  });
}

Body bodyOf(std::uint32_t field) {
  constexpr std::array kKnown{Body::welcome,  Body::chunk,      Body::frame,
                              Body::pong,     Body::notice,     Body::parameterChanged,
                              Body::error,    Body::tickEvents, Body::listScenes,
                              Body::presence, Body::playback,   Body::operatingPoint};
  for (const Body body : kKnown) {
    if (field == bytes(static_cast<std::uint32_t>(body))) return body;
  }
  return Body::none;
}

}  // namespace

std::optional<ServerMessage> readServerMessage(Bytes bytes) {
  return readMessage<ServerMessage>(bytes, [](ServerMessage& message, std::uint32_t field, Reader& reader) {
    const Body body = bodyOf(field);
    if (body == Body::none) return skip(reader);
    message = {body, reader.get_view()};
    return true;
  });
}

std::optional<Welcome> readWelcome(Bytes message) {
  return readMessage<Welcome>(message, [](Welcome& welcome, std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(welcome.protocolVersion, reader.get_uint32());
      case varint(2):
        return set(welcome.codec, reader.get_uint32());
      case bytes(3):
        return setText(welcome.scene, reader);
      case varint(4):
        return set(welcome.participantId, reader.get_uint64());
      case bytes(5):
        return setText(welcome.serverName, reader);
      case bytes(6):
        return setText(welcome.deviceName, reader);
      case varint(7):
        return set(welcome.contentId, reader.get_uint64());
      case varint(30):
        return set(welcome.role, reader.get_uint32());
      case bytes(31):
        return setText(welcome.token, reader);
      case varint(32):
        return set(welcome.resumed, reader.get_bool());
      case bytes(33):
        return welcome.participants.size() < kMaxParticipants &&
               readParticipant(reader.get_view(), welcome.participants.emplace_back());
      case varint(34):
        return set(welcome.holdMs, reader.get_uint32());
      default:
        return skip(reader);
    }
  });
}

std::optional<Chunk> readChunk(Bytes message) {
  return readMessage<Chunk>(message, [](Chunk& chunk, std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(chunk.contentId, reader.get_uint64());
      case varint(2):
        return set(chunk.kind, reader.get_uint32());
      case varint(3):
        return set(chunk.index, reader.get_uint32());
      case varint(4):
        return set(chunk.count, reader.get_uint32());
      case varint(5):
        return set(chunk.totalBytes, reader.get_uint64());
      case bytes(6):
        return set(chunk.data, reader.get_view());
      default:
        return skip(reader);
    }
  });
}

bool readFrame(Bytes message, Frame& frame) {
  frame.packet = {};
  frame.tickTimeUs = frame.packetTimeUs = 0;
  frame.reconstructionHash = 0;
  frame.colliders.clear();
  frame.report.reset();
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return set(frame.packet, reader.get_view());
      case varint(2):
        return set(frame.tickTimeUs, reader.get_uint64());
      case varint(3):
        return set(frame.packetTimeUs, reader.get_uint64());
      case fixed64(4):
        return set(frame.reconstructionHash, reader.get_fixed64());
      case bytes(6):
        if (frame.colliders.size() == kMaxSceneColliders) return false;
        frame.colliders.push_back(reader.get_view());
        return true;
      case bytes(7):
        frame.report = reader.get_view();
        return true;
      default:
        return skip(reader);
    }
  });
}

std::optional<Pong> readPong(Bytes message) {
  return readMessage<Pong>(message, [](Pong& pong, std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(pong.clientTimeUs, reader.get_uint64());
      case varint(2):
        return set(pong.serverTimeUs, reader.get_uint64());
      default:
        return skip(reader);
    }
  });
}

std::optional<cs_playback> readPlayback(Bytes message) {
  std::optional<cs_playback> playback =
      readMessage<cs_playback>(message, [](cs_playback& out, std::uint32_t field, Reader& reader) {
        switch (field) {
          case fixed64(1):
            return std::isfinite(out.length = reader.get_double());
          case fixed64(2):
            return std::isfinite(out.position = reader.get_double());
          case fixed64(3):
            return std::isfinite(out.speed = reader.get_double());
          case varint(4):
            return set(out.loop, reader.get_bool() ? 1 : 0);
          case varint(5):
            return set(out.paused, reader.get_bool() ? 1 : 0);
          default:
            return skip(reader);
        }
      });
  if (playback && !(playback->length >= 0)) playback.reset();
  return playback;
}

std::optional<OperatingPoint> readOperatingPoint(Bytes message) {
  return readMessage<OperatingPoint>(message, [](OperatingPoint& point, std::uint32_t field, Reader& reader) {
    if (field == varint(1)) return set(point.quality, reader.get_uint32());
    return field == varint(2) ? set(point.temporalLayers, reader.get_uint32()) : skip(reader);
  });
}

std::optional<Notice> readNotice(Bytes message) {
  return readMessage<Notice>(message, [](Notice& notice, std::uint32_t field, Reader& reader) {
    if (field == varint(30)) return set(notice.participantId, reader.get_uint64());
    return field == bytes(2) ? setText(notice.text, reader) : skip(reader);
  });
}

std::optional<Presence> readPresence(Bytes message) {
  return readMessage<Presence>(message, [](Presence& presence, std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(presence.kind, reader.get_uint32());
      case bytes(2):
        return readParticipant(reader.get_view(), presence.participant);
      case varint(3):
        return set(presence.reason, reader.get_uint32());
      case varint(4):
        return set(presence.by, reader.get_uint64());
      default:
        return skip(reader);
    }
  });
}

std::optional<ParameterChange> readParameterChanged(Bytes message) {
  return readMessage<ParameterChange>(
      message, [](ParameterChange& change, std::uint32_t field, Reader& reader) {
        if (field == varint(2)) return set(change.participantId, reader.get_uint64());
        return field == bytes(1) ? readParameterChange(reader.get_view(), change) : skip(reader);
      });
}

std::optional<ServerError> readError(Bytes message) {
  return readMessage<ServerError>(message, [](ServerError& error, std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(error.code, reader.get_uint32());
      case bytes(2):
        return setText(error.text, reader);
      case varint(3):
        return set(error.fatal, reader.get_bool());
      default:
        return skip(reader);
    }
  });
}

namespace {

bool readGrabEvent(Bytes message, cs_grab_event& out) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(out.participant_id, reader.get_uint64());
      case varint(2):
        return set(out.grab_id, reader.get_uint32());
      case varint(3):
        return set(out.kind, reader.get_uint32());
      case varint(4):
        return set(out.vertices, reader.get_uint32());
      default:
        return skip(reader);
    }
  });
}

bool readContactEvent(Bytes message, ContactEvent& out) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case varint(1):
        return set(out.kind, reader.get_uint32());
      case bytes(2):
        return setText(out.collider, reader);
      case varint(3):
        return set(out.participantId, reader.get_uint64());
      case varint(4):
        return set(out.colliderId, reader.get_uint32());
      case bytes(5):
        return setText(out.cloth, reader);
      case fixed32(6):
        return std::isfinite(out.impulse = reader.get_float());
      case fixed32(7):
        return std::isfinite(out.seconds = reader.get_float());
      default:
        return skip(reader);
    }
  });
}

}  // namespace

bool readTickEvents(Bytes message, TickEvents& events) {
  events = {};
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == bytes(2))
      return events.grabs.size() < kMaxEvents &&
             readGrabEvent(reader.get_view(), events.grabs.emplace_back());
    if (field == bytes(3))
      return events.contacts.size() < kMaxEvents &&
             readContactEvent(reader.get_view(), events.contacts.emplace_back());
    return skip(reader);
  });
}

std::optional<std::vector<std::string>> readScenes(Bytes message) {
  using Names = std::vector<std::string>;
  return readMessage<Names>(message, [](Names& names, std::uint32_t field, Reader& reader) {
    if (field != bytes(1)) return skip(reader);
    if (names.size() == kMaxScenes) return false;
    std::string& name = names.emplace_back();
    return readFields(reader.get_view(), [&](std::uint32_t summaryField, Reader& summary) {
      return summaryField == bytes(1) ? setText(name, summary) : skip(summary);
    });
  });
}

bool readReport(Bytes message, SimulationReport& out) {
  out.cloths.clear();
  out.deviceSeconds = 0;
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == fixed64(2)) return std::isfinite(out.deviceSeconds = reader.get_double());
    if (field != bytes(1)) return skip(reader);
    return out.cloths.size() < kMaxCloths && readClothReport(reader.get_view(), out.cloths.emplace_back());
  });
}

}  // namespace clothstream::client

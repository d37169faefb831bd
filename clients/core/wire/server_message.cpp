// SPDX-License-Identifier: MIT
// Reads the messages of session.proto that a server sends, field by field.
#include "clients/core/wire/server_message.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "clients/core/wire/collider.h"

namespace clothstream::client {
namespace {

// The C interface returns these values as they are on the wire.
static_assert(CS_ROLE_VIEWER == field::Role::kViewer && CS_ROLE_PARTICIPANT == field::Role::kParticipant &&
              CS_ROLE_OWNER == field::Role::kOwner);
static_assert(CS_PRESENCE_JOINED == field::PresenceKind::kJoined &&
              CS_PRESENCE_LEFT == field::PresenceKind::kLeft &&
              CS_PRESENCE_ROLE_CHANGED == field::PresenceKind::kRoleChanged &&
              CS_PRESENCE_DISCONNECTED == field::PresenceKind::kDisconnected &&
              CS_PRESENCE_RETURNED == field::PresenceKind::kReturned &&
              CS_PRESENCE_BODY_CHANGED == field::PresenceKind::kBodyChanged);
static_assert(CS_LEAVE_LEFT == field::LeaveReason::kLeft &&
              CS_LEAVE_TIMED_OUT == field::LeaveReason::kTimedOut &&
              CS_LEAVE_REMOVED == field::LeaveReason::kRemoved);
static_assert(CS_GRAB_TAKEN == field::GrabEventKind::kTaken &&
              CS_GRAB_SLIPPED == field::GrabEventKind::kSlipped &&
              CS_GRAB_RELEASED == field::GrabEventKind::kReleased);
static_assert(CS_CONTACT_BEGAN == field::ContactEventKind::kBegan &&
              CS_CONTACT_ENDED == field::ContactEventKind::kEnded);
static_assert(CS_HAND_LEFT == field::HandSide::kLeft && CS_HAND_RIGHT == field::HandSide::kRight);

bool readClothReport(Bytes message, ClothReport& report) {
  using F = field::ClothReport;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kStrainMax.tag:
        return setFinite(report.strainMax, reader);
      case F::kStrainP99.tag:
        return setFinite(report.strainP99, reader);
      case F::kStrainMean.tag:
        return setFinite(report.strainMean, reader);
      case F::kKineticEnergy.tag:
        return setFinite(report.kineticEnergy, reader);
      case F::kElasticEnergy.tag:
        return setFinite(report.elasticEnergy, reader);
      case F::kGravityEnergy.tag:
        return setFinite(report.gravityEnergy, reader);
      case F::kActiveConstraints.tag:
        return set(report.activeConstraints, reader.get_uint32());
      case F::kIterations.tag:
        return set(report.iterations, reader.get_uint32());
      case F::kResidual.tag:
        return setFinite(report.residual, reader);
      case F::kPenetration.tag:
        return setFinite(report.penetration, reader);
      case F::kConstraintEnds.tag:
        return readPackedVarints(reader.get_view(), kMaxConstraintEnds, report.constraintEnds);
      default:
        return skip(reader);
    }
  });
}

bool readParticipant(Bytes message, Participant& out) {
  using F = field::Participant;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kId.tag:
        return set(out.id, reader.get_uint64());
      case F::kDisplayName.tag:
        return setText(out.name, reader) && out.name.size() <= kMaxNameBytes;
      case F::kClientName.tag:
        return setText(out.clientName, reader) && out.clientName.size() <= kMaxNameBytes;
      case F::kRole.tag:
        return set(out.role, reader.get_uint32());
      case F::kAway.tag:
        return set(out.away, reader.get_bool());
      case F::kBody.tag:
        return setText(out.body, reader) && out.body.size() <= kMaxNameBytes;
      default:
        return skip(reader);
    }
  });
}

Body bodyOf(std::uint32_t tag) {
  constexpr std::array kKnown{Body::welcome,        Body::chunk,
                              Body::frame,          Body::pong,
                              Body::notice,         Body::parameterChanged,
                              Body::error,          Body::tickEvents,
                              Body::listScenes,     Body::presence,
                              Body::playback,       Body::operatingPoint,
                              Body::authenticate,   Body::createPairingCode,
                              Body::getScene,       Body::createScene,
                              Body::deleteScene,    Body::controlScene,
                              Body::startRecording, Body::stopRecording,
                              Body::listBans,       Body::liftBan,
                              Body::moving,         Body::datagramAnswer,
                              Body::roomSurfaces,   Body::getSurfacePart};
  for (const Body body : kKnown) {
    if (tag == bytes(static_cast<std::uint32_t>(body))) return body;
  }
  return Body::none;
}

}  // namespace

std::optional<ServerMessage> readServerMessage(Bytes bytes) {
  return readMessage<ServerMessage>(bytes, [](ServerMessage& message, std::uint32_t tag, Reader& reader) {
    if (tag == field::ServerMessage::kRequestId.tag) return set(message.requestId, reader.get_uint64());
    const Body body = bodyOf(tag);
    if (body == Body::none) return skip(reader);
    message.kind = body;
    message.body = reader.get_view();
    return true;
  });
}

std::optional<Welcome> readWelcome(Bytes message, const Limits& limits) {
  using F = field::Welcome;
  return readMessage<Welcome>(message, [&](Welcome& welcome, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kProtocolVersion.tag:
        return set(welcome.protocolVersion, reader.get_uint32());
      case F::kCodec.tag:
        return set(welcome.codec, reader.get_uint32());
      case F::kScene.tag:
        return setText(welcome.scene, reader);
      case F::kParticipantId.tag:
        return set(welcome.participantId, reader.get_uint64());
      case F::kServerName.tag:
        return setText(welcome.serverName, reader);
      case F::kDeviceName.tag:
        return setText(welcome.deviceName, reader);
      case F::kDescriptionContentId.tag:
        return set(welcome.contentId, reader.get_uint64());
      case F::kRole.tag:
        return set(welcome.role, reader.get_uint32());
      case F::kResumeToken.tag:
        return setBytes(welcome.token, reader) && welcome.token.size() <= kMaxResumeTokenBytes;
      case F::kResumed.tag:
        return set(welcome.resumed, reader.get_bool());
      case F::kParticipants.tag:
        if (welcome.participants.size() > limits.participants) return skip(reader);
        return readParticipant(reader.get_view(), welcome.participants.emplace_back());
      case F::kHoldMs.tag:
        return set(welcome.graceMs, reader.get_uint32());
      case F::kAcknowledgeEveryFrame.tag:
        return set(welcome.acknowledgeEveryFrame, reader.get_bool());
      case F::kSurfaces.tag:
        return readFields(reader.get_view(), [&](std::uint32_t limit, Reader& numbers) {
          if (limit == field::SurfaceLimits::kPolicy.tag)
            return set(welcome.surfacePolicy, numbers.get_uint32());
          return skip(numbers);
        });
      default:
        return skip(reader);
    }
  });
}

std::optional<Chunk> readChunk(Bytes message) {
  using F = field::Chunk;
  return readMessage<Chunk>(message, [](Chunk& chunk, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kContentId.tag:
        return set(chunk.contentId, reader.get_uint64());
      case F::kKind.tag:
        return set(chunk.kind, reader.get_uint32());
      case F::kIndex.tag:
        return set(chunk.index, reader.get_uint32());
      case F::kCount.tag:
        return set(chunk.count, reader.get_uint32());
      case F::kTotalBytes.tag:
        return set(chunk.totalBytes, reader.get_uint64());
      case F::kData.tag:
        return set(chunk.data, reader.get_view());
      default:
        return skip(reader);
    }
  });
}

bool readFrame(Bytes message, Frame& frame) {
  using F = field::Frame;
  frame.packet = {};
  frame.tickTimeUs = frame.packetTimeUs = 0;
  frame.reconstructionHash = frame.stateHash = 0;
  frame.colliders.clear();
  frame.report.reset();
  frame.divisor = 1;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kPacket.tag:
        return set(frame.packet, reader.get_view());
      case F::kTickTimeUs.tag:
        return set(frame.tickTimeUs, reader.get_uint64());
      case F::kPacketTimeUs.tag:
        return set(frame.packetTimeUs, reader.get_uint64());
      case F::kReconstructionHash.tag:
        return set(frame.reconstructionHash, reader.get_fixed64());
      case F::kStateHash.tag:
        return set(frame.stateHash, reader.get_fixed64());
      case F::kColliders.tag:
        if (frame.colliders.size() == kMaxSceneColliders) return false;
        frame.colliders.push_back(reader.get_view());
        return true;
      case F::kReport.tag:
        frame.report = reader.get_view();
        return true;
      case F::kFrameDivisor.tag:
        if (!set(frame.divisor, reader.get_uint32()) || frame.divisor > kMaxFrameDivisor) return false;
        frame.divisor = std::max(frame.divisor, 1u);  // 0 means all frames
        return true;
      default:
        return skip(reader);
    }
  });
}

std::optional<Pong> readPong(Bytes message) {
  using F = field::Pong;
  return readMessage<Pong>(message, [](Pong& pong, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kClientTimeUs.tag:
        return set(pong.clientTimeUs, reader.get_uint64());
      case F::kServerTimeUs.tag:
        return set(pong.serverTimeUs, reader.get_uint64());
      default:
        return skip(reader);
    }
  });
}

std::optional<cs_playback> readPlayback(Bytes message) {
  using F = field::Playback;
  std::optional<cs_playback> playback =
      readMessage<cs_playback>(message, [](cs_playback& out, std::uint32_t tag, Reader& reader) {
        switch (tag) {
          case F::kLength.tag:
            return setFinite(out.length, reader);
          case F::kPosition.tag:
            return setFinite(out.position, reader);
          case F::kSpeed.tag:
            return setFinite(out.speed, reader);
          case F::kLoop.tag:
            return set(out.loop, reader.get_bool() ? 1 : 0);
          case F::kPaused.tag:
            return set(out.paused, reader.get_bool() ? 1 : 0);
          default:
            return skip(reader);
        }
      });
  if (playback && !(playback->length >= 0)) playback.reset();
  return playback;
}

std::optional<std::uint32_t> readOperatingPoint(Bytes message) {
  using F = field::OperatingPoint;
  return readMessage<std::uint32_t>(message, [](std::uint32_t& quality, std::uint32_t tag, Reader& reader) {
    return tag == F::kQuality.tag ? set(quality, reader.get_uint32()) : skip(reader);
  });
}

std::optional<Notice> readNotice(Bytes message) {
  using F = field::Notice;
  return readMessage<Notice>(message, [](Notice& notice, std::uint32_t tag, Reader& reader) {
    if (tag == F::kParticipantId.tag) return set(notice.participantId, reader.get_uint64());
    return tag == F::kText.tag ? setText(notice.text, reader) : skip(reader);
  });
}

std::optional<Presence> readPresence(Bytes message) {
  using F = field::Presence;
  return readMessage<Presence>(message, [](Presence& presence, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kKind.tag:
        return set(presence.kind, reader.get_uint32());
      case F::kParticipant.tag:
        return readParticipant(reader.get_view(), presence.participant);
      case F::kReason.tag:
        return set(presence.reason, reader.get_uint32());
      case F::kByParticipantId.tag:
        return set(presence.by, reader.get_uint64());
      default:
        return skip(reader);
    }
  });
}

std::optional<ParameterChange> readParameterChanged(Bytes message) {
  using F = field::ParameterChanged;
  return readMessage<ParameterChange>(
      message, [](ParameterChange& change, std::uint32_t tag, Reader& reader) {
        if (tag == F::kParticipantId.tag) return set(change.participantId, reader.get_uint64());
        return tag == F::kChange.tag ? readParameterChange(reader.get_view(), change) : skip(reader);
      });
}

std::optional<std::string> readToken(Bytes message) {
  using F = field::AuthenticateResponse;
  return readMessage<std::string>(message, [](std::string& token, std::uint32_t tag, Reader& reader) {
    return tag == F::kToken.tag ? setText(token, reader) : skip(reader);
  });
}

std::optional<PairingCode> readPairingCode(Bytes message) {
  using F = field::CreatePairingCodeResponse;
  return readMessage<PairingCode>(message, [](PairingCode& made, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kCode.tag:
        return setText(made.code, reader);
      case F::kRole.tag:
        return set(made.role, reader.get_uint32());
      case F::kValidS.tag:
        return set(made.validSeconds, reader.get_uint32());
      default:
        return skip(reader);
    }
  });
}

namespace {

constexpr std::size_t kMaxDnsNameBytes = 253, kMaxDnsLabelBytes = 63;

bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

bool isHexDigit(char c) {
  return isDigit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

bool isDnsLabel(std::string_view label) {
  const auto isAllowed = [](char c) {
    return isDigit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-';
  };
  return !label.empty() && label.size() <= kMaxDnsLabelBytes && label.front() != '-' && label.back() != '-' &&
         std::all_of(label.begin(), label.end(), isAllowed);
}

// Whether browsers and the C library read a name as an IPv4 address if this is its last label: a decimal,
// octal or hexadecimal number.
bool isPartOfAddress(std::string_view label) {
  if (label.starts_with("0x") || label.starts_with("0X"))
    return std::all_of(label.begin() + 2, label.end(), isHexDigit);
  return std::all_of(label.begin(), label.end(), isDigit);
}

// The text if it is a DNS name, without a dot at its end; else empty.
std::string dnsName(Bytes text) {
  const std::string_view name(text.data(), text.size());
  if (name.size() > kMaxDnsNameBytes) return {};
  std::string_view rest = name, label;
  do {
    label = rest.substr(0, rest.find('.'));
    if (!isDnsLabel(label)) return {};
    rest.remove_prefix(std::min(label.size() + 1, rest.size()));
  } while (!rest.empty());
  return isPartOfAddress(label) || name.ends_with('.') ? std::string() : std::string(name);
}

}  // namespace

std::optional<std::string> readMoving(Bytes message) {
  return readMessage<std::string>(message, [](std::string& server, std::uint32_t tag, Reader& reader) {
    if (tag != field::Moving::kServer.tag) return skip(reader);
    server = dnsName(reader.get_view());
    return true;
  });
}

std::optional<ServerError> readError(Bytes message) {
  using F = field::Error;
  return readMessage<ServerError>(message, [](ServerError& error, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kCode.tag:
        return set(error.code, reader.get_uint32());
      case F::kText.tag:
        return setText(error.text, reader);
      case F::kFatal.tag:
        return set(error.fatal, reader.get_bool());
      case F::kServer.tag:
        error.server = dnsName(reader.get_view());
        return true;
      default:
        return skip(reader);
    }
  });
}

namespace {

bool readGrabEvent(Bytes message, cs_grab_event& out) {
  using F = field::GrabEvent;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kParticipantId.tag:
        return set(out.participant_id, reader.get_uint64());
      case F::kGrabId.tag:
        return set(out.grab_id, reader.get_uint32());
      case F::kKind.tag:
        return set(out.kind, reader.get_uint32());
      case F::kVertices.tag:
        return set(out.vertices, reader.get_uint32());
      case F::kDistance.tag:
        return setFinite(out.distance, reader);
      case F::kTicksSinceSeen.tag:
        return set(out.ticks_since_seen, reader.get_uint64());
      default:
        return skip(reader);
    }
  });
}

bool readContactEvent(Bytes message, ContactEvent& out) {
  using F = field::ContactEvent;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kKind.tag:
        return set(out.kind, reader.get_uint32());
      case F::kCollider.tag:
        return setText(out.collider, reader);
      case F::kParticipantId.tag:
        return set(out.participantId, reader.get_uint64());
      case F::kColliderId.tag:
        return set(out.colliderId, reader.get_uint32());
      case F::kCloth.tag:
        return setText(out.cloth, reader);
      case F::kImpulse.tag:
        return setFinite(out.impulse, reader);
      case F::kSeconds.tag:
        return setFinite(out.seconds, reader);
      default:
        return skip(reader);
    }
  });
}

}  // namespace

bool readTickEvents(Bytes message, TickEvents& events) {
  using F = field::TickEvents;
  events = {};
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kGrabs.tag)
      return events.grabs.size() < kMaxEvents &&
             readGrabEvent(reader.get_view(), events.grabs.emplace_back());
    if (tag == F::kContacts.tag)
      return events.contacts.size() < kMaxEvents &&
             readContactEvent(reader.get_view(), events.contacts.emplace_back());
    return skip(reader);
  });
}

bool readReport(Bytes message, SimulationReport& out) {
  using F = field::SimulationReport;
  out.cloths.clear();
  out.deviceSeconds = 0;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kDeviceSeconds.tag) return setFinite(out.deviceSeconds, reader);
    if (tag != F::kCloths.tag) return skip(reader);
    return out.cloths.size() < kMaxCloths && readClothReport(reader.get_view(), out.cloths.emplace_back());
  });
}

}  // namespace clothstream::client

// SPDX-License-Identifier: MIT
// Field by field through the messages of session.proto that a client gets.
#include "clients/core/server_message.h"

#include <cmath>

namespace clothstream::client {
namespace {

using Reader = protozero::pbf_reader;

template <typename Value>
bool set(Value& target, Value value) {
  target = value;
  return true;
}

bool setText(std::string& target, Reader& reader) {
  const Bytes view = reader.get_view();
  target.assign(view.data(), view.size());
  return true;
}

bool setFinite(float& target, Reader& reader) {
  target = reader.get_float();
  return std::isfinite(target);
}

bool setFinite(std::optional<float>& target, Reader& reader) {
  return setFinite(target.emplace(), reader);
}

bool setSpring(std::optional<Spring>& target, Reader& reader) {
  return readSpring(reader.get_view(), target.emplace());
}

// Vec3Value { Vec3 value = 1; }
bool setVec3Value(std::optional<Vec3>& target, Reader& reader) {
  Vec3& value = target.emplace();
  return readFields(reader.get_view(), [&](std::uint32_t field, Reader& wrapped) {
    return field == bytes(1) ? readVec3(wrapped.get_view(), value) : skip(wrapped);
  });
}

template <std::size_t N>
bool readFloats(Bytes message, std::array<float, N>& out) {
  out = {};
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    for (std::uint32_t i = 0; i < N; ++i) {
      if (field == fixed32(i + 1)) return setFinite(out[i], reader);
    }
    return skip(reader);
  });
}

bool readSphere(Bytes message, float& radius) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    return field == fixed32(1) ? setFinite(radius, reader) : skip(reader);
  });
}

bool readClothChange(Bytes message, ClothChange& change) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setText(change.name, reader);
      case bytes(2):
        return setSpring(change.structural, reader);
      case bytes(3):
        return setSpring(change.shear, reader);
      case bytes(4):
        return setSpring(change.bend, reader);
      case fixed32(5):
        return setFinite(change.damping, reader);
      default:
        return skip(reader);
    }
  });
}

bool readParameterChange(Bytes message, ParameterChange& change) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setVec3Value(change.gravity, reader);
      case bytes(2):
        return setVec3Value(change.wind, reader);
      case fixed32(3):
        return setFinite(change.airDensity, reader);
      case bytes(4):
        return change.cloths.size() < kMaxCloths &&
               readClothChange(reader.get_view(), change.cloths.emplace_back());
      default:
        return skip(reader);
    }
  });
}

// nullopt unless every field was read.
template <typename Message, typename Visit>
std::optional<Message> readMessage(Bytes bytes, Visit&& visit) {
  std::optional<Message> message(std::in_place);
  const auto visitField = [&](std::uint32_t field, Reader& reader) { return visit(*message, field, reader); };
  if (!readFields(bytes, visitField)) message.reset();
  return message;
}

Body bodyOf(std::uint32_t field) {
  constexpr std::array kKnown{Body::welcome,          Body::chunk, Body::frame,     Body::pong, Body::notice,
                              Body::parameterChanged, Body::error, Body::listScenes};
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
  frame.reconstructionHash = 0;
  frame.colliders.clear();
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return set(frame.packet, reader.get_view());
      case fixed64(4):
        return set(frame.reconstructionHash, reader.get_fixed64());
      case bytes(6):
        if (frame.colliders.size() == kMaxSceneColliders) return false;
        frame.colliders.push_back(reader.get_view());
        return true;
      default:
        return skip(reader);
    }
  });
}

bool readCollider(Bytes message, Collider& collider) {
  collider.name.clear();
  collider.position = {};
  collider.orientation = {0, 0, 0, 1};
  collider.radius = 0;
  collider.participantId = 0;
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setText(collider.name, reader);
      case bytes(2):
        return readVec3(reader.get_view(), collider.position);
      case bytes(3): {
        if (!readFloats(reader.get_view(), collider.orientation)) return false;
        // All zero means no rotation (scene.proto).
        if (collider.orientation == std::array<float, 4>{}) collider.orientation[3] = 1;
        return true;
      }
      case varint(4):
        return set(collider.participantId, reader.get_uint64());
      case bytes(5):
        return readSphere(reader.get_view(), collider.radius);
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

std::optional<std::string> readNotice(Bytes message) {
  return readMessage<std::string>(message, [](std::string& text, std::uint32_t field, Reader& reader) {
    return field == bytes(2) ? setText(text, reader) : skip(reader);
  });
}

std::optional<ParameterChange> readParameterChanged(Bytes message) {
  return readMessage<ParameterChange>(
      message, [](ParameterChange& change, std::uint32_t field, Reader& reader) {
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

bool readVec3(Bytes message, Vec3& out) {
  return readFloats(message, out);
}

bool readSpring(Bytes message, Spring& out) {
  return readFloats(message, out);
}

}  // namespace clothstream::client

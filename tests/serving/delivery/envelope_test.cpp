// SPDX-License-Identifier: MIT
// Messages with a frame, compared with protobuf's own serialisation.
#include "server/delivery/envelope.h"

#include <cstddef>
#include <span>
#include <string>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::delivery {
namespace {

TEST(Envelope, SerialisesAFrameAsProtobufDoes) {
  // Sizes on both sides of each varint length.
  for (const std::size_t size : {0, 1, 60, 127, 128, 200, 16383, 16384, 300000})
    for (const bool full : {false, true}) {
      v1::Frame fields;
      fields.set_packet_time_us(77);
      if (full) {
        fields.set_tick_time_us(5);
        fields.set_reconstruction_hash(0x1234567890abcdef);
        fields.set_state_hash(9);
        fields.add_colliders()->set_name("ball");
        fields.mutable_report()->set_device_seconds(0.25);
      }
      std::string packet(size, '\0');
      for (std::size_t i = 0; i < size; ++i) packet[i] = static_cast<char>(i);
      v1::ServerMessage message;
      *message.mutable_frame() = fields;
      message.mutable_frame()->set_packet(packet);
      const SharedBytes bytes = serialiseFrame(fields, std::as_bytes(std::span(packet)));
      EXPECT_EQ(*bytes, *serialise(message)) << size;
    }
}

}  // namespace
}  // namespace clothstream::delivery

// SPDX-License-Identifier: MIT
// Fixture: peers that send requests about the scenes of a server.
#pragma once

#include <string>

#include "clothstream/v1/session.pb.h"
#include "tests/serving/server_test.h"
#include "tests/serving/test_peer.h"

// Starts the server, and ends the test if there is no device.
#define START(...)    \
  start(__VA_ARGS__); \
  if (IsSkipped()) return

namespace clothstream::hosting {

using ScenesTest = tests::ServerTest;

// Sends a request and returns its answer.
inline v1::ServerMessage ask(tests::TestPeer& peer, v1::ClientMessage message) {
  message.set_request_id(77);
  peer.send(message);
  return peer.readUntil([](const v1::ServerMessage& answer) { return answer.request_id() == 77; });
}

// Creates a copy of the scene `named`.
inline v1::ServerMessage createNamed(tests::TestPeer& peer, const std::string& named,
                                     const std::string& name) {
  v1::ClientMessage message;
  message.mutable_create_scene()->set_named(named);
  message.mutable_create_scene()->set_name(name);
  return ask(peer, message);
}

inline v1::ServerMessage deleteScene(tests::TestPeer& peer, const std::string& name) {
  v1::ClientMessage message;
  message.mutable_delete_scene()->set_name(name);
  return ask(peer, message);
}

}  // namespace clothstream::hosting

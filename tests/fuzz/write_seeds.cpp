// SPDX-License-Identifier: MIT
// Writes inputs that every target accepts, from which fuzzing starts. Run it from the project's root:
//    build/fuzz/bin/write_fuzz_seeds DIRECTORY
#include <array>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/saved_state.pb.h"
#include "inputs.pb.h"
#include "proto/datagram/input_bundle.h"
#include "proto/datagram/piece_request.h"
#include "proto/datagram/receipt.h"
#include "proto/ice/connectivity_check.h"
#include "proto/sctp/chunks.h"
#include "server/messages/embedded_scenes.h"
#include "tests/codec/golden.h"
#include "tests/core/scripted_server.h"
#include "tests/fuzz/target.h"
#include "tests/meshes/draco_sheet.h"
#include "tests/meshes/skinned_glb.h"
#include "tests/messages/scenes.h"

namespace clothstream::fuzz {
namespace {

constexpr std::size_t kMaxSeedBytes = 24'000;

class Folder {
 public:
  Folder(const std::filesystem::path& directory, const char* target) : path_(directory / target) {
    std::filesystem::create_directories(path_);
  }
  void add(const std::string& bytes) {
    if (bytes.size() > kMaxSeedBytes) return;
    std::ofstream out(path_ / fmt::format("seed_{:02}", count_++), std::ios::binary);
    if (!out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush())
      throw std::runtime_error("cannot write to " + path_.string());
  }
  void add(const google::protobuf::Message& message) { add(toText(message)); }

 private:
  std::filesystem::path path_;
  int count_ = 0;
};

void writePieces(const std::filesystem::path& directory) {
  Folder folder(directory, "pieces");
  for (const std::uint32_t lost : {0u, 1u, 4u}) {
    PiecesInput input;
    std::uint32_t packet = 0;
    for (std::uint32_t frame = 0; frame < 6; ++frame)
      for (std::uint32_t index = 0; index < 4; ++index) {
        if (packet++ % 5 < lost) continue;
        PiecesInput::Step& step = *input.add_steps();
        step.set_microseconds(index == 0 ? 14'000 : 0);
        PiecesInput::Piece& piece = *step.mutable_piece();
        piece.set_packet(packet);
        piece.set_frame(frame);
        piece.set_index(index);
        piece.set_bytes(2'400);
      }
    // The last piece states another number of data pieces.
    Patch& patch = *input.mutable_steps(input.steps_size() - 1)->mutable_piece()->add_patches();
    patch.set_offset(14);
    patch.set_bytes("\2");
    folder.add(input);
  }
}

void writeDatagrams(const std::filesystem::path& directory) {
  Folder folder(directory, "datagram");
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  DatagramInput input;
  const auto add = [&](std::size_t bytes) {
    DatagramInput::Step& step = *input.add_steps();
    step.set_datagram(std::string(reinterpret_cast<const char*>(out.data()), bytes));
    step.set_microseconds(14'000);
    step.set_frame_bytes(2'400);
  };
  datagram::InputSender sender;
  for (std::uint32_t i = 0; i < 4; ++i) {
    add(sender.write(std::vector<std::byte>(3, std::byte{7}), 0, out));
    add(datagram::writeReceipt({.newest = i, .arrivalUs = 14'000 * i, .before = i}, out));
    add(datagram::writeRequest({.frame = i, .present = i}, out));
  }
  folder.add(input);
}

v1::ServerMessage parsed(const std::string& bytes) {
  v1::ServerMessage message;
  if (!message.ParseFromString(bytes)) throw std::runtime_error("the server's message cannot be parsed");
  return message;
}

CoreInput coreInput(const client::ScriptedStream& stream, int frames) {
  client::ScriptedServer server(stream);
  CoreInput input;
  const auto message = [&] {
    CoreInput::Step& step = *input.add_steps();
    step.set_milliseconds(14);
    return step.mutable_message();
  };
  *message() = parsed(server.welcome());
  *input.add_steps()->mutable_description() = server.description();
  input.add_steps()->mutable_call()->set_function(5);  // play-out
  for (int i = 1; i <= frames; ++i) {
    *message() = parsed(server.frame(static_cast<std::uint64_t>(i)));
    input.add_steps()->mutable_call()->set_function(6);
  }
  *message() = parsed(client::ScriptedServer::pong(1, 2));
  message()->mutable_notice()->set_text("notice");
  v1::ParameterChange& change = *message()->mutable_parameter_changed()->mutable_change();
  change.mutable_gravity()->mutable_value()->set_y(-1);
  v1::ClothChange& cloth = *change.add_cloths();
  cloth.set_name("curtain");
  cloth.mutable_bend()->set_stiffness(1);
  message()->mutable_list_scenes()->add_scenes()->set_name("curtain");
  message()->mutable_presence()->mutable_participant()->set_id(7);
  message()->mutable_playback()->set_length(3);
  message()->mutable_operating_point()->set_quality(1);
  v1::TickEvents& events = *message()->mutable_tick_events();
  events.add_grabs()->set_grab_id(1);
  events.add_contacts()->set_cloth("curtain");
  return input;
}

void writeCore(const std::filesystem::path& directory) {
  Folder folder(directory, "core");
  folder.add(coreInput({.cloths = {{"curtain", 3, 3}}}, 2));
  folder.add(
      coreInput({.normals = codec::NormalMode::octahedral, .cloths = {{"a", 4, 3}, {"curtain", 2, 2}}}, 2));
  folder.add(coreInput({.cloths = {{"curtain", 2, 2}}, .qualities = 2}, 4));
  CoreInput calls;
  *calls.add_steps()->mutable_message() = parsed(client::ScriptedServer().welcome());
  *calls.add_steps()->mutable_description() =
      client::ScriptedServer({.cloths = {{"curtain", 2, 2}}}).description();
  for (std::uint32_t function = 0; function < 40; ++function) {
    CoreInput::Call& call = *calls.add_steps()->mutable_call();
    call.set_function(function);
    call.set_index(1);
    call.set_text("curtain");
    for (const float number : {0.1f, 0.2f, 0.3f, 0.05f}) call.add_numbers(number);
  }
  folder.add(calls);
}

void writeDecoder(const std::filesystem::path& directory) {
  Folder folder(directory, "decoder");
  const std::vector<codec::GoldenStream> streams = codec::readGoldenStreams();
  for (std::uint32_t i = 0; i < streams.size(); ++i) {
    DecoderInput input;
    input.set_stream(i);
    input.set_coarse(i % 4 == 3);
    for (std::uint32_t packet = 0; packet < std::min<std::size_t>(streams[i].packets.size(), 8); ++packet)
      input.add_packets()->set_golden(packet);
    input.mutable_packets(input.packets_size() - 1)->add_patches()->set_bytes(std::string(2, '\xff'));
    folder.add(input);
  }
  DecoderInput layout;
  DecoderInput::Layout& mesh = *layout.mutable_layout();
  mesh.set_epoch(1);
  mesh.set_codec(codec::kCodecHierarchical);
  mesh.set_max_error(0.001f);
  mesh.set_qualities(1);
  DecoderInput::Cloth& cloth = *mesh.add_cloths();
  cloth.set_vertex_count(4);
  for (const std::uint32_t vertex : {0u, 1u, 2u, 2u, 1u, 3u}) cloth.add_triangles(vertex);
  for (int i = 0; i < 12; ++i) cloth.add_rest_positions(0.1f * static_cast<float>(i % 5));
  layout.add_packets();
  folder.add(layout);
}

v1::Scene sceneOf(std::string_view json) {
  v1::Scene scene;
  if (!google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &scene).ok())
    throw std::runtime_error("a scene of the server cannot be parsed");
  return scene;
}

v1::Scene smallMesh() {
  v1::Scene scene;
  scene.set_name("mesh");
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  for (const float number : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f})
    cloth.mutable_mesh()->add_positions(number);
  for (const std::uint32_t vertex : {0u, 1u, 2u, 0u, 2u, 3u}) cloth.mutable_mesh()->add_triangles(vertex);
  return scene;
}

// A sheet that follows the two joints of a tetrahedron.
v1::Scene smallClothes() {
  v1::Scene scene;
  scene.set_name("clothes");
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_grid()->set_rows(2);
  cloth.mutable_grid()->set_columns(2);
  cloth.mutable_grid()->set_width(1);
  cloth.mutable_grid()->set_height(1);
  cloth.mutable_skin()->set_collider("ball");
  cloth.mutable_skin()->mutable_limits()->set_max_distance(0.5f);
  v1::SkinRegion& region = *cloth.mutable_skin()->add_regions();
  region.mutable_region()->set_radius(0.75f);
  region.mutable_limits()->set_backstop_radius(1);
  *scene.add_colliders() = messages::jointedTetrahedron("ball", 2);
  return scene;
}

void writeScenes(const std::filesystem::path& directory) {
  Folder folder(directory, "scene"), json(directory, "scene_json");
  for (const messages::EmbeddedScene& embedded : messages::embeddedScenes()) {
    v1::Scene scene = sceneOf(embedded.json);
    for (v1::Cloth& cloth : *scene.mutable_cloths()) {
      if (!cloth.has_grid()) continue;
      cloth.mutable_grid()->set_rows(std::min(cloth.grid().rows(), 8u));
      cloth.mutable_grid()->set_columns(std::min(cloth.grid().columns(), 8u));
      cloth.clear_pins();
    }
    SceneInput input;
    *input.mutable_scene() = scene;
    folder.add(input);
    std::string text;
    if (!google::protobuf::util::MessageToJsonString(scene, &text).ok())
      throw std::runtime_error("a scene cannot be written");
    json.add(text);
  }
  SceneInput mesh;
  *mesh.mutable_scene() = smallMesh();
  folder.add(mesh);
  SceneInput clothes;
  *clothes.mutable_scene() = smallClothes();
  folder.add(clothes);
  SceneInput wire;
  wire.set_wire(smallMesh().SerializeAsString());
  folder.add(wire);
}

v1::ClientMessage hello(const char* scene) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(1);
  message.mutable_hello()->add_codecs(codec::kCodecHierarchical);
  message.mutable_hello()->set_scene(scene);
  return message;
}

void writeSession(const std::filesystem::path& directory) {
  Folder folder(directory, "session");
  SessionInput joins;
  const auto message = [&joins](std::uint32_t peer) {
    joins.add_steps()->set_peer(peer);
    return joins.mutable_steps(joins.steps_size() - 1)->mutable_message();
  };
  for (std::uint32_t peer = 0; peer < 2; ++peer) *message(peer) = hello("small");
  v1::ColliderPoses& poses = *message(0)->mutable_collider_poses();
  v1::ParticipantCollider& collider = *poses.add_colliders();
  collider.set_id(1);
  collider.mutable_sphere()->set_radius(0.1f);
  poses.add_grabs()->set_id(1);
  poses.add_attachments()->set_name("rail");
  joins.add_steps()->set_tick(true);
  v1::ParameterChange& change = *message(1)->mutable_parameter_change();
  change.mutable_wind()->mutable_value()->set_x(2);
  v1::ClothChange& cloth = *change.add_cloths();
  cloth.set_name("sheet");
  cloth.set_material("cotton");
  message(1)->mutable_control_scene()->set_paused(true);
  message(1)->mutable_set_role()->set_participant_id(1);
  message(0)->mutable_key_frame_request()->set_early(true);
  joins.add_steps()->set_tick(true);
  joins.add_steps()->set_vanish(true);
  message(1)->mutable_remove_participant()->set_participant_id(1);
  joins.add_steps()->set_leave(true);
  folder.add(joins);

  SessionInput creates;
  joins.Swap(&creates);
  joins.Clear();
  message(0)->mutable_list_scenes();
  message(0)->mutable_get_scene()->set_name("small");
  message(0)->mutable_ping()->set_client_time_us(5);
  message(0)->mutable_create_scene()->set_named("small");
  *message(0)->mutable_create_scene()->mutable_scene() = smallMesh();
  *joins.add_steps()->mutable_upload() = smallMesh();
  message(0)->mutable_delete_scene()->set_name("mesh");
  message(0)->mutable_start_recording()->set_scene("small");
  message(0)->mutable_stop_recording()->set_scene("small");
  *message(0) = hello("played");
  joins.add_steps()->set_stop_reading(true);
  folder.add(joins);
}

void writeRecording(const std::filesystem::path& directory) {
  Folder folder(directory, "recording");
  const codec::GoldenStream stream = codec::readGoldenStreams().front();
  RecordingInput input;
  v1::StreamDescription description;
  description.set_epoch(stream.layout.epoch);
  description.set_codec(stream.layout.codec);
  description.set_scene("sample");
  description.set_simulation_rate(72);
  description.set_stream_rate(72);
  description.set_max_error(stream.layout.maxError);
  for (const codec::ClothLayout& layout : stream.layout.cloths) {
    v1::ClothDescription& cloth = *description.add_cloths();
    cloth.set_name("sheet");
    cloth.set_vertex_count(layout.vertexCount);
    cloth.set_rows(layout.rows);
    cloth.set_columns(layout.columns);
  }
  RecordingInput::Entry& first = *input.add_entries();
  first.set_topic(0);
  first.set_raw(description.SerializeAsString());
  RecordingInput::Entry& scene = *input.add_entries();
  scene.set_topic(7);
  *scene.mutable_scene()->mutable_scene() = smallMesh();
  for (std::uint32_t i = 0; i < stream.packets.size(); ++i) {
    RecordingInput::Entry& frame = *input.add_entries();
    frame.set_topic(1);
    frame.set_milliseconds(14);
    frame.set_golden(i);
    RecordingInput::Entry& tick = *input.add_entries();
    tick.set_topic(8);
    tick.mutable_tick()->set_tick(i + 1);
    tick.mutable_tick()->add_colliders()->mutable_sphere()->set_radius(1);
    tick.mutable_tick()->add_cloths()->mutable_cloth()->set_name("sheet");
  }
  RecordingInput::Entry& change = *input.add_entries();
  change.mutable_message()
      ->mutable_parameter_changed()
      ->mutable_change()
      ->mutable_wind()
      ->mutable_value()
      ->set_x(1);
  RecordingInput::Entry& checkpoint = *input.add_entries();
  checkpoint.set_topic(9);
  checkpoint.mutable_checkpoint()->set_state("1234");
  input.add_seeks(0.02f);
  folder.add(input);
  input.set_cut(100);
  folder.add(input);
  input.set_cut(0);
  Patch& patch = *input.add_patches();
  patch.set_offset(300);
  patch.set_bytes("xxxx");
  folder.add(input);
}

void writeSavedState(const std::filesystem::path& directory) {
  Folder folder(directory, "saved_state");
  SavedStateInput input;
  v1::SavedScene& scene = *input.mutable_scene();
  *scene.mutable_definition() = smallMesh();
  scene.set_max_participants(4);
  scene.set_tenant("a");
  v1::SavedSession& session = *input.mutable_session();
  v1::SavedParticipant& participant = *session.add_participants();
  participant.set_id(1);
  participant.set_display_name("Ada");
  participant.set_role(v1::ROLE_OWNER);
  participant.set_token_hash(std::string(32, 'h'));
  session.add_bans()->set_subject("eve");
  session.add_refused_token_hashes(std::string(32, 'r'));
  *session.mutable_parameters() = smallMesh();
  folder.add(input);
  v1::SavedCheckpoint& checkpoint = *input.mutable_checkpoint();
  checkpoint.mutable_state()->set_tick(7);
  checkpoint.mutable_state()->set_state(std::string(4 * 24, '\0'));
  *checkpoint.mutable_parameters() = smallMesh();
  checkpoint.add_cloths();
  folder.add(input);
  v1::HeldNodes& held = *checkpoint.mutable_state()->mutable_held();
  held.add_nodes(1);
  held.add_grabs(0);
  held.set_places(std::string(12, '\0'));
  held.add_taken(1);
  held.add_slipped(0);
  v1::SavedGrab& grab = *checkpoint.add_grabs();
  grab.set_number(1);
  grab.set_participant_id(1);
  grab.mutable_pose()->mutable_orientation()->set_w(1);
  grab.set_radius(0.1f);
  folder.add(input);
  input.set_raw_checkpoint(checkpoint.SerializeAsString());
  folder.add(input);
  input.set_raw_scene("x");
  folder.add(input);
}

void writeHulls(const std::filesystem::path& directory) {
  Folder folder(directory, "hull");
  HullInput tetrahedron;
  const auto corner = [&](float x, float y, float z) {
    v1::Vec3& vertex = *tetrahedron.mutable_hull()->add_vertices();
    vertex.set_x(x);
    vertex.set_y(y);
    vertex.set_z(z);
  };
  corner(0, 0, 0);
  corner(1, 0, 0);
  corner(0, 1, 0);
  corner(0, 0, 1);
  for (const auto& face : {std::array{0u, 2u, 1u}, {0u, 1u, 3u}, {0u, 3u, 2u}, {1u, 2u, 3u}})
    tetrahedron.mutable_hull()->add_faces()->mutable_vertices()->Assign(face.begin(), face.end());
  folder.add(tetrahedron);
}

void writeHttp(const std::filesystem::path& directory) {
  Folder folder(directory, "http");
  for (const char* target :
       {"/", "/healthz", "/obj.dict", "/%2e%2e/inputs.proto", "/stream", "/obj.dict?x"}) {
    HttpInput input;
    HttpInput::Request& request = *input.add_steps()->mutable_request();
    request.set_method("GET");
    request.set_target(target);
    HttpInput::Field& field = *request.add_fields();
    field.set_name("Origin");
    field.set_value("http://localhost");
    folder.add(input);
  }
  HttpInput stream;
  stream.add_steps()->set_upgrade(true);
  HttpInput::WebSocketFrame& frame = *stream.add_steps()->mutable_frame();
  frame.set_opcode(2);
  frame.set_final(true);
  *frame.mutable_message() = hello("played");
  HttpInput::WebSocketFrame& ping = *stream.add_steps()->mutable_frame();
  ping.set_opcode(9);
  ping.set_final(true);
  HttpInput::WebSocketFrame& end = *stream.add_steps()->mutable_frame();
  end.set_opcode(8);
  end.set_final(true);
  end.set_payload(std::string("\x03\xe8", 2));
  folder.add(stream);
  HttpInput raw;
  raw.add_steps()->set_raw("GET / HTTP/1.0\r\nHost: a\r\n\r\n");
  folder.add(raw);
}

void writeMeshes(const std::filesystem::path& directory) {
  Folder obj(directory, "obj");
  obj.add(
      std::string("o sheet\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl red\ng a\n"
                  "f 1/1/1 2/2/1 3/1/1 4/2/1\n"));
  obj.add(std::string("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2\nf 1//1 3 4\n# end\n"));
  Folder gltf(directory, "gltf");
  const std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[1,0,0]}],)"
      R"("meshes":[{"name":"m","primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
      R"("buffers":[{"byteLength":42)";
  const std::string views =
      R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","max":[1,1,0],"min":[0,0,0]},)"
      R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]})";
  gltf.add(
      json +
      R"(,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],)" +
      views);
  const auto number = [](std::size_t value) {
    std::string bytes;
    for (unsigned shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift & 0xff);
    return bytes;
  };
  std::string text = json + "}]," + views;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string data(44, '\0');
  for (const auto& [at, value] :
       {std::pair{14, '\x80'}, {15, '\x3f'}, {30, '\x80'}, {31, '\x3f'}, {38, '\1'}, {40, '\2'}})
    data[static_cast<std::size_t>(at)] = value;
  const std::string body =
      number(text.size()) + "JSON" + text + number(data.size()) + std::string("BIN\0", 4) + data;
  gltf.add("glTF" + number(2) + number(12 + body.size()) + body);
  Folder draco(directory, "draco");
  constexpr int kSide = 4;
  for (const meshes::DracoCoding& coding : meshes::kDracoCodings) {
    const std::string sheet = meshes::compressedSheet(coding, kSide);
    draco.add(sheet);
    gltf.add(meshes::glbOf(sheet, (kSide + 1) * (kSide + 1), 6 * kSide * kSide));
  }
  draco.add(meshes::compressedSheet(meshes::kDracoCodings[0], kSide, true));
  // Two joints that an animation moves; and without the animation.
  meshes::SkinnedGlb skinned;
  gltf.add(skinned.bytes());
  skinned.root.erase("animations");
  gltf.add(skinned.bytes());
}

void writeFiles(const std::filesystem::path& directory) {
  Folder folder(directory, "files");
  std::string motion(1, '\0');
  for (const char number : {'\2', '\2', '\1', '\0'}) motion += std::string(1, number) + std::string(3, '\0');
  folder.add(motion + std::string(4 * 6 * 4, '\0'));
  v1::StreamDescription description;
  description.set_epoch(1);
  description.set_codec(codec::kCodecHierarchical);
  description.set_stream_rate(72);
  description.set_simulation_rate(72);
  description.set_max_error(0.001f);
  v1::ClothDescription& cloth = *description.add_cloths();
  cloth.set_vertex_count(4);
  cloth.set_rows(2);
  cloth.set_columns(2);
  const std::string bytes = description.SerializeAsString();
  v1::Frame frame;
  frame.set_packet("packet");
  const std::string second = frame.SerializeAsString();
  folder.add("\1clothstream\n" + std::string("\1\0\0\0\0\0\0\0", 8) + static_cast<char>(bytes.size()) +
             bytes + static_cast<char>(second.size()) + second);
}

void writeTokens(const std::filesystem::path& directory) {
  Folder folder(directory, "token");
  TokenInput token;
  token.set_header(R"({"alg":"HS256","typ":"JWT","kid":"key"})");
  for (const char* more : {"", R"(,"role":"owner","scene":"curtain","name":"Ada","sub":"ada","tenant":"a")",
                           R"(,"nbf":1767225601)", R"(,"scene":"")"}) {
    token.set_claims(fmt::format(R"({{"aud":"clothstream","exp":1798761600{}}})", more));
    folder.add(token);
  }
  token.set_claims(R"({"aud":["a","clothstream"],"exp":1.5})");
  folder.add(token);
  token.set_wrongly_signed(true);
  folder.add(token);
  token.set_header(R"({"alg":"none","kid":"key"})");
  folder.add(token);
  TokenInput raw;
  raw.set_raw("e30.e30.");
  folder.add(raw);
  TokenInput elliptic;
  elliptic.set_header(R"({"alg":"ES256","typ":"JWT","kid":"key"})");
  elliptic.set_claims(R"({"aud":"clothstream","exp":1798761600,"role":"owner","sub":"ada"})");
  elliptic.set_es256(true);
  folder.add(elliptic);
  elliptic.set_wrongly_signed(true);
  elliptic.set_signature(std::string(64, '\1'));
  folder.add(elliptic);
  TokenInput file;
  file.set_key_file(std::string(40, 's') + "\n");
  file.set_secret(true);
  folder.add(file);
  file.set_secret(false);
  // A public key of the curve P-256.
  file.set_key_file(
      "-----BEGIN PUBLIC KEY-----\n"
      "MFkwEwYHKoZIzj0CAQYIKoZIzj0DAQcDQgAEEVs/o5+uQbTjL3chynL4wXgUg2R9\n"
      "q9UU8I5mEovUf86QZ7kOBIjJwqnzD1omageEHWwHdBO6B+dFabmdT9POxg==\n"
      "-----END PUBLIC KEY-----\n");
  folder.add(file);
}

// The first byte of an input selects its form (targets/stun_target.h).
void writeStun(const std::filesystem::path& directory) {
  Folder folder(directory, "stun");
  const ice::Credentials server{.ufrag = "serv", .password = "passwordofserverpasswo"};
  const ice::Credentials client{.ufrag = "clie", .password = "passwordofclientpasswo"};
  const auto add = [&](char form, std::span<const std::byte> bytes) {
    folder.add(form + std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  };
  const ice::Pairing ofClient(client, server, ice::Role::controlling);
  const ice::Pairing ofServer(server, client, ice::Role::controlled);
  for (const std::vector<std::byte>& check :
       {ofClient.check({}, true), ofClient.check({}, false), ofServer.check({}, false)}) {
    add('\0', check);
    // The attributes before MESSAGE-INTEGRITY: as requests with either password, and as other messages.
    const auto attributes = std::span(check).subspan(20, check.size() - 20 - 32);
    for (const char form : {'\1', '\3', '\5', '\11', '\13', '\17'}) add(form, attributes);
  }
  for (const ice::Address& address : {ice::Address::ofIpv4({192, 0, 2, 1}, 1000), ice::Address{.port = 1}})
    add('\0', ice::writeStun({.kind = ice::StunKind::success, .mapped = address}, server.password));
  add('\0', ice::writeStun({.kind = ice::StunKind::error, .error = 420, .unknown = {1, 2}}, server.password));
}

// Datagrams of a right handshake and others, as numbers of two bytes (targets/dtls_target.h).
void writeDtls(const std::filesystem::path& directory) {
  Folder folder(directory, "dtls");
  const std::string recorded("\x80\0\0\0\0\x80\1\0\0\0\x80\2\0\0\0", 15);
  for (const char role : {'\0', '\1', '\2'}) {
    folder.add(role + recorded);
    folder.add(role + recorded + recorded);
    for (const char place : {'\0', '\3', '\15', '\16', '\22', '\40', '\100'})
      folder.add(role + std::string({'\x80', '\0', '\0', place, '\x10'}) + recorded);
    const std::string changeCipherSpec("\x14\xfe\xfd\0\0\0\0\0\0\0\1\0\1\1", 14);
    const std::string alert("\x15\xfe\xfd\0\0\0\0\0\0\0\2\0\2\2\50", 15);
    for (const std::string& record : {changeCipherSpec, alert})
      folder.add(role + std::string({'\0', static_cast<char>(record.size())}) + record + recorded);
  }
}

// Chunks of the peer, which has tag 2. `value` in hexadecimal digits, where spaces mean nothing.
void addChunk(SctpInput& input, sctp::ChunkType type, std::uint32_t flags, std::string_view value) {
  SctpInput::Packet& packet = *input.add_steps()->mutable_packet();
  packet.set_tag(type == sctp::ChunkType::init ? 0 : 1);
  SctpInput::Chunk& chunk = *packet.add_chunks();
  chunk.set_type(static_cast<std::uint32_t>(type));
  chunk.set_flags(flags);
  std::string digits(value);
  std::erase(digits, ' ');
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    *chunk.mutable_value() += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
}

void writeSctp(const std::filesystem::path& directory) {
  using sctp::ChunkType;
  Folder folder(directory, "sctp");
  constexpr std::string_view kInit =
      "00000002 00020000 00080008 00000001 c0000004 80080006 82c00000 80010008 00000001";
  SctpInput accepts;
  addChunk(accepts, ChunkType::init, 0, kInit);
  addChunk(accepts, ChunkType::cookieEcho, 0, "00000001 00000002");
  // DCEP OPEN of the channel "frames", and a message.
  constexpr std::string_view kOpen = "00000001 00000000 00000032 03810000 00000000 00060000 6672616d6573";
  addChunk(accepts, ChunkType::data, 3, kOpen);
  addChunk(accepts, ChunkType::data, 15, "00000002 00000000 00000035 010203");
  folder.add(accepts);

  SctpInput connects;
  connects.set_connects(true);
  addChunk(connects, ChunkType::initAck, 0, std::string(kInit) + "00070008 00000005");
  addChunk(connects, ChunkType::cookieAck, 0, "");
  addChunk(connects, ChunkType::sack, 0, "00000001 00020000 0000 0000");
  addChunk(connects, ChunkType::data, 3, "00000001 00000000 00000032 02");
  connects.add_steps()->set_send(100);
  folder.add(connects);

  SctpInput open;
  open.set_established(true);
  addChunk(open, ChunkType::data, 3, kOpen);
  for (int i = 0; i < 6; ++i) open.add_steps()->set_send(1000);
  addChunk(open, ChunkType::sack, 0, "00000001 00020000 0001 0000 00020003");
  open.add_steps()->set_milliseconds(40);
  addChunk(open, ChunkType::data, 7, "00000004 00000000 00000035 01");
  addChunk(open, ChunkType::forwardTsn, 0, "00000003");
  addChunk(open, ChunkType::heartbeat, 0, "0001 0008 01020304");
  addChunk(open, ChunkType::data, 6, "00000005 00000000 00000035 01");
  folder.add(open);

  SctpInput ends;
  ends.set_established(true);
  addChunk(ends, ChunkType::data, 3, "00000001 00020000 00000032 03000000 00000000 00010000 61");
  addChunk(ends, ChunkType::reconfig, 0, "0010000c 00000001 00000001");
  addChunk(ends, ChunkType::reconfig, 0, "000d0012 00000001 00000000 00000001 0002");
  addChunk(ends, static_cast<ChunkType>(0x7f), 0, "01");
  addChunk(ends, static_cast<ChunkType>(0xff), 0, "01");
  addChunk(ends, ChunkType::error, 0, "00060004");
  addChunk(ends, ChunkType::shutdown, 0, "00000001");
  addChunk(ends, ChunkType::shutdownComplete, 0, "");
  folder.add(ends);

  SctpInput raw;
  raw.add_steps()->set_raw(std::string("\x13\x88\x13\x88\0\0\0\1\0\0\0\0\6\0\0\4", 16));
  folder.add(raw);
}

void writeAll(const std::filesystem::path& directory) {
  writeCore(directory);
  writeDatagrams(directory);
  writeDecoder(directory);
  writeScenes(directory);
  writeSession(directory);
  writeRecording(directory);
  writeSavedState(directory);
  writeHulls(directory);
  writeHttp(directory);
  writePieces(directory);
  writeMeshes(directory);
  writeFiles(directory);
  writeTokens(directory);
  writeStun(directory);
  writeDtls(directory);
  writeSctp(directory);
}

}  // namespace
}  // namespace clothstream::fuzz

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fputs("usage: write_fuzz_seeds DIRECTORY\n", stderr);
    return 2;
  }
  clothstream::fuzz::writeAll(argv[1]);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}

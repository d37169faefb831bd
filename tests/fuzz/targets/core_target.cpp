// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/core_target.h"

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/core/core.h"
#include "clothstream/v1/session.pb.h"
#include "inputs.pb.h"
#include "proto/text/utf8.h"

namespace clothstream::fuzz {
namespace {

constexpr int kMaxSteps = 256;
constexpr std::uint64_t kMs = 1000;  // us
// Memory and time are proportional to the vertices of a description, which few bytes may not name: the server
// sends 12 bytes for each.
constexpr std::size_t kMaxDescriptionBytes = 1 << 20;

// Numbers of a call, which end in zeros.
class Numbers {
 public:
  explicit Numbers(const CoreInput::Call& call) : call_(call) {}

  float next() { return at_ < call_.numbers_size() ? call_.numbers(at_++) : 0; }
  template <std::size_t count>
  std::array<float, count> array() {
    std::array<float, count> values{};
    for (float& value : values) value = next();
    return values;
  }
  template <std::size_t count>
  void write(float (&values)[count]) {
    for (float& value : values) value = next();
  }

 private:
  const CoreInput::Call& call_;
  int at_ = 0;
};

void expectText(const char* text) {
  require(text != nullptr && isUtf8(text), "strings are UTF-8 and never null");
}

bool allFinite(const float* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(values[i])) return false;
  return true;
}

using Core = std::unique_ptr<cs_client, decltype(&cs_destroy)>;

Core create(const char* scene, const char* name, std::uint32_t role) {
  const cs_client_options options{.role = role, .scene = scene, .client_name = name, .display_name = name};
  return {cs_create(&options), &cs_destroy};
}

class Program {
 public:
  explicit Program(const CoreInput& input) : input_(input) {}

  void run() {
    const cs_datagram_offer offer{
        .ufrag = "abcd", .password = "0123456789abcdefghijkl", .fingerprint = {}, .sctp = 1};
    cs_offer_datagrams(client(), &offer);
    int steps = 0;
    for (const CoreInput::Step& step : input_.steps()) {
      if (++steps > kMaxSteps) break;
      now_ += step.milliseconds() * kMs;
      act(step);
      cs_update(client(), now_);
      sendAll();
    }
    readGeometry();
    readLists();
    readNumbers();
    readAnswers();
  }

 private:
  cs_client* client() const { return client_.get(); }

  void act(const CoreInput::Step& step) {
    using Step = CoreInput::Step;
    switch (step.action_case()) {
      case Step::kMessage:
        if (step.message().has_welcome()) content_ = step.message().welcome().description_content_id();
        return receive(step.message().SerializeAsString());
      case Step::kRaw:
        return receive(step.raw());
      case Step::kDescription:
        return describe(step.description());
      case Step::kCall:
        return call(step.call());
      case Step::ACTION_NOT_SET:
        return;
    }
  }

  void receive(const std::string& bytes) {
    // Exactly sized, so that the sanitizer detects a read past the end.
    const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
    std::memcpy(exact.get(), bytes.data(), bytes.size());
    cs_receive(client(), exact.get(), bytes.size(), now_);
    expectText(cs_error_text(client()));
  }

  void describe(const v1::StreamDescription& description) {
    const std::string bytes = description.SerializeAsString();
    if (bytes.size() > kMaxDescriptionBytes) return;
    v1::ServerMessage message;
    v1::Chunk& chunk = *message.mutable_chunk();
    chunk.set_content_id(content_);
    chunk.set_kind(v1::CONTENT_KIND_STREAM_DESCRIPTION);
    chunk.set_count(1);
    chunk.set_total_bytes(bytes.size());
    chunk.set_data(bytes);
    receive(message.SerializeAsString());
  }

  void sendAll() {
    std::size_t bytes = 0;
    while (const std::uint8_t* message = cs_next_outgoing(client(), &bytes))
      require(v1::ClientMessage().ParseFromArray(message, static_cast<int>(bytes)),
              "the client sends messages that can be parsed");
  }

  void call(const CoreInput::Call& call);
  void readGeometry();
  void readColliders();
  void readLists();
  void readNumbers();
  void requestScene(std::uint32_t index, const char* text);
  void readAnswers();

  const CoreInput& input_;
  const Core client_ = create("curtain", "fuzz", 0);
  std::uint64_t now_ = 0;  // us
  std::uint64_t content_ = 0;
};

void Program::call(const CoreInput::Call& call) {
  Numbers numbers(call);
  const std::uint32_t index = call.index();
  // Programs pass UTF-8.
  const char* text = isUtf8(call.text()) ? call.text().c_str() : "";
  switch (call.function() % 48) {
    case 0:
      return cs_connecting(client(), now_);
    case 1:
      return cs_disconnected(client(), now_);
    case 2:
      static_cast<void>(cs_connect_at(client()));
      return cs_follow_redirects(client(), index % 2 == 1 ? 1 : 0);
    case 3:
      return cs_want(client(), index);
    case 4:
      return cs_list_scenes(client());
    case 5: {
      cs_play_out_options options;
      cs_default_play_out(&options);
      if (call.numbers_size() > 0) {
        options.frames = index;
        options.delay_ms = numbers.next();
        options.least_delay_ms = numbers.next();
        options.most_delay_ms = numbers.next();
        options.lead_ms = numbers.next();
      }
      cs_set_play_out(client(), index == 1 ? nullptr : &options);
      return;
    }
    case 6: {
      cs_played played;
      cs_play_out(client(), now_, now_ + index % 1'000'000, &played);
      const std::size_t count = 3 * std::size_t{cs_vertex_count(client())};
      require(allFinite(cs_played_positions(client()), count), "played positions are finite");
      require(allFinite(cs_played_normals(client()), count), "played normals are finite");
      cs_collider collider;
      for (std::uint32_t i = 0; cs_get_played_collider(client(), i, &collider) != 0; ++i)
        expectText(collider.name);
      return;
    }
    case 7: {
      cs_own_collider collider{};
      collider.version = index;
      require(cs_set_colliders(client(), &collider, 1, now_) == (index == CS_OWN_COLLIDER_VERSION ? 1 : 0),
              "the client refuses colliders of another version");
      return;
    }
    case 8: {
      std::vector<cs_own_collider> shapes(index % (2 * CS_MAX_COLLIDERS));
      for (cs_own_collider& shape : shapes) {
        shape.shape = index / 64;
        numbers.write(shape.position);
        numbers.write(shape.orientation);
        shape.radius = numbers.next();
        shape.length = numbers.next();
        numbers.write(shape.size);
        shape.top_radius = numbers.next();
      }
      cs_set_colliders(client(), shapes.data(), static_cast<std::uint32_t>(shapes.size()), now_);
      return;
    }
    case 9: {
      std::vector<float> joints(std::size_t{4} * CS_HAND_JOINTS);
      for (float& joint : joints) joint = numbers.next();
      cs_set_hand(client(), index % 4, joints.data(), index / 4 % (CS_HAND_JOINTS + 1), now_);
      cs_set_head(client(), index % 2 == 0 ? joints.data() : nullptr,
                  index % 3 == 0 ? joints.data() : nullptr, joints[0], now_);
      return;
    }
    case 10: {
      std::vector<cs_grab> grabs(index % (2 * CS_MAX_GRABS));
      std::vector<cs_cloth_point> places(grabs.size());
      for (std::size_t i = 0; i < grabs.size(); ++i) {
        cs_grab& grab = grabs[i];
        grab.id = index;
        numbers.write(grab.position);
        numbers.write(grab.orientation);
        grab.radius = numbers.next();
        grab.reach = numbers.next();
        grab.max_force = numbers.next();
        grab.slip_distance = numbers.next();
        grab.place = index % 2 == 1 ? &places[i] : nullptr;
        cs_set_local_contact(client(), static_cast<int>(index % 3));
        const auto point = numbers.array<3>(), direction = numbers.array<3>();
        if (cs_nearest_point(client(), point.data(), grab.reach, &places[i]) == 0)
          cs_cast_ray(client(), point.data(), direction.data(), grab.reach, &places[i]);
      }
      cs_set_grabs(client(), grabs.data(), static_cast<std::uint32_t>(grabs.size()), now_);
      return;
    }
    case 11: {
      const auto position = numbers.array<3>();
      const auto orientation = numbers.array<4>();
      return cs_move_attachment(client(), text, position.data(), index == 0 ? nullptr : orientation.data(),
                                index % 2, now_);
    }
    case 12:
      return cs_want_contacts(client(), static_cast<int>(index % 2), now_);
    case 13: {
      const auto gravity = numbers.array<3>(), wind = numbers.array<3>();
      const float density = numbers.next();
      return cs_set_environment(client(), gravity.data(), index == 0 ? nullptr : wind.data(), &density);
    }
    case 14: {
      const float strength = numbers.next();
      return cs_set_gust(client(), strength, numbers.next());
    }
    case 15: {
      cs_cloth_settings settings;
      cs_keep_cloth_settings(&settings);
      numbers.write(settings.bend);
      settings.damping = numbers.next();
      cs_set_cloth(client(), text, &settings);
      return;
    }
    case 16: {
      cs_cloth_settings settings;
      cs_keep_cloth_settings(&settings);
      numbers.write(settings.structural);
      settings.solver = index % 8;
      settings.iterations = index / 8;
      settings.tolerance = numbers.next();
      settings.compliance = numbers.next();
      settings.assembled = static_cast<int>(index % 3) - 1;
      cs_set_cloth(client(), text, &settings);
      return;
    }
    case 17:
      return cs_set_material(client(), text, cs_material(client(), index));
    case 18: {
      cs_collider_change change;
      cs_keep_collider(&change);
      if (index != 0) numbers.write(change.position);
      change.radius = numbers.next();
      cs_set_collider(client(), text, &change);
      return;
    }
    case 19:
      return cs_set_role(client(), index, index / 4);
    case 20:
      return cs_remove_participant(client(), index);
    case 21:
      return cs_request_key_frame(client(), now_);
    case 22:
      return cs_pause(client(), static_cast<int>(index % 2));
    case 23:
      return cs_seek(client(), numbers.next());
    case 24:
      return cs_set_speed(client(), numbers.next());
    case 25:
      return cs_set_loop(client(), static_cast<int>(index % 2));
    case 26:
      return readGeometry();
    case 27:
      return readLists();
    case 32:
      cs_set_token(client(), text);
      return require(cs_token(client()) == std::string_view(text), "the client uses the new token");
    case 33:
      return cs_set_pairing_code(client(), text);
    case 34:
      return cs_ban_participant(client(), index);
    case 35:
      return cs_create_pairing_code(client(), index);
    case 36: {
      cs_limits limits;
      cs_default_limits(&limits);
      if (index % 2 != 0) {
        limits.max_vertices = index;
        limits.max_triangles = 2 * limits.max_vertices;
        limits.max_cloths = index % 300;
        limits.max_participants = index % 100'000;
        limits.max_content_bytes = index;
      }
      cs_set_limits(client(), index == 2 ? nullptr : &limits);
      return;
    }
    case 37:
      return cs_set_clock(
          client(), index % 2 == 0 ? nullptr : +[] { return std::uint64_t{1}; });
    case 38: {
      const Core other = create(text, text, index);
      cs_connecting(other.get(), now_);
      require(cs_get_state(other.get()) == CS_STATE_JOINING, "a client that connects joins");
      return;
    }
    case 39:
      return readNumbers();
    case 40: {
      v1::Scene definition;
      definition.set_description(std::string(index % kMaxDescriptionBytes, 's'));
      const std::string scene = definition.SerializeAsString();
      cs_create_scene(client(), reinterpret_cast<const std::uint8_t*>(scene.data()), scene.size(), text,
                      index % 64);
      return;
    }
    case 41:
      return requestScene(index, text);
    case 42:
      return readAnswers();
    case 43: {
      const std::string own = cs_resume_token(client());
      require(cs_set_resume_token(client(), own.c_str()) == 1, "a client takes its own resume token");
      static_cast<void>(cs_set_resume_token(client(), text));
      return;
    }
    default:
      now_ += index % 60'000 * kMs;
  }
}

void Program::readGeometry() {
  const std::uint32_t vertices = cs_vertex_count(client());
  require(allFinite(cs_positions(client()), 3 * std::size_t{vertices}), "positions are finite");
  require(allFinite(cs_normals(client()), 3 * std::size_t{vertices}), "normals are finite");
  std::uint32_t indices = 0;
  const std::uint32_t* triangles = cs_triangles(client(), &indices);
  for (std::uint32_t i = 0; i < indices; ++i)
    require(triangles[i] < vertices, "triangles name existing vertices");
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client(), i, &cloth) != 0; ++i) {
    expectText(cloth.name);
    require(std::uint64_t{cloth.first_vertex} + cloth.vertex_count <= vertices,
            "a cloth has existing vertices");
    require(std::uint64_t{cloth.first_index} + cloth.index_count <= indices,
            "a cloth has existing triangles");
    std::uint32_t uvs = 0, corners = 0;
    const float* coordinates = cs_uvs(client(), i, &uvs);
    require(allFinite(coordinates, 2 * std::size_t{uvs}), "texture coordinates are finite");
    const std::uint32_t* uvIndices = cs_uv_indices(client(), i, &corners);
    require(corners == 0 || corners == cloth.index_count, "every corner has texture coordinates");
    for (std::uint32_t k = 0; k < corners; ++k)
      require(uvIndices[k] < uvs, "corners name existing texture coordinates");
    cs_submesh submesh;
    for (std::uint32_t k = 0; cs_get_submesh(client(), i, k, &submesh) != 0; ++k) {
      expectText(submesh.name);
      require(std::uint64_t{submesh.first_index} + submesh.index_count <= indices,
              "a part has existing triangles");
    }
    cs_cloth_settings settings;
    cs_get_cloth_settings(client(), i, &settings);
    expectText(cs_cloth_material(client(), i));
    cs_cloth_report report;
    cs_get_cloth_report(client(), i, &report);
  }
  readColliders();
}

void Program::readColliders() {
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_collider(client(), i, &collider) != 0; ++i) {
    expectText(collider.name);
    std::uint32_t corners = 0, indices = 0;
    const std::uint32_t* triangles = nullptr;
    const float* hull = cs_get_hull(client(), i, &corners, &triangles, &indices);
    require(allFinite(hull, 3 * std::size_t{corners}), "corners of hulls are finite");
    for (std::uint32_t k = 0; k < indices; ++k)
      require(triangles[k] < corners, "hulls name existing corners");
  }
}

void Program::readLists() {
  for (const char* text : {cs_error_text(client()), cs_notice_text(client()), cs_server_name(client()),
                           cs_device_name(client()), cs_scene_name(client())})
    expectText(text);
  for (std::uint32_t i = 0; i < cs_material_count(client()); ++i) expectText(cs_material(client(), i));
  cs_participant participant;
  for (std::uint32_t i = 0; cs_get_participant(client(), i, &participant) != 0; ++i) {
    expectText(participant.name);
    expectText(participant.client_name);
  }
  cs_presence presence;
  if (cs_get_presence(client(), &presence, &participant) != 0) expectText(participant.name);
  cs_grab_event grab;
  for (std::uint32_t i = 0; cs_get_grab_event(client(), i, &grab) != 0; ++i) continue;
  cs_contact_event contact;
  for (std::uint32_t i = 0; cs_get_contact_event(client(), i, &contact) != 0; ++i) {
    expectText(contact.cloth);
    expectText(contact.collider);
  }
  cs_statistics statistics;
  cs_get_statistics(client(), now_, &statistics);
  cs_stage_statistics stages;
  cs_get_stage_statistics(client(), &stages);
  cs_playback playback;
  cs_get_playback(client(), now_, &playback);
  cs_environment environment;
  cs_get_environment(client(), &environment);
}

void Program::requestScene(std::uint32_t index, const char* text) {
  using Request = std::uint64_t (*)(cs_client*, const char*);
  constexpr std::array<Request, 6> kRequests{
      cs_delete_scene,
      cs_reset_scene,
      cs_stop_recording,
      cs_request_definition,
      cs_list_bans,
      [](cs_client* client, const char* scene) { return cs_copy_scene(client, scene, scene, 1); }};
  kRequests[index % kRequests.size()](client(), text);
  cs_pause_scene(client(), text, static_cast<int>(index % 2));
  cs_start_recording(client(), text, text);
  cs_lift_ban(client(), text, text);
}

void Program::readAnswers() {
  cs_datagram_answer datagrams;
  if (cs_get_datagram_answer(client(), &datagrams) != 0) {
    require((datagrams.addresses == 0) == (datagrams.port == 0), "addresses have a port");
    for (std::uint32_t i = 0; i <= datagrams.addresses; ++i) expectText(cs_datagram_address(client(), i));
  }
  cs_answer answer;
  if (cs_get_answer(client(), &answer) != 0) {
    require(answer.request_id != 0 && answer.request >= CS_REQUEST_CREATE_SCENE, "answers name a request");
    expectText(answer.error_text);
    expectText(answer.name);
    expectText(answer.repairs);
  }
  cs_scene_summary scene;
  for (std::uint32_t i = 0; cs_get_scene(client(), i, &scene) != 0; ++i) {
    expectText(scene.name);
    expectText(scene.description);
  }
  cs_ban ban;
  for (std::uint32_t i = 0; cs_get_ban(client(), i, &ban) != 0; ++i) {
    expectText(ban.subject);
    expectText(ban.display_name);
    expectText(ban.tenant);
  }
  std::size_t bytes = 0;
  const std::uint8_t* definition = cs_definition(client(), &bytes);
  require((definition == nullptr) == (bytes == 0), "a definition has bytes");
  std::uint64_t sent = 0, all = 0;
  if (cs_get_upload(client(), &sent, &all) != 0)
    require(sent <= all && all <= CS_MAX_SCENE_BYTES, "an upload sends no more than it has");
}

void Program::readNumbers() {
  static_cast<void>(cs_get_role(client()));
  cs_pairing_code code;
  if (cs_get_pairing_code(client(), &code) != 0) expectText(code.code);
  expectText(cs_token(client()));
  std::uint32_t quality = 0;
  cs_get_quality(client(), &quality);
  require(std::isfinite(cs_stream_seconds(client())), "the time of the stream is finite");
  require(cs_frame_divisor(client()) >= 1, "frames have a divisor");
  cs_collider played;
  require(cs_get_played_collider(client(), cs_played_collider_count(client()), &played) == 0,
          "there are no more colliders than their number");
  for (std::uint32_t i = 0; i < cs_cloth_count(client()); ++i) {
    cs_submesh submesh;
    require(cs_get_submesh(client(), i, cs_submesh_count(client(), i), &submesh) == 0,
            "there are no more parts than their number");
  }
  cs_collider collider;
  require(cs_get_collider(client(), cs_collider_count(client()), &collider) == 0,
          "there are no more colliders than their number");
  cs_participant participant;
  require(cs_get_participant(client(), cs_participant_count(client()), &participant) == 0,
          "there are no more participants than their number");
  cs_grab_event grab;
  require(cs_get_grab_event(client(), cs_grab_event_count(client()), &grab) == 0,
          "there are no more events than their number");
  cs_contact_event contact;
  require(cs_get_contact_event(client(), cs_contact_event_count(client()), &contact) == 0,
          "there are no more events than their number");
  static_cast<void>(cs_error_code(client()));
  expectText(cs_error_server(client()));
  expectText(cs_connect_server(client()));
  static_cast<void>(cs_notice_participant(client()));
  static_cast<void>(cs_parameters_participant(client()));
  static_cast<void>(cs_participant_id(client()));
  static_cast<void>(cs_reconstruction_hash(client()));
  static_cast<void>(cs_resumed(client()));
  static_cast<void>(cs_simulation_rate(client()));
  static_cast<void>(cs_stream_rate(client()));
}

void run(const CoreInput& input) {
  Program(input).run();
}

constexpr std::array<std::string_view, 7> kWords{"curtain", "sheet", "ball", "stone", "cotton", "rail", ""};

}  // namespace

const Target kCoreTarget{.name = "core",
                         .run = &runStructured<CoreInput, &run>,
                         .structure = &CoreInput::default_instance(),
                         .words = kWords};

}  // namespace clothstream::fuzz

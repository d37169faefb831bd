// SPDX-License-Identifier: MIT
// Hello, Welcome, and the description in chunks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/stream/content_assembly.h"
#include "tests/core/scripted_server.h"
#include "tests/core/sessions.h"

namespace clothstream::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Joining, SendsOnlyHelloFirst) {
  ClientUnderTest client("flag");
  cs_update(client.get(), 1'000'000);
  const auto messages = client.outgoing();
  ASSERT_THAT(messages, SizeIs(1));
  ASSERT_TRUE(messages[0].has_hello());
  EXPECT_EQ(messages[0].hello().protocol_version(), CS_PROTOCOL_VERSION);
  EXPECT_THAT(messages[0].hello().codecs(), ElementsAre(2));
  EXPECT_EQ(messages[0].hello().scene(), "flag");
  EXPECT_EQ(messages[0].hello().client_name(), "test");
  EXPECT_NE(messages[0].request_id(), 0u);
}

TEST(Joining, SendsTheTokenBeforeHelloOnEachConnection) {
  ClientUnderTest client;
  cs_set_pairing_code(client.get(), "123456");
  cs_set_token(client.get(), "a.b.c");
  EXPECT_STREQ(cs_token(client.get()), "a.b.c");
  for (int connection = 0; connection < 2; ++connection) {
    const auto sent = client.outgoing();
    ASSERT_THAT(sent, SizeIs(2));
    EXPECT_EQ(sent[0].authenticate().token(), "a.b.c");
    EXPECT_TRUE(sent[1].has_hello());
    cs_connecting(client.get(), 1'000'000);
  }
  cs_set_token(client.get(), "");
  EXPECT_THAT(client.outgoing(), SizeIs(1));
}

TEST(Joining, PairsAndReconnectsWithTheTokenOfTheServer) {
  ClientUnderTest client;
  cs_set_pairing_code(client.get(), "123456");
  const auto first = client.outgoing();
  ASSERT_THAT(first, SizeIs(2));
  EXPECT_EQ(first[0].authenticate().pairing_code(), "123456");
  EXPECT_STREQ(cs_token(client.get()), "");
  v1::ServerMessage answer;
  answer.mutable_authenticate()->set_token("d.e.f");
  EXPECT_EQ(client.receive(answer.SerializeAsString()), std::uint32_t{CS_EVENT_TOKEN});
  EXPECT_STREQ(cs_token(client.get()), "d.e.f");
  cs_connecting(client.get(), 1'000'000);
  EXPECT_EQ(client.outgoing()[0].authenticate().token(), "d.e.f");
  // The answer to a token has none, and changes nothing.
  answer.mutable_authenticate()->clear_token();
  EXPECT_EQ(client.receive(answer.SerializeAsString()), 0u);
  EXPECT_STREQ(cs_token(client.get()), "d.e.f");
}

TEST(Joining, RenewedTokenCountsOnceTheServerHasAcceptedIt) {
  ClientUnderTest early;
  EXPECT_EQ(cs_renew_token(early.get(), "d.e.f"), 0) << "before the client has joined";
  JoinedClient joined;
  cs_client* const client = joined.client.get();
  EXPECT_EQ(cs_renew_token(client, ""), 0);
  ASSERT_EQ(cs_renew_token(client, "refused"), 1);
  EXPECT_EQ(joined.sent().authenticate().token(), "refused");
  joined.client.receive(ScriptedServer::error(v1::ERROR_CODE_OUT_OF_ORDER, "another subject", false));
  EXPECT_EQ(cs_get_state(client), CS_STATE_JOINED);
  EXPECT_STREQ(cs_token(client), "");
  v1::ServerMessage answer;
  answer.mutable_authenticate();
  ASSERT_EQ(cs_renew_token(client, "d.e.f"), 1);
  joined.client.receive(answer.SerializeAsString());
  EXPECT_STREQ(cs_token(client), "d.e.f");
  // An answer on the next connection belongs to that connection's own token.
  ASSERT_EQ(cs_renew_token(client, "g.h.i"), 1);
  cs_connecting(client, 1'000'000);
  joined.client.receive(answer.SerializeAsString());
  EXPECT_STREQ(cs_token(client), "d.e.f");
}

TEST(Joining, FailsWithTheCodeOfTheServerAfterAWrongProof) {
  ClientUnderTest client;
  client.receive(ScriptedServer::error(v1::ERROR_CODE_WRONG_PAIRING_CODE, "the pairing code is wrong", true));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_EQ(cs_error_code(client.get()), std::uint32_t{CS_ERROR_WRONG_PAIRING_CODE});
  EXPECT_EQ(int{CS_ERROR_UNAUTHENTICATED}, int{v1::ERROR_CODE_UNAUTHENTICATED});
  EXPECT_EQ(int{CS_ERROR_WRONG_PAIRING_CODE}, int{v1::ERROR_CODE_WRONG_PAIRING_CODE});
}

TEST(Joining, AsksForPairingCodesAndBans) {
  ScriptedServer server;
  ClientUnderTest client;
  client.receive(server.welcome());
  static_cast<void>(client.outgoing());
  cs_pairing_code code;
  EXPECT_EQ(cs_get_pairing_code(client.get(), &code), 0);
  cs_create_pairing_code(client.get(), CS_ROLE_VIEWER);
  cs_ban_participant(client.get(), 7);
  const auto sent = client.outgoing();
  ASSERT_THAT(sent, SizeIs(2));
  EXPECT_EQ(sent[0].create_pairing_code().role(), v1::ROLE_VIEWER);
  EXPECT_EQ(sent[1].remove_participant().participant_id(), 7u);
  EXPECT_TRUE(sent[1].remove_participant().ban());
  v1::ServerMessage answer;
  answer.mutable_create_pairing_code()->set_code("012345");
  answer.mutable_create_pairing_code()->set_role(v1::ROLE_VIEWER);
  answer.mutable_create_pairing_code()->set_valid_s(300);
  EXPECT_EQ(client.receive(answer.SerializeAsString()), std::uint32_t{CS_EVENT_PAIRING_CODE});
  ASSERT_EQ(cs_get_pairing_code(client.get(), &code), 1);
  EXPECT_STREQ(code.code, "012345");
  EXPECT_EQ(code.role, std::uint32_t{CS_ROLE_VIEWER});
  EXPECT_EQ(code.valid_s, 300u);
}

TEST(Joining, SendsTheWantedQualityWithoutLosingRequests) {
  ClientUnderTest client;
  cs_list_scenes(client.get());
  cs_want(client.get(), 2);
  const auto sent = client.outgoing();
  ASSERT_THAT(sent, SizeIs(2));
  EXPECT_EQ(sent[0].hello().quality(), 2u);
  EXPECT_TRUE(sent[1].has_list_scenes());
}

// The server ends a connection with two Hellos.
TEST(Joining, SendsALaterWantedQualityWithTheNextConnection) {
  ClientUnderTest client;
  client.outgoing();
  cs_want(client.get(), 1);
  EXPECT_THAT(client.outgoing(), SizeIs(0));
  client.join(ScriptedServer());
  cs_list_scenes(client.get());
  cs_want(client.get(), 2);
  const auto sent = client.outgoing();
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_TRUE(sent[0].has_list_scenes());

  cs_disconnected(client.get(), 0);
  cs_want(client.get(), 3);
  EXPECT_THAT(client.outgoing(), SizeIs(0));
  cs_connecting(client.get(), 0);
  const auto again = client.outgoing();
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].hello().quality(), 3u);
}

TEST(Joining, IsJoinedWhenTheDescriptionIsComplete) {
  ScriptedServer server;
  ClientUnderTest client;
  EXPECT_EQ(client.receive(server.welcome()), 0u);
  const auto chunks = server.chunks(100);
  ASSERT_GT(chunks.size(), 3u);
  for (std::size_t i = 0; i + 1 < chunks.size(); ++i) {
    EXPECT_EQ(client.receive(chunks[i]), 0u);
    EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINING);
  }
  EXPECT_EQ(client.receive(chunks.back()), static_cast<std::uint32_t>(CS_EVENT_DESCRIPTION));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
  EXPECT_STREQ(cs_scene_name(client.get()), "curtain");
  EXPECT_STREQ(cs_server_name(client.get()), "scripted 1");
  EXPECT_STREQ(cs_device_name(client.get()), "none");
  EXPECT_EQ(cs_participant_id(client.get()), 42u);
  EXPECT_EQ(cs_stream_rate(client.get()), 72u);
}

TEST(Joining, ShowsRestPositionsUntilTheFirstFrame) {
  ScriptedServer server;
  ClientUnderTest client;
  const std::vector<float> rest = server.positions();
  client.join(server);
  ASSERT_EQ(cs_vertex_count(client.get()), 63u);
  EXPECT_EQ(std::vector(cs_positions(client.get()), cs_positions(client.get()) + rest.size()), rest);
  // The sheet waves by a few centimetres, so all normals face +Z.
  for (std::uint32_t i = 0; i < 63; ++i) EXPECT_GT(cs_normals(client.get())[3 * i + 2], 0.9f);
}

TEST(Joining, ReturnsTrianglesOfEachCloth) {
  ScriptedServer server({.cloths = {{"a", 2, 3}, {"b", 2, 2}}});
  ClientUnderTest client;
  client.join(server);
  std::uint32_t count = 0;
  const std::uint32_t* triangles = cs_triangles(client.get(), &count);
  EXPECT_THAT(std::vector(triangles, triangles + count),
              ElementsAre(0, 3, 1, 1, 3, 4, 1, 4, 2, 2, 4, 5, 6, 8, 7, 7, 8, 9));
  cs_cloth cloth;
  ASSERT_EQ(cs_cloth_count(client.get()), 2u);
  ASSERT_EQ(cs_get_cloth(client.get(), 1, &cloth), 1);
  EXPECT_STREQ(cloth.name, "b");
  EXPECT_EQ(cloth.first_vertex, 6u);
  EXPECT_EQ(cloth.vertex_count, 4u);
  EXPECT_EQ(cloth.first_index, 12u);
  EXPECT_EQ(cloth.index_count, 6u);
  EXPECT_EQ(cs_get_cloth(client.get(), 2, &cloth), 0);
}

// The first cloth is a grid of 2 x 2. The second is a mesh of two triangles with two texture coordinates per
// vertex at the seam.
v1::StreamDescription withMesh(const ScriptedServer& server) {
  v1::StreamDescription description = server.description();
  v1::ClothDescription& cloth = *description.mutable_cloths(1);
  cloth.set_rows(0);
  cloth.set_columns(0);
  cloth.set_triangles(littleEndian<std::uint32_t>({0, 1, 3, 0, 3, 2}));
  cloth.set_uvs(littleEndian<float>({0, 0, 1, 0, 0, 1, 1, 1, 0.5f, 0.25f}));
  cloth.set_uv_triangles(littleEndian<std::uint32_t>({0, 1, 3, 4, 3, 2}));
  for (const char* name : {"cotton", "silk"}) {
    v1::Submesh& part = *cloth.add_submeshes();
    part.set_name(name);
    part.set_triangle_count(1);
  }
  return description;
}

TEST(Joining, ReturnsTrianglesTextureCoordinatesAndSubmeshesOfAMesh) {
  ScriptedServer server({.cloths = {{"a", 2, 2}, {"b", 2, 2}}});
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(chunksOf(withMesh(server).SerializeAsString(), 100, 1));
  ASSERT_EQ(cs_get_state(client.get()), CS_STATE_JOINED) << cs_error_text(client.get());
  std::uint32_t count = 0;
  const std::uint32_t* triangles = cs_triangles(client.get(), &count);
  EXPECT_THAT(std::vector(triangles + 6, triangles + count), ElementsAre(4, 5, 7, 4, 7, 6));
  cs_cloth cloth;
  ASSERT_EQ(cs_get_cloth(client.get(), 1, &cloth), 1);
  EXPECT_EQ(cloth.rows, 0u);
  EXPECT_EQ(cloth.index_count, 6u);
  const float* uvs = cs_uvs(client.get(), 1, &count);
  ASSERT_EQ(count, 5u);
  EXPECT_EQ(uvs[8], 0.5f);
  const std::uint32_t* corners = cs_uv_indices(client.get(), 1, &count);
  EXPECT_THAT(std::vector(corners, corners + count), ElementsAre(0, 1, 3, 4, 3, 2));
  ASSERT_EQ(cs_submesh_count(client.get(), 1), 2u);
  cs_submesh part;
  ASSERT_EQ(cs_get_submesh(client.get(), 1, 1, &part), 1);
  EXPECT_STREQ(part.name, "silk");
  EXPECT_EQ(part.first_index, 9u);
  EXPECT_EQ(part.index_count, 3u);
  EXPECT_EQ(cs_get_submesh(client.get(), 1, 2, &part), 0);
  EXPECT_EQ(cs_uvs(client.get(), 0, &count), nullptr);
  EXPECT_EQ(cs_submesh_count(client.get(), 0), 0u);
  EXPECT_EQ(cs_uv_indices(client.get(), 7, &count), nullptr);
  // The mesh's triangles have the opposite orientation of the grid's.
  const float* normals = cs_normals(client.get());
  for (std::size_t i = 0; i < 8; ++i) EXPECT_GT((i < 4 ? 1.0f : -1.0f) * normals[3 * i + 2], 0.5f) << i;
}

TEST(Joining, RefusesInconsistentMeshes) {
  struct Wrong {
    const char* says;
    void (*corrupt)(v1::ClothDescription&);
  };
  const Wrong cases[] = {
      {"the size of triangles is not a multiple of 4 bytes", [](auto& c) { c.set_triangles("abc"); }},
      {"a triangle names a vertex that is not there",
       [](auto& c) {
         c.set_triangles(littleEndian<std::uint32_t>({0, 1, 3, 0, 3, 4}));
       }},
      {"a triangle names a vertex that is not there",
       [](auto& c) {
         c.set_triangles(littleEndian<std::uint32_t>({0, 1}));
       }},
      {"rows x columns", [](auto& c) { c.set_rows(2), c.set_columns(2); }},
      {"uvs are not pairs", [](auto& c) { c.set_uvs(littleEndian<float>({1})); }},
      {"uvs are not pairs",
       [](auto& c) {
         c.set_uvs(littleEndian<float>({1, NAN}));
       }},
      {"uv_triangles are not one of 4",
       [](auto& c) {
         c.set_uvs(littleEndian<float>({0, 0, 1, 0, 0, 1, 1, 1}));
       }},
      {"uv_triangles are not one of 0", [](auto& c) { c.clear_uvs(); }},
      {"for each of 6 corners",
       [](auto& c) {
         c.set_uv_triangles(littleEndian<std::uint32_t>({0, 1}));
       }},
      {"submeshes do not cover its 2 triangles",
       [](auto& c) { c.mutable_submeshes(0)->set_triangle_count(2); }},
      {"not a StreamDescription", [](auto& c) { c.mutable_submeshes(0)->set_triangle_count(4'000'000'000); }},
  };
  for (const Wrong& wrong : cases) {
    ScriptedServer server({.cloths = {{"a", 2, 2}, {"b", 2, 2}}});
    v1::StreamDescription description = withMesh(server);
    wrong.corrupt(*description.mutable_cloths(1));
    ClientUnderTest client;
    client.receive(server.welcome());
    client.receiveAll(chunksOf(description.SerializeAsString(), 1000, 1));
    EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED) << wrong.says;
    EXPECT_THAT(cs_error_text(client.get()), HasSubstr(wrong.says));
  }
}

TEST(Joining, ReplacesTheDescription) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  ScriptedServer next({.epoch = 8, .cloths = {{"a", 3, 3}, {"b", 2, 2}}});
  for (const std::string& chunk : next.chunks(64, 9)) client.receive(chunk);
  EXPECT_EQ(cs_vertex_count(client.get()), 13u);
  EXPECT_EQ(client.receive(next.frame(1)), static_cast<std::uint32_t>(CS_EVENT_FRAME));
}

TEST(Joining, RefusesAnotherProtocolVersionAndNamesBoth) {
  v1::ServerMessage message;
  message.mutable_welcome()->set_protocol_version(9);
  message.mutable_welcome()->set_codec(2);
  ClientUnderTest client;
  EXPECT_EQ(client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_ERROR));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("version 9"));
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("version 1"));
  EXPECT_THAT(client.outgoing(), IsEmpty());
}

TEST(Joining, RefusesUnknownCodec) {
  v1::ServerMessage message;
  message.mutable_welcome()->set_protocol_version(1);
  message.mutable_welcome()->set_codec(5);
  ClientUnderTest client;
  client.receive(message.SerializeAsString());
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("codec 5"));
}

TEST(Joining, ReportsWhyTheServerRefuses) {
  ClientUnderTest client;
  client.receive(ScriptedServer::error(v1::ERROR_CODE_NOT_FOUND,
                                       "hello.scene: there is no 'x'; there is curtain", true));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_STREQ(cs_error_text(client.get()), "hello.scene: there is no 'x'; there is curtain");
  EXPECT_EQ(cs_error_code(client.get()), static_cast<std::uint32_t>(v1::ERROR_CODE_NOT_FOUND));
}

TEST(Joining, ContinuesAfterANonFatalError) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  EXPECT_EQ(client.receive(ScriptedServer::error(v1::ERROR_CODE_INVALID_ARGUMENT, "no", false)),
            static_cast<std::uint32_t>(CS_EVENT_ERROR));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
}

TEST(Joining, AnErrorThatTheClientFindsHasNoCodeOfTheServer) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  client.receive(ScriptedServer::error(v1::ERROR_CODE_INVALID_ARGUMENT, "no", false));
  EXPECT_EQ(cs_error_code(client.get()), static_cast<std::uint32_t>(v1::ERROR_CODE_INVALID_ARGUMENT));
  client.receive("\xff");
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_EQ(cs_error_code(client.get()), 0u);
}

TEST(Joining, RefusesFramesAndDescriptionsOutOfOrder) {
  ScriptedServer server;
  ClientUnderTest early;
  early.receive(server.chunks()[0]);
  EXPECT_THAT(cs_error_text(early.get()), HasSubstr("before its Welcome"));
  ClientUnderTest frameFirst;
  frameFirst.receive(server.welcome());
  frameFirst.receive(server.frame(1));
  EXPECT_THAT(cs_error_text(frameFirst.get()), HasSubstr("before the description"));
  ClientUnderTest twice;
  twice.receive(server.welcome());
  twice.receive(server.welcome());
  EXPECT_THAT(cs_error_text(twice.get()), HasSubstr("twice"));
}

// ---- Wrong descriptions

struct WrongDescription {
  const char* name;
  void (*corrupt)(v1::StreamDescription&);
  const char* says;
};

void PrintTo(const WrongDescription& wrong, std::ostream* out) {
  *out << wrong.name;
}

class Descriptions : public ::testing::TestWithParam<WrongDescription> {};

TEST_P(Descriptions, AreRefusedWithAReason) {
  ScriptedServer server;
  v1::StreamDescription description = server.description();
  GetParam().corrupt(description);
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(chunksOf(description.SerializeAsString(), 1000, 1));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr(GetParam().says));
}

std::string floats(std::initializer_list<float> values) {
  return std::string(reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(float));
}

INSTANTIATE_TEST_SUITE_P(
    Wrong, Descriptions,
    ::testing::Values(
        WrongDescription{"no_cloth", [](v1::StreamDescription& d) { d.clear_cloths(); }, "0 cloths"},
        WrongDescription{"a_codec", [](v1::StreamDescription& d) { d.set_codec(1); }, "codec is 1"},
        WrongDescription{"a_reserved_codec", [](v1::StreamDescription& d) { d.set_codec(3); },
                         "codec is 3; this client decodes codec 2"},
        WrongDescription{"no_rate", [](v1::StreamDescription& d) { d.set_simulation_rate(0); },
                         "simulation_rate is 0"},
        WrongDescription{"rate", [](v1::StreamDescription& d) { d.set_stream_rate(71); },
                         "stream_rate is 71"},
        WrongDescription{"rows", [](v1::StreamDescription& d) { d.mutable_cloths(0)->set_rows(8); },
                         "rows x columns"},
        WrongDescription{"overflow",
                         [](v1::StreamDescription& d) {
                           d.mutable_cloths(0)->set_rows(0x10000);
                           d.mutable_cloths(0)->set_columns(0x10000);
                         },
                         "8589672450 triangles; this client accepts at most 2097152"},
        WrongDescription{
            "too_many_vertices",
            [](v1::StreamDescription& d) { d.mutable_cloths(0)->set_vertex_count(4'000'000'000); },
            "4000000000 vertices; this client accepts at most 1048576"},
        WrongDescription{"max_error", [](v1::StreamDescription& d) { d.set_max_error(0); }, "max_error"},
        WrongDescription{"qualities", [](v1::StreamDescription& d) { d.set_qualities(257); }, "qualities"},
        WrongDescription{"not_finite",
                         [](v1::StreamDescription& d) {
                           v1::ClothDescription& cloth = *d.mutable_cloths(0);
                           cloth.set_rows(2);
                           cloth.set_columns(2);
                           cloth.set_vertex_count(4);
                           cloth.set_rest_positions(floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, NAN}));
                         },
                         "cloth \"curtain\": a rest position is not finite"},
        WrongDescription{"too_far",
                         [](v1::StreamDescription& d) {
                           v1::ClothDescription& cloth = *d.mutable_cloths(0);
                           cloth.set_rows(2);
                           cloth.set_columns(2);
                           cloth.set_vertex_count(4);
                           cloth.set_rest_positions(floats({0, 0, 0, 1e30f, 0, 0, 0, 1e30f, 0, 0, 1, 0}));
                         },
                         "farther than 1000 km from the origin"}),
    [](const auto& instance) { return std::string(instance.param.name); });

// ---- Chunks

Chunk chunk(std::uint64_t id, std::uint32_t index, std::uint32_t count, std::uint64_t total,
            const std::string& data) {
  return {
      .contentId = id, .kind = 1, .index = index, .count = count, .totalBytes = total, .data = Bytes(data)};
}

TEST(ContentAssembly, AssemblesInterleavedContents) {
  ContentAssembly assembly;
  EXPECT_EQ(assembly.add(chunk(1, 0, 2, 4, "ab"), Limits{}.contentBytes).value(), std::nullopt);
  EXPECT_EQ(assembly.add(chunk(2, 0, 3, 3, "x"), Limits{}.contentBytes).value(), std::nullopt);
  EXPECT_EQ(assembly.add(chunk(1, 1, 2, 4, "cd"), Limits{}.contentBytes).value(), "abcd");
  EXPECT_EQ(assembly.add(chunk(2, 1, 3, 3, "y"), Limits{}.contentBytes).value(), std::nullopt);
  EXPECT_EQ(assembly.add(chunk(2, 2, 3, 3, "z"), Limits{}.contentBytes).value(), "xyz");
  // The id can be used again.
  EXPECT_EQ(assembly.add(chunk(1, 0, 1, 1, "q"), Limits{}.contentBytes).value(), "q");
}

TEST(ContentAssembly, IgnoresUnknownKinds) {
  ContentAssembly assembly;
  Chunk unknown = chunk(1, 5, 2, ~0ull, "ab");
  unknown.kind = 77;
  EXPECT_EQ(assembly.add(unknown, Limits{}.contentBytes).value(), std::nullopt);
}

TEST(ContentAssembly, RefusesInconsistentChunks) {
  const auto refusal = [](std::initializer_list<Chunk> pieces) {
    ContentAssembly assembly;
    std::string text;
    for (const Chunk& piece : pieces) {
      if (const auto result = assembly.add(piece, Limits{}.contentBytes); !result) text = result.error();
    }
    return text;
  };
  EXPECT_THAT(refusal({chunk(1, 1, 2, 4, "ab")}), HasSubstr("first piece is missing"));
  EXPECT_THAT(refusal({chunk(1, 0, 3, 6, "ab"), chunk(1, 2, 3, 6, "cd")}), HasSubstr("expected piece 1"));
  EXPECT_THAT(refusal({chunk(1, 0, 3, 6, "ab"), chunk(1, 1, 4, 6, "cd")}), HasSubstr("another size"));
  EXPECT_THAT(refusal({chunk(1, 0, 0, 0, "")}), HasSubstr("at least one"));
  EXPECT_THAT(refusal({chunk(1, 0, 2, 3, "abcd")}), HasSubstr("more bytes than the 3"));
  EXPECT_THAT(refusal({chunk(1, 0, 1, 3, "ab")}), HasSubstr("2 bytes of 3"));
  EXPECT_THAT(refusal({chunk(1, 0, 2, 256ull * 1024 * 1024 + 1, "ab")}),
              HasSubstr("268435457 bytes announced"));
  EXPECT_THAT(refusal({chunk(1, 0, 2, 256ull * 1024 * 1024, "ab"), chunk(2, 0, 2, 1, "")}),
              HasSubstr("together"));
  const std::string large(256 * 1024 + 1, 'x');
  EXPECT_THAT(refusal({chunk(1, 0, 2, large.size(), large)}), HasSubstr("at most 262144"));
  EXPECT_THAT(refusal({chunk(1, 0, 2, 4, ""), chunk(2, 0, 2, 4, ""), chunk(3, 0, 2, 4, ""),
                       chunk(4, 0, 2, 4, ""), chunk(5, 0, 2, 4, "")}),
              HasSubstr("more than 4"));
}

TEST(Interface, RefusesUnknownVersions) {
  const JoinedClient joined;
  const cs_client* client = joined.client.get();
  cs_client_options options = optionsFor("curtain");
  options.version = CS_CLIENT_OPTIONS_VERSION + 1;
  EXPECT_EQ(cs_create(&options), nullptr);
  EXPECT_EQ(cs_create_mirror(&options), nullptr);
  cs_cloth cloth;
  EXPECT_EQ(cs_get_cloth(client, 0, &cloth), 1);
  cloth.version = CS_CLOTH_VERSION + 1;
  EXPECT_EQ(cs_get_cloth(client, 0, &cloth), 0);
  cs_environment environment;
  EXPECT_EQ(cs_get_environment(client, &environment), 1);
  environment.version = CS_ENVIRONMENT_VERSION + 1;
  EXPECT_EQ(cs_get_environment(client, &environment), 0);
  cs_statistics statistics;
  EXPECT_EQ(cs_get_statistics(client, 0, &statistics), 1);
  statistics.version = CS_STATISTICS_VERSION + 1;
  EXPECT_EQ(cs_get_statistics(client, 0, &statistics), 0);
}

TEST(Interface, StringsOfOptionsMayBeNull) {
  const cs_client_options options{};
  const std::unique_ptr<cs_client, decltype(&cs_destroy)> client(cs_create(&options), &cs_destroy);
  std::size_t bytes = 0;
  const std::uint8_t* message = cs_next_outgoing(client.get(), &bytes);
  v1::ClientMessage hello;
  ASSERT_TRUE(hello.ParseFromArray(message, static_cast<int>(bytes)));
  EXPECT_EQ(hello.hello().scene(), "");
}

}  // namespace
}  // namespace clothstream::client

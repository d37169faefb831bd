// SPDX-License-Identifier: MIT
// Surfaces of the real room of a peer: parts, errors, the policy of the server, and who gets their shape.
#include "tests/model/surfaces.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using tests::TestPeer;
using Body = v1::ServerMessage;

// A mesh in parts of this number of vertices and triangles.
std::vector<v1::ClientMessage> partsOf(std::uint32_t id, const model::Triangles& mesh, std::size_t each,
                                       float y) {
  std::vector<v1::ClientMessage> messages;
  const std::size_t all = std::max(mesh.vertices.size(), mesh.triangles.size());
  const auto count = static_cast<std::uint32_t>((all + each - 1) / each);
  for (std::uint32_t index = 0; index < count; ++index) {
    v1::SurfaceUpdate& update = *messages.emplace_back().mutable_surface();
    update.set_id(id);
    if (index == 0) update.mutable_pose()->mutable_position()->set_y(y);
    v1::SurfacePart& part = *update.mutable_part();
    part.set_index(index);
    part.set_count(count);
    for (std::size_t i = each * index; i < std::min(each * (index + 1), mesh.vertices.size()); ++i)
      for (int axis = 0; axis < 3; ++axis) part.add_positions(mesh.vertices[i][axis]);
    for (std::size_t i = each * index; i < std::min(each * (index + 1), mesh.triangles.size()); ++i)
      for (const std::uint32_t corner : mesh.triangles[i]) part.add_triangles(corner);
  }
  return messages;
}

class SurfacesTest : public tests::ServerTest {
 protected:
  static model::Scene falling() {
    model::Scene scene = tests::smallScene("falling");
    scene.colliders.clear();
    scene.cloths[0].pins.clear();
    return scene;
  }
  static void sendAll(TestPeer& peer, const std::vector<v1::ClientMessage>& messages) {
    for (const v1::ClientMessage& message : messages) peer.send(message);
  }
  static v1::Error refused(TestPeer& peer) { return peer.readUntil(Body::kError).error(); }
  static v1::Error refused(TestPeer& peer, const v1::ClientMessage& message) {
    peer.send(message);
    return refused(peer);
  }
  std::size_t surfacesOf(const std::string& scene) {
    std::vector<scene::RoomSurface> all;
    std::uint64_t version = 0;
    server().scenes.find(scene)->surfaces.take(version, all);
    return all.size();
  }
  // Waits until the scene has this number of surfaces.
  void awaitSurfaces(TestPeer& peer, const std::string& scene, std::size_t count) {
    while (surfacesOf(scene) != count) peer.readFrames(1);
  }
  static float lowest(const TestPeer& peer) {
    const auto positions = peer.decoder().positions();
    float lowest = positions[1];
    for (std::size_t i = 1; i < positions.size(); i += 3) lowest = std::min(lowest, positions[i]);
    return lowest;
  }
};

#define START_SURFACES(...)                    \
  ASSERT_NO_FATAL_FAILURE(start(__VA_ARGS__)); \
  if (::testing::Test::IsSkipped()) return

TEST_F(SurfacesTest, CarryTheClothAndAreSentToNoOtherClient) {
  START_SURFACES({}, {falling()});
  TestPeer owner(server());
  owner.join("falling");
  EXPECT_EQ(owner.welcome().surfaces().policy(), v1::SURFACE_POLICY_OWN);
  EXPECT_EQ(owner.welcome().surfaces().max_triangles(), 50'000u);
  EXPECT_EQ(owner.welcome().surfaces().max_surfaces(), 64u);
  // The fall takes two seconds, so that the surface is there in time on a slow machine, too.
  constexpr float kFloor = -20;
  sendAll(owner, partsOf(3, model::flat(40, 40, 6), 10, kFloor));
  awaitSurfaces(owner, "falling", 1);
  TestPeer other(server());
  other.join("falling");
  while (lowest(other) > kFloor + 0.1f) other.readFrames(1);
  other.readFrames(40);
  EXPECT_GT(lowest(other), kFloor);
  for (const tests::SeenFrame& frame : other.frames()) EXPECT_TRUE(frame.colliders.empty());
  v1::ClientMessage removal;
  removal.mutable_surface()->set_id(3);
  removal.mutable_surface()->set_remove(true);
  owner.send(removal);
  while (lowest(other) > kFloor - 1) other.readFrames(1);
}

TEST_F(SurfacesTest, GoWithTheirParticipantAndComeBackWithIt) {
  START_SURFACES({}, {falling()});
  TestPeer stays(server()), leaves(server()), returns(server());
  for (TestPeer* peer : {&stays, &leaves, &returns}) {
    peer->join("falling");
    sendAll(*peer, partsOf(1, model::flat(4, 4), 10, -9));
  }
  awaitSurfaces(stays, "falling", 3);
  leaves.leave();
  EXPECT_EQ(surfacesOf("falling"), 2u);
  v1::Hello hello;
  hello.set_protocol_version(1);
  hello.add_codecs(returns.welcome().codec());
  hello.set_scene("falling");
  hello.set_resume_token(returns.welcome().resume_token());
  returns.vanish();
  TestPeer again(server());
  again.hello(hello);
  again.readUntil(Body::kWelcome);
  EXPECT_EQ(surfacesOf("falling"), 2u);
}

TEST_F(SurfacesTest, EndIfTheClientDoesNotKeepThem) {
  START_SURFACES();
  TestPeer peer(server());
  peer.join();
  for (const std::uint32_t id : {1u, 2u, 3u}) sendAll(peer, partsOf(id, model::flat(1, 1), 10, 0));
  awaitSurfaces(peer, "small", 3);
  const auto keep = [&](const std::vector<std::uint32_t>& ids) {
    v1::ClientMessage message;
    auto& kept = *message.mutable_surface()->mutable_keep();
    kept.mutable_ids()->Add(ids.begin(), ids.end());
    peer.send(message);
  };
  // A mesh that is not complete stays if its surface does.
  const std::vector<v1::ClientMessage> parts = partsOf(3, model::flat(1, 1, 4), 10, 0);
  peer.send(parts[0]);
  keep({3, 1, 7});
  sendAll(peer, {parts.begin() + 1, parts.end()});
  awaitSurfaces(peer, "small", 2);
  peer.send(parts[0]);
  keep({});
  awaitSurfaces(peer, "small", 0);
  EXPECT_THAT(refused(peer, parts[1]).text(), HasSubstr("must be 0; send"));
}

TEST_F(SurfacesTest, AreRefusedByAServerThatTakesNone) {
  hosting::ServerOptions options;
  options.roomSurfaces = hosting::SurfacePolicy::off;
  START_SURFACES(options);
  TestPeer peer(server());
  peer.join();
  EXPECT_EQ(peer.welcome().surfaces().policy(), v1::SURFACE_POLICY_OFF);
  const v1::Error error = refused(peer, partsOf(1, model::flat(1, 1), 10, 0)[0]);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(error.text(), HasSubstr("--room-surfaces off"));
}

// The mesh of a surface in a list, part by part.
model::Triangles meshOf(TestPeer& peer, const v1::RoomSurface& surface) {
  model::Triangles mesh;
  for (std::uint32_t index = 0; index < surface.part_count(); ++index) {
    v1::ClientMessage request;
    request.set_request_id(100 + index);
    request.mutable_get_surface_part()->set_participant_id(surface.participant_id());
    request.mutable_get_surface_part()->set_id(surface.id());
    request.mutable_get_surface_part()->set_revision(surface.revision());
    request.mutable_get_surface_part()->set_index(index);
    peer.send(request);
    const v1::ServerMessage answer = peer.readUntil(Body::kGetSurfacePart);
    EXPECT_EQ(answer.request_id(), 100 + index);
    const v1::SurfacePart& part = answer.get_surface_part().part();
    EXPECT_EQ(part.index(), index);
    EXPECT_EQ(part.count(), surface.part_count());
    for (int i = 0; i + 2 < part.positions_size(); i += 3)
      mesh.vertices.emplace_back(part.positions(i), part.positions(i + 1), part.positions(i + 2));
    for (int i = 0; i + 2 < part.triangles_size(); i += 3)
      mesh.triangles.push_back({part.triangles(i), part.triangles(i + 1), part.triangles(i + 2)});
  }
  return mesh;
}

TEST_F(SurfacesTest, AreSentToEveryoneIfThatIsThePolicy) {
  hosting::ServerOptions options;
  options.roomSurfaces = hosting::SurfacePolicy::everyone;
  START_SURFACES(options);
  TestPeer owner(server()), viewer(server());
  viewer.role = v1::ROLE_VIEWER;
  owner.join();
  viewer.join();
  EXPECT_EQ(owner.welcome().surfaces().policy(), v1::SURFACE_POLICY_EVERYONE);
  // More triangles than one part has.
  const model::Triangles mesh = model::flat(5, 5, 50);
  sendAll(owner, partsOf(3, mesh, 2000, -3));
  const v1::RoomSurfaces list = viewer.readUntil(Body::kRoomSurfaces).room_surfaces();
  ASSERT_EQ(list.surfaces_size(), 1);
  const v1::RoomSurface& surface = list.surfaces(0);
  EXPECT_EQ(surface.participant_id(), owner.welcome().participant_id());
  EXPECT_EQ(surface.id(), 3u);
  EXPECT_EQ(surface.pose().position().y(), -3);
  EXPECT_EQ(surface.triangle_count(), 5000u);
  EXPECT_EQ(surface.part_count(), 3u);
  const model::Triangles seen = meshOf(viewer, surface);
  EXPECT_EQ(seen.vertices.size(), surface.vertex_count());
  EXPECT_EQ(seen.triangles.size(), 5000u);

  // A client that joins later has them at once. A new pose and a new mesh are announced.
  TestPeer late(server());
  late.hello("");
  const std::uint64_t revision = surface.revision();
  EXPECT_EQ(late.readUntil(Body::kRoomSurfaces).room_surfaces().surfaces(0).revision(), revision);
  v1::ClientMessage move;
  move.mutable_surface()->set_id(3);
  move.mutable_surface()->mutable_pose()->mutable_position()->set_y(-4);
  owner.send(move);
  const v1::RoomSurfaces moved = viewer.readUntil(Body::kRoomSurfaces).room_surfaces();
  EXPECT_EQ(moved.surfaces(0).pose().position().y(), -4);
  EXPECT_EQ(moved.surfaces(0).revision(), revision);
  sendAll(owner, partsOf(3, model::flat(1, 1), 10, -4));
  const v1::RoomSurfaces replaced = viewer.readUntil(Body::kRoomSurfaces).room_surfaces();
  EXPECT_NE(replaced.surfaces(0).revision(), revision);
  EXPECT_EQ(replaced.surfaces(0).triangle_count(), 2u);

  // The former mesh is gone, and a part that does not exist is refused.
  v1::ClientMessage request;
  v1::GetSurfacePartRequest& part = *request.mutable_get_surface_part();
  part.set_participant_id(surface.participant_id());
  part.set_id(3);
  part.set_revision(revision);
  EXPECT_EQ(refused(viewer, request).code(), v1::ERROR_CODE_NOT_FOUND);
  part.set_revision(replaced.surfaces(0).revision());
  part.set_index(2);
  EXPECT_THAT(refused(viewer, request).text(), HasSubstr("getSurfacePart.index = 2: must be 0 to 1"));

  owner.leave();
  EXPECT_EQ(viewer.readUntil(Body::kRoomSurfaces).room_surfaces().surfaces_size(), 0);
}

TEST_F(SurfacesTest, AreNotSentOnRequestUnderAnotherPolicy) {
  START_SURFACES();
  TestPeer owner(server()), other(server());
  owner.join();
  other.join();
  sendAll(owner, partsOf(3, model::flat(1, 1), 10, -3));
  awaitSurfaces(owner, "small", 1);
  v1::ClientMessage request;
  request.mutable_get_surface_part()->set_participant_id(owner.welcome().participant_id());
  request.mutable_get_surface_part()->set_id(3);
  request.mutable_get_surface_part()->set_revision(1);
  const v1::Error error = refused(other, request);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(error.text(), HasSubstr("--room-surfaces everyone"));
}

TEST_F(SurfacesTest, NeedTheRoleParticipant) {
  START_SURFACES();
  TestPeer viewer(server());
  viewer.role = v1::ROLE_VIEWER;
  viewer.join();
  const v1::Error error = refused(viewer, partsOf(1, model::flat(1, 1), 10, 0)[0]);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_THAT(error.text(), HasSubstr("surface: requires the role participant"));
}

TEST_F(SurfacesTest, HostilePartsGetAnErrorAndChangeNothing) {
  START_SURFACES();
  TestPeer peer(server());
  peer.join();
  const std::vector<v1::ClientMessage> good = partsOf(1, model::flat(1, 1, 4), 10, 0);
  ASSERT_EQ(good.size(), 4u);
  const auto changed = [&](std::size_t index, const auto& change) {
    v1::ClientMessage message = good[index];
    change(*message.mutable_surface());
    return message;
  };
  const struct {
    v1::ClientMessage message;
    const char* text;
  } cases[] = {
      {changed(0, [](v1::SurfaceUpdate& update) { update.clear_part(), update.clear_pose(); }),
       "must have a part, a pose, remove = true, or keep"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.set_remove(true); }), "surface.remove = true"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_keep(); }), "surface.keep: must be absent"},
      {changed(0,
               [](v1::SurfaceUpdate& update) {
                 update.Clear();
                 update.set_remove(true);
                 update.mutable_keep();
               }),
       "surface.keep: must be absent in a message with remove"},
      {changed(0,
               [](v1::SurfaceUpdate& update) {
                 update.Clear();
                 update.mutable_keep()->mutable_ids()->Resize(4097, 1);
               }),
       "4096"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_part()->set_count(0); }),
       "surface.part.count = 0"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_part()->set_count(4097); }), "4096"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_part()->set_index(4); }),
       "surface.part.index = 4"},
      {changed(1, [](v1::SurfaceUpdate&) {}), "index = 1 of 4, surface 1: must be 0; send the mesh"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_part()->add_positions(1); }),
       "three numbers"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_part()->add_triangles(1); }),
       "three numbers"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_part()->set_friction(-1); }),
       "friction = -1"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.mutable_pose()->mutable_position()->set_x(NAN); }),
       "pose.position.x = nan"},
      {changed(0, [](v1::SurfaceUpdate& update) { update.clear_part(), update.set_id(8); }),
       "id = 8: you have no such surface"},
  };
  for (const auto& wrong : cases) EXPECT_THAT(refused(peer, wrong.message).text(), HasSubstr(wrong.text));
  // A part that is missing, or of another surface, drops the mesh.
  peer.send(good[0]);
  EXPECT_THAT(refused(peer, good[2]).text(), HasSubstr("must be 0, or part 1 of 4 of surface 1"));
  EXPECT_THAT(refused(peer, good[1]).text(), HasSubstr("must be 0; send"));
  peer.send(good[0]);
  EXPECT_THAT(refused(peer, changed(1, [](v1::SurfaceUpdate& update) { update.set_id(2); })).text(),
              HasSubstr("surface 2: must be 0, or part 1 of 4 of surface 1"));
  // Faults that only a whole mesh shows.
  model::Triangles nan = model::flat(1, 1), far = nan, thin = nan;
  nan.vertices[2].y() = NAN;
  far.triangles[1][0] = 1'000'000;
  thin.vertices.assign(4, model::Vec3::Zero());
  sendAll(peer, partsOf(1, nan, 10, 0));
  EXPECT_THAT(refused(peer).text(), HasSubstr("surface.id = 1: vertex 2 must have finite coordinates"));
  sendAll(peer, partsOf(1, far, 10, 0));
  EXPECT_THAT(refused(peer).text(), HasSubstr("triangle 1 has the corner 1000000, but there are 4"));
  sendAll(peer, partsOf(1, thin, 10, 0));
  EXPECT_THAT(refused(peer).text(), HasSubstr("has no triangle"));
  EXPECT_EQ(surfacesOf("small"), 0u);
  sendAll(peer, good);
  awaitSurfaces(peer, "small", 1);
}

TEST_F(SurfacesTest, AreLimitedWhileTheyArrive) {
  START_SURFACES();
  TestPeer peer(server());
  peer.join();
  v1::ClientMessage message;
  v1::SurfaceUpdate& update = *message.mutable_surface();
  v1::SurfacePart& part = *update.mutable_part();
  part.set_count(20);
  for (int i = 0; i < 3 * 5'000; ++i) part.add_triangles(0);
  for (std::uint32_t index = 0; index < 10; ++index) {
    part.set_index(index);
    peer.send(message);
  }
  part.set_index(10);
  const v1::Error error = refused(peer, message);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), StartsWith("surface.id = 0: 55000 triangles"));
  // The parts that follow get no error of their own, and another mesh begins.
  part.clear_triangles();
  for (std::uint32_t index = 11; index < 20; ++index) {
    part.set_index(index);
    peer.send(message);
  }
  sendAll(peer, partsOf(2, model::flat(1, 1), 10, 0));
  awaitSurfaces(peer, "small", 1);
  part.set_index(3);
  EXPECT_THAT(refused(peer, message).text(),
              StartsWith("surface.part.index = 3 of 20, surface 0: must be 0;"));
}

// All participants wait for one thread that makes surfaces.
TEST_F(SurfacesTest, AreLimitedInTrianglesPerSecond) {
  START_SURFACES();
  TestPeer peer(server());
  peer.join();
  v1::ClientMessage message;
  v1::SurfacePart& part = *message.mutable_surface()->mutable_part();
  part.set_count(1);
  for (int i = 0; i < 3 * 20'000; ++i) part.add_triangles(0);
  // The room for 300,000 at once, and for 150,000 more in each second, ends within 3 s.
  for (int mesh = 0; mesh < 40; ++mesh) peer.send(message);
  v1::Error error = refused(peer);
  // Meshes that were accepted have no vertices, which is found later.
  while (error.code() == v1::ERROR_CODE_INVALID_ARGUMENT) error = refused(peer);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RATE_LIMITED);
  EXPECT_THAT(error.text(), StartsWith("surface.id = 0: too many triangles in a short time"));
}

TEST_F(SurfacesTest, UseTheMemoryOfUploads) {
  hosting::ServerOptions options;
  options.maxUploadBytes = options.maxUploadBytesOfAddress = 1'000;
  START_SURFACES(options);
  TestPeer peer(server());
  peer.join();
  const v1::Error error = refused(peer, partsOf(1, model::flat(1, 1, 8), 200, 0)[0]);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), HasSubstr("--max-upload-memory"));
  // Refused meshes leave nothing behind.
  sendAll(peer, partsOf(1, model::flat(1, 1), 10, 0));
  awaitSurfaces(peer, "small", 1);
}

TEST_F(SurfacesTest, AreRefusedBeyondTheBudget) {
  scene::BudgetLimits budget = kNoLimits;
  budget.sceneMegabytes = budget.megabytes = 20;  // less than the buffers for surfaces
  START_SURFACES({}, {}, budget);
  TestPeer peer(server());
  peer.join();
  sendAll(peer, partsOf(1, model::flat(1, 1), 10, 0));
  const v1::Error error = refused(peer);
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), AllOf(HasSubstr("surface.id = 1: would take"), HasSubstr("--max-memory")));
}

}  // namespace
}  // namespace clothstream::session

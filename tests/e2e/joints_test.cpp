// SPDX-License-Identifier: MIT
// A client moves a joint of a collider that is a mesh, and every other client sees the mesh and the cloth
// move.
#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "clients/websocket/web_socket_transport.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/meshes/skinned_glb.h"

namespace clothstream::e2e {
namespace {

using ::testing::HasSubstr;

// The view of a client: the front of the block, in the block's frame, and the sheet.
struct Seen {
  float front = 0, farthest = 0;  // m, along z
  std::uint64_t mismatches = 0, errors = 0;
};

Seen look(NativeClient& client) {
  Seen seen;
  client.visit([&](cs_client* core) {
    std::uint32_t vertices = 0, indices = 0;
    const std::uint32_t* triangles = nullptr;
    const float* corners = cs_get_hull(core, 0, &vertices, &triangles, &indices);
    for (std::uint32_t i = 0; i < vertices; ++i) seen.front = std::max(seen.front, corners[3 * i + 2]);
    const float* positions = cs_positions(core);
    for (std::uint32_t i = 0; i < cs_vertex_count(core); ++i)
      seen.farthest = std::max(seen.farthest, positions[3 * i + 2]);
    cs_statistics statistics;
    cs_get_statistics(core, NativeClient::nowUs(), &statistics);
    seen.mismatches = statistics.hash_mismatches;
    seen.errors = statistics.decode_errors;
  });
  return seen;
}

class MovedJoints : public RunningServer {
 protected:
  void SetUp() override { startServer({"--scene", "arm", "--scene-file", "tests/e2e/arm.json"}); }

  std::unique_ptr<NativeClient> watch(bool web) const {
    NativeClientOptions options;
    options.joinTimeout = kPatience;
    const std::string& address = web ? web_ : address_;
    auto joined =
        NativeClient::join(address, web ? makeWebSocketTransport(address) : makeGrpcTransport(address),
                           options, [](cs_client*, std::uint32_t) {});
    if (!joined) throw std::runtime_error(joined.error().text);
    return std::move(*joined);
  }
  // Runs `clothstream join --input` with these lines until the test ends it.
  std::unique_ptr<Process> move(const std::string& lines) const {
    const auto path = directory_.path() / "lines";
    std::ofstream(path) << lines;
    return std::make_unique<Process>(
        std::vector<std::string>{CLOTHSTREAM, "join", address_, "--events", "--input", path});
  }

  TemporaryDirectory directory_;
};

std::string lineWith(float z, float after) {
  return R"({"after": )" + std::to_string(after) +
         R"(, "joints": [{"collider": "block", "poses": [[0, 0, 0, 0, 0, 0, 1], [0, 0, )" +
         std::to_string(z) + ", 0, 0, 0, 1]]}]}\n";
}

TEST_F(MovedJoints, MoveTheMeshAndTheClothForEveryClient) {
  if (IsSkipped()) return;
  std::vector<std::unique_ptr<NativeClient>> watchers;
  watchers.push_back(watch(false));
  watchers.push_back(watch(true));
  for (const auto& watcher : watchers) {
    EXPECT_FLOAT_EQ(look(*watcher).front, 0.1f);
    EXPECT_LT(look(*watcher).farthest, 0.01f);
  }
  const auto mover = move(lineWith(0.1f, 0) + lineWith(0.25f, 0.1f) + lineWith(0.4f, 0.1f));
  // The front is 0.5 m from the middle of the block, which is 0.3 m behind the sheet.
  for (const auto& watcher : watchers)
    EXPECT_TRUE(eventually([&] {
      const Seen seen = look(*watcher);
      return std::abs(seen.front - 0.5f) < 1e-5f && seen.farthest > 0.19f;
    })) << "front "
        << look(*watcher).front << ", sheet " << look(*watcher).farthest << "\n"
        << mover->errors();
  // A client that comes later sees the joints where they are.
  const auto late = watch(true);
  EXPECT_TRUE(eventually([&] { return std::abs(look(*late).front - 0.5f) < 1e-5f; }));
  for (const auto& watcher : watchers) {
    EXPECT_EQ(look(*watcher).mismatches, 0u);
    EXPECT_EQ(look(*watcher).errors, 0u);
  }
}

// The rod of the file is 0.4 m long and bends by 90 degrees.
TEST_F(MovedJoints, ComeFromTheAnimationOfAFileThatIsCreatedAsAScene) {
  if (IsSkipped()) return;
  std::ofstream(directory_.path() / "rod.glb", std::ios::binary) << meshes::SkinnedGlb().bytes();
  const auto scene = directory_.path() / "avatar.json";
  std::ofstream(scene) << R"({"name": "avatar",
    "cloths": [{"name": "sheet", "grid": {"rows": 5, "columns": 5, "width": 0.2, "height": 0.2}}],
    "colliders": [{"name": "rod", "mesh": {"file": "rod.glb", "animation": "bend"}}]})";
  // The server does not have the file, so the scene is sent with what the file holds.
  Process refused({CLOTHSTREAM, "create", scene, "--server", address_});
  EXPECT_NE(refused.waitForEnd(kPatience), 0);
  EXPECT_THAT(refused.errors(), HasSubstr("the collider 'rod' refers to the mesh file rod.glb"));
  Process print({CLOTHSTREAM_SERVER, "print-scene", scene});
  ASSERT_EQ(print.waitForEnd(kPatience), 0) << print.errors();
  const auto whole = directory_.path() / "whole.json";
  std::ofstream(whole) << print.output();
  Process create({CLOTHSTREAM, "create", whole, "--server", address_});
  ASSERT_EQ(create.waitForEnd(kPatience), 0) << create.errors();
  NativeClientOptions options;
  options.scene = "avatar";
  options.joinTimeout = kPatience;
  auto joined =
      NativeClient::join(web_, makeWebSocketTransport(web_), options, [](cs_client*, std::uint32_t) {});
  ASSERT_TRUE(joined) << joined.error().text;
  const auto vertexOf = [&](std::uint32_t number) {
    std::vector<float> place;
    (*joined)->visit([&](cs_client* core) {
      std::uint32_t vertices = 0, indices = 0;
      const std::uint32_t* triangles = nullptr;
      const float* corners = cs_get_hull(core, 0, &vertices, &triangles, &indices);
      ASSERT_GT(vertices, number);
      place.assign(corners + 3 * number, corners + 3 * number + 3);
    });
    return place;
  };
  const std::vector<float> start = vertexOf(1);
  ASSERT_THAT(start, ::testing::SizeIs(3));
  EXPECT_TRUE(eventually([&] {
    const std::vector<float> now = vertexOf(1);
    return std::hypot(now[0] - start[0], now[1] - start[1], now[2] - start[2]) > 0.05;
  }));
}

TEST_F(MovedJoints, AreRefusedForAnUnknownColliderWithTheKnownNames) {
  if (IsSkipped()) return;
  const auto mover = move(R"({"joints": [{"collider": "leg", "poses": []}]})"
                          "\n");
  EXPECT_TRUE(mover->waitForOutput("must be one of block", kPatience)) << mover->output() << mover->errors();
}

class WornBody : public MovedJoints {
 protected:
  void SetUp() override { startServer({"--scene", "walker"}); }

  // Distance from a point of the scene to the nearest vertex of the avatar, m.
  static double distanceTo(NativeClient& client, const std::array<double, 3>& point) {
    double nearest = 1e9;
    client.visit([&](cs_client* core) {
      cs_collider avatar;
      std::uint32_t vertices = 0, indices = 0;
      const std::uint32_t* triangles = nullptr;
      if (cs_get_collider(core, 0, &avatar) == 0) return;
      const float* corners = cs_get_hull(core, 0, &vertices, &triangles, &indices);
      const double x = avatar.orientation[0], y = avatar.orientation[1], z = avatar.orientation[2],
                   w = avatar.orientation[3];
      // The point in the frame of the collider: turned by the inverse rotation.
      std::array<double, 3> p{};
      for (std::size_t i = 0; i < 3; ++i) p[i] = point[i] - static_cast<double>(avatar.position[i]);
      const std::array<double, 3> q{
          (1 - 2 * (y * y + z * z)) * p[0] + 2 * (x * y + w * z) * p[1] + 2 * (x * z - w * y) * p[2],
          2 * (x * y - w * z) * p[0] + (1 - 2 * (x * x + z * z)) * p[1] + 2 * (y * z + w * x) * p[2],
          2 * (x * z + w * y) * p[0] + 2 * (y * z - w * x) * p[1] + (1 - 2 * (x * x + y * y)) * p[2]};
      for (std::uint32_t i = 0; i < vertices; ++i)
        nearest = std::min(nearest, std::hypot(static_cast<double>(corners[3 * i]) - q[0],
                                               static_cast<double>(corners[3 * i + 1]) - q[1],
                                               static_cast<double>(corners[3 * i + 2]) - q[2]));
    });
    return nearest;
  }
  // The client has heard: names of the worn bodies, and the newest error.
  static std::string wornIn(NativeClient& client) {
    std::string worn;
    client.visit([&](cs_client* core) {
      cs_participant one;
      for (std::uint32_t i = 0; cs_get_participant(core, i, &one) != 0; ++i) worn += cs_body_of(core, one.id);
    });
    return worn;
  }
};

// The right hand of a person at z = 2 is 0.38 m from the shoulder. The radius of the avatar's arm is below 5
// cm.
TEST_F(WornBody, FollowsItsWearerAndNoOtherClient) {
  if (IsSkipped()) return;
  constexpr std::array kHand{0.3, 1.15, 1.75};
  const auto watcher = watch(true);
  EXPECT_GT(distanceTo(*watcher, kHand), 0.2) << "the avatar walks around the origin";
  const auto wearer = move(R"({"wear": "avatar", "body": {"head": {"position": [0, 1.55, 2]}, )"
                           R"("rightHand": {"position": [0.3, 1.15, 1.75]}}})"
                           "\n");
  EXPECT_TRUE(eventually([&] { return wornIn(*watcher) == "avatar"; })) << wearer->errors();
  EXPECT_TRUE(eventually([&] { return distanceTo(*watcher, kHand) < 0.07; }))
      << distanceTo(*watcher, kHand) << "\n"
      << wearer->errors();
  watcher->visit([](cs_client* core) {
    const std::vector<float> still(7 * 13, 0.0f);
    cs_move_joints(core, "avatar", still.data(), 13, 1, NativeClient::nowUs());
  });
  EXPECT_TRUE(eventually([&] {
    std::string error;
    watcher->visit([&](cs_client* core) { error = cs_error_text(core); });
    return error.find("wears it, so only that participant moves it") != std::string::npos;
  }));
  EXPECT_LT(distanceTo(*watcher, kHand), 0.07) << "it does not move";
  wearer->signal(SIGTERM);
  EXPECT_TRUE(eventually([&] { return wornIn(*watcher).empty(); }));
}

TEST_F(WornBody, IsRefusedWithTheNamesOfOthers) {
  if (IsSkipped()) return;
  const auto wearer = move("{\"wear\": \"floor\"}\n");
  EXPECT_TRUE(wearer->waitForEnd(kPatience).has_value());
  EXPECT_THAT(wearer->errors(), HasSubstr("line 1: wear: \"floor\" is not a body of the scene; use avatar"));
}

}  // namespace
}  // namespace clothstream::e2e

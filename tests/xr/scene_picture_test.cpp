// SPDX-License-Identifier: MIT
// Pictures of a built-in scene from a running server.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <utility>

#include <clothstream/clothstream.h>
#include <gtest/gtest.h>

#include "clients/xr/stage/solids.h"
#include "clients/xr/stage/stage_reader.h"
#include "clients/xr/visit/visit.h"
#include "tests/e2e/server_process.h"
#include "tests/xr/allocations.h"
#include "tests/xr/drawn.h"
#include "tests/xr/hand_samples.h"

namespace clothstream::xr {
namespace {

using clothstream::tests::ServerProcess;
using tests::Drawn;
using tests::look;

constexpr auto kPatience = std::chrono::seconds(30);

// A client in the scene, and its stage.
class Spectator {
 public:
  Spectator(const std::string& address, const char* name, TextPainter& painter) : reader_(painter) {
    clothstream_options options;
    clothstream_default_options(&options);
    options.display_name = name;
    if (clothstream_open(address.c_str(), &options, &stream_) != CLOTHSTREAM_OK)
      throw std::runtime_error(clothstream_error_text());
    act([](cs_client* client) {
      cs_play_out_options playOut;
      cs_default_play_out(&playOut);
      EXPECT_EQ(cs_set_play_out(client, &playOut), 1);
    });
  }
  ~Spectator() { clothstream_close(stream_); }
  Spectator(const Spectator&) = delete;
  Spectator& operator=(const Spectator&) = delete;

  void act(const std::function<void(cs_client*)>& action) {
    action(clothstream_acquire(stream_));
    clothstream_release(stream_);
  }
  // Reads the stage of this moment.
  void read(std::uint32_t events) {
    cs_client* client = clothstream_acquire(stream_);
    const std::uint64_t now = clothstream_now_us();
    EXPECT_EQ(cs_play_out(client, now, now, nullptr), 1);
    reader_.read(client, events, false, stage_);
    clothstream_release(stream_);
  }
  // Reads stages until one is as wanted.
  bool readUntil(const std::function<bool(const Stage&)>& isWanted) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    std::uint32_t events = 0;
    while (std::chrono::steady_clock::now() < end) {
      std::uint32_t some = 0;
      if (clothstream_wait(stream_, 100, &some) != CLOTHSTREAM_OK) return false;
      events |= some;
      read(std::exchange(events, 0));
      if (isWanted(stage_)) return true;
    }
    return false;
  }
  Stage& stage() { return stage_; }

 private:
  StageReader reader_;
  clothstream_stream* stream_ = nullptr;
  Stage stage_;
};

class ScenePictureTest : public testing::Test {
 protected:
  // Drivers compile shaders once per device.
  static void SetUpTestSuite() {
    tests::countAllocationsOfLibrary();
    device_ = std::make_unique<tests::Device>();
  }
  static void TearDownTestSuite() { device_.reset(); }
  void SetUp() override {
    if (!device_->get()) GTEST_SKIP() << "no Vulkan device: " << device_->why();
  }
  std::string address() { return "127.0.0.1:" + std::to_string(server_.portIn(server_.lineWith("page"))); }

  static inline std::unique_ptr<tests::Device> device_;
  ServerProcess server_{{"--port", "0", "--grpc-port", "0", "--scene", "solver_mass_spring"}};
  TextPainter painter_;
};

bool hasMoved(const Stage& stage) {
  float most = 0;
  for (std::size_t i = 2; i < stage.positions.size(); i += 3)
    most = std::max(most, std::abs(stage.positions[i]));
  return stage.topology != 0 && most > 0;
}

TEST_F(ScenePictureTest, ClothCoversThePixelsOfItsVertices) {
  Spectator spectator(address(), "viewer", painter_);
  ASSERT_TRUE(spectator.readUntil(hasMoved));
  Stage& stage = spectator.stage();
  EXPECT_EQ(stage.clothNodeCount, 1024U);
  stage.solids.clear();  // so that every vertex is seen, from the one side or the other
  constexpr std::uint32_t kSize = 320;
  Drawn drawn(device_->graphics(), kSize, 1);
  const Eigen::Vector3f eye = stage.centre + stage.radius * Eigen::Vector3f(0.6f, 1.9f, 1.4f);
  const std::array<View, 1> view{look(eye, stage.centre)};
  drawn.draw(stage, view);
  if (const char* folder = std::getenv("CLOTHSTREAM_XR_PICTURES"))
    writePng(std::filesystem::path(folder) / "scene.png", drawn.target().size(), drawn.target().pixels());
  const std::vector<std::uint8_t> full = drawn.pixels();
  std::size_t seen = 0, covered = 0, inFront = 0, all = 0;
  std::vector<std::size_t> places;
  for (std::uint32_t node = 0; node < stage.clothNodeCount; ++node) {
    const auto place = drawn.placeOf(Eigen::Map<const Eigen::Vector3f>(&stage.positions[3 * node]), view[0]);
    ASSERT_TRUE(place) << "the camera does not see the whole cloth";
    ++all;
    const float depth = drawn.depthAt(place->x, place->y);
    seen += std::abs(depth - place->depth) < 2e-3f;
    inFront += depth < place->depth + 2e-3f;
    places.push_back(std::size_t{kSize} * place->y + place->x);
  }
  stage.parts.clear();
  drawn.draw(stage, view);
  const std::vector<std::uint8_t> empty = drawn.pixels();
  for (const std::size_t at : places)
    covered += !std::equal(&full[4 * at], &full[4 * at + 3], &empty[4 * at]);
  // Vertices on the edge can be just outside of the pixels that the cloth covers.
  EXPECT_GT(covered, all * 93 / 100);
  EXPECT_GT(inFront, all * 93 / 100);
  EXPECT_GT(seen, all * 60 / 100);  // folds hide the others
}

TEST_F(ScenePictureTest, OthersHaveHeadHandAndName) {
  const std::string server = address();
  Spectator spectator(server, "viewer", painter_);
  Spectator other(server, "Ada", painter_);
  other.act([](cs_client* client) {
    const std::array<float, 3> head{0.4f, 1.7f, 1.2f};
    const std::array<float, 4> turned{0, 0.7071068f, 0, 0.7071068f};
    cs_set_head(client, head.data(), turned.data(), 0.11f, clothstream_now_us());
    cs_own_collider ball{};
    ball.shape = CS_SHAPE_SPHERE;
    std::ranges::copy(std::array{0.1f, 1.2f, 1.3f}, ball.position);
    ball.radius = 0.045f;
    EXPECT_EQ(cs_set_colliders(client, &ball, 1, clothstream_now_us()), 1);
  });
  ASSERT_TRUE(spectator.readUntil([](const Stage& stage) { return !stage.labels.empty(); }));
  const Stage& stage = spectator.stage();
  // The name is 16 cm above the head.
  const auto head = std::ranges::find_if(stage.solids, [](const Solid& solid) {
    return (solid.pose.position - Eigen::Vector3f(0.4f, 1.7f, 1.2f)).norm() < 1e-3f;
  });
  ASSERT_NE(head, stage.solids.end());
  EXPECT_NEAR(stage.labels[0].position.y(), 1.7f + head->radius + 0.16f, 1e-3f);
  EXPECT_EQ(stage.labels[0].picture->width, painter_.label("Ada", {})->width);
  // Head, visor and ball have the colour of the participant, except for the visor.
  const Colour colour = colourOf(stage.labels[0].id);
  EXPECT_GE(std::ranges::count_if(stage.solids, [&](const Solid& solid) { return solid.colour == colour; }),
            2);
  EXPECT_EQ(std::ranges::count_if(stage.solids, [](const Solid& solid) { return solid.stretch.y() < 1; }), 1);
}

TEST_F(ScenePictureTest, ReadsFramesWithoutAllocationAfterWarmUp) {
  Spectator spectator(address(), "viewer", painter_);
  ASSERT_TRUE(spectator.readUntil(hasMoved));
  for (int i = 0; i < 5; ++i) spectator.read(0);
  const tests::Allocations counted;
  for (int i = 0; i < 200; ++i) spectator.read(0);
  EXPECT_EQ(counted.count(), 0U);
  EXPECT_EQ(counted.ofLibrary(), 0U);
}

// Whole frames of a user with two hands: input, touch, panel, stage and the recording of the picture. Facts
// and figures of the panel change four times a second. libclothstream allocates when it writes messages with
// poses, which is not counted. It takes 2 seconds.
TEST_F(ScenePictureTest, FramesAllocateNothingAfterWarmUp) {
  ConnectionOptions options;
  options.address = address();
  Visit visit(options, painter_);
  Drawn drawn(device_->graphics(), 64, 1);
  const std::array<View, 1> view{look({0, 1.5f, 3}, {0, 1, 0})};
  InputSample sample;
  sample.hasHead = true;
  sample.head.position = {0, 1.6f, 1};
  std::uint32_t pictures = 0;
  std::uint64_t revision = 0;
  const auto frame = [&] {
    const float phase = 1e-6f * static_cast<float>(clothstream_now_us() % 1'000'000'000);
    giveHand(sample.limbs[0], {-0.2f, 1.2f + 0.1f * std::sin(phase), 0.6f}, 0.1f);
    giveHand(sample.limbs[1], {0.2f, 1.2f + 0.1f * std::cos(phase), 0.6f}, 0.1f);
    const std::uint64_t now = clothstream_now_us();
    visit.frame(sample, now, now + 16'667);
    drawn.draw(visit.stage(), view);
    const Picture* const panel = visit.stage().panel.picture;
    if (panel != nullptr && panel->revision != std::exchange(revision, panel->revision)) ++pictures;
  };
  const auto showPictures = [&](std::uint32_t count) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    pictures = 0;
    while (pictures < count && std::chrono::steady_clock::now() < end) frame();
    return pictures >= count;
  };
  while (visit.stage().topology == 0) ASSERT_TRUE(showPictures(1));
  ASSERT_TRUE(showPictures(4));
  const tests::Allocations counted;
  EXPECT_TRUE(showPictures(3));
  EXPECT_EQ(counted.count(), 0U);
  EXPECT_EQ(visit.connection().phase(), Phase::live);
}

}  // namespace
}  // namespace clothstream::xr

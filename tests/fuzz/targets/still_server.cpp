// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/still_server.h"

#include <memory>
#include <string>

#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/stream_layout.h"
#include "server/hosting/scene_server.h"
#include "server/scene/frame_source.h"

namespace clothstream::fuzz {
namespace {

constexpr std::uint32_t kMaxParticipants = 4;

// Played scene that never publishes a frame. It makes a server without a device.
class StillSource final : public scene::FrameSource {
 public:
  StillSource() {
    description_.set_scene("played");
    description_.set_codec(codec::kCodecHierarchical);
    description_.set_simulation_rate(40);
    description_.set_stream_rate(40);
    description_.set_max_error(0.001f);
    v1::ClothDescription& cloth = *description_.add_cloths();
    cloth.set_name("sheet");
    cloth.set_vertex_count(4);
    cloth.set_rows(2);
    cloth.set_columns(2);
    cloth.set_rest_positions(std::string(4 * 3 * sizeof(float), '\0'));
  }

  const v1::StreamDescription& description() const override { return description_; }
  std::string deviceName() const override { return "none"; }
  void begin(scene::LiveScene& /*scene*/) override {}
  void end() override {}
  void wake() override {}
  messages::Result<void> control(const v1::ControlSceneRequest& /*request*/) override { return {}; }
  std::string whyFixed() const override { return "stands still"; }
  std::optional<v1::Playback> playback() const override { return v1::Playback(); }
  v1::ParameterChange parameters() const override { return {}; }

 private:
  v1::StreamDescription description_;
};

}  // namespace

hosting::SceneServer& stillServer() {
  static hosting::SceneServer server("played", std::make_shared<StillSource>(), [] {
    spdlog::set_level(spdlog::level::off);
    hosting::ServerOptions options;
    options.maxParticipants = kMaxParticipants;
    options.maxSceneNodes = 16'384;
    options.encoderThreads = 1;
    options.outsideControl = false;
    return options;
  }());
  static const bool hasSpeed = [] {
    server.budget->setSpeed({.nodeStepSeconds = 1e-8, .dispatchSeconds = 2e-5, .workgroupFactor = 4});
    return true;
  }();
  static_cast<void>(hasSpeed);
  return server;
}

}  // namespace clothstream::fuzz

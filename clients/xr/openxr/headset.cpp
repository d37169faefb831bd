// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/headset.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <spdlog/spdlog.h>

#include "clients/xr/render/own_device.h"

namespace clothstream::xr {
namespace {

constexpr std::uint32_t kEyes = 2;
constexpr float kNear = 0.05f, kFar = 100;  // m
constexpr auto kStereo = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;

std::vector<XrEnvironmentBlendMode> blendModes(const Instance& instance) {
  std::uint32_t count = 0;
  check(xrEnumerateEnvironmentBlendModes(instance.get(), instance.system(), kStereo, 0, &count, nullptr),
        "xrEnumerateEnvironmentBlendModes");
  std::vector<XrEnvironmentBlendMode> modes(count);
  check(xrEnumerateEnvironmentBlendModes(instance.get(), instance.system(), kStereo, count, &count,
                                         modes.data()),
        "xrEnumerateEnvironmentBlendModes");
  return modes;
}

// Size of the picture of each eye.
VkExtent2D pictureSize(const Instance& instance, float scale) {
  std::uint32_t count = 0;
  check(xrEnumerateViewConfigurationViews(instance.get(), instance.system(), kStereo, 0, &count, nullptr),
        "xrEnumerateViewConfigurationViews");
  std::vector<XrViewConfigurationView> views(count,
                                             typed<XrViewConfigurationView>(XR_TYPE_VIEW_CONFIGURATION_VIEW));
  check(xrEnumerateViewConfigurationViews(instance.get(), instance.system(), kStereo, count, &count,
                                          views.data()),
        "xrEnumerateViewConfigurationViews");
  if (count != kEyes)
    throw std::runtime_error("The headset has " + std::to_string(count) + " views; this program needs 2");
  const auto scaled = [&](std::uint32_t recommended, std::uint32_t most) {
    const float wanted = std::round(static_cast<float>(recommended) * scale);
    return std::clamp(static_cast<std::uint32_t>(wanted), 16U, std::max(most, 16U));
  };
  VkExtent2D size{};
  for (const XrViewConfigurationView& view : views) {
    size.width = std::max(size.width, scaled(view.recommendedImageRectWidth, view.maxImageRectWidth));
    size.height = std::max(size.height, scaled(view.recommendedImageRectHeight, view.maxImageRectHeight));
  }
  return size;
}

Eigen::Matrix4f matrixOf(const Pose& pose) {
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix.topLeftCorner<3, 3>() = pose.orientation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = pose.position;
  return matrix;
}

// Time that the processor has spent on this thread, without waiting.
std::uint64_t threadCpuUs() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000 +
         static_cast<std::uint64_t>(time.tv_nsec) / 1000;
}

}  // namespace

Headset::Headset(const HeadsetOptions& options, Visit& visit)
    : options_(options),
      visit_(visit),
      graphics_(instance_, instance_.extensions().foveation && options.foveation != FoveationLevel::kOff),
      session_(instance_, graphics_),
      room_(instance_, session_.get()),
      actions_(instance_, session_.get()),
      hands_(instance_, session_.get()),
      refreshRate_(instance_, session_.get(), options.refreshRate) {
  spdlog::info("{} shows {}", instance_.runtimeName(), instance_.systemName());
  const std::vector<XrEnvironmentBlendMode> modes = blendModes(instance_);
  blending_ = chooseBlending(modes, instance_.passesThrough(), options.passThrough);
  if (blending_.usesLayer) {
    try {
      passThrough_ = std::make_unique<PassThroughLayer>(instance_, session_.get());
    } catch (const XrError& error) {
      spdlog::warn("{}", error.what());
      blending_ = chooseBlending(modes, false, options.passThrough);
    }
  }
  if (options.passThrough && blending_.background == Background::kRoom) {
    spdlog::warn("This headset cannot show the real room");
    visit.say("This headset cannot show the real room", clothstream_now_us());
  }
  visit.setBackground(blending_.background);
  if (instance_.extensions().convertTime)
    convertTime_ =
        functionOf<PFN_xrConvertTimeToTimespecTimeKHR>(instance_.get(), "xrConvertTimeToTimespecTimeKHR");
  makePictures();
}

Headset::~Headset() {
  vkDeviceWaitIdle(graphics_.device().device);
  // Frames that are in flight refer to all of these.
  commands_.reset();
  pictures_.reset();
  renderer_.reset();
}

void Headset::makePictures() {
  const GraphicsDevice& device = graphics_.device();
  constexpr std::array<VkFormat, 4> kColours{VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_SRGB,
                                             VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_B8G8R8A8_UNORM};
  const VkFormat colour = chooseFormat(session_.get(), kColours);
  if (colour == VK_FORMAT_UNDEFINED)
    throw std::runtime_error("The OpenXR runtime offers no format with 8 bits of red, green, blue and alpha");
  const VkExtent2D size = pictureSize(instance_, options_.scale);
  commands_ = std::make_unique<FrameCommands>(device);
  makeColour(colour, size);
  RendererOptions renderer;
  if (instance_.extensions().depthLayer) {
    constexpr std::array<VkFormat, 2> kDepths{VK_FORMAT_D32_SFLOAT, VK_FORMAT_D16_UNORM};
    const VkFormat depth = chooseFormat(session_.get(), kDepths);
    if (depth != VK_FORMAT_UNDEFINED) {
      depth_ = std::make_unique<Swapchain>(
          session_.get(), device.device,
          Swapchain::Shape{depth, VK_IMAGE_ASPECT_DEPTH_BIT, XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT,
                           size, kEyes});
      renderer.depth = depth;
    }
  }
  renderer.colour = colour;
  renderer.samples = samplesOf(device.physical, options_.samples);
  renderer.views = kEyes;
  renderer.shadows = options_.shadows;
  renderer.largest = size;
  renderer.hasDensity = colour_->shape().hasDensity;
  renderer_ = std::make_unique<Renderer>(device, renderer);
  if (!options_.eyePictures.empty())
    pictures_ = std::make_unique<EyePictures>(device, colour_->shape(), options_.eyePictures);
  spdlog::info("Each eye has {} x {} pixels with {} samples{}{}{}", size.width, size.height,
               static_cast<std::uint32_t>(renderer.samples),
               renderer.hasDensity ? ", fewer at the edges" : "",
               depth_ ? ", and the runtime gets their depth" : "",
               blending_.background == Background::kRoom ? "" : "; the real room is behind");
}

// Makes the images, with density maps where the runtime gives them.
void Headset::makeColour(VkFormat format, VkExtent2D size) {
  Swapchain::Shape shape{format,
                         VK_IMAGE_ASPECT_COLOR_BIT,
                         XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_SAMPLED_BIT,
                         size,
                         kEyes,
                         graphics_.hasDensity()};
  if (!options_.eyePictures.empty()) shape.usage |= XR_SWAPCHAIN_USAGE_TRANSFER_SRC_BIT;
  if (shape.hasDensity) {
    try {
      colour_ = std::make_unique<Swapchain>(session_.get(), graphics_.device().device, shape);
      colour_->recordDensityLayout(commands_->begin());
      commands_->submit();
      commands_->finish();
      foveate(instance_, session_.get(), colour_->get(), options_.foveation);
      return;
    } catch (const XrError& error) {
      spdlog::warn("The headset does not foveate: {}", error.what());
      shape.hasDensity = false;
    }
  }
  colour_ = std::make_unique<Swapchain>(session_.get(), graphics_.device().device, shape);
}

HeadsetStep Headset::step() {
  const SessionChanges changes = session_.poll();
  if (changes.restarts) return HeadsetStep::restarts;
  if (changes.exits) return HeadsetStep::exits;
  if (changes.profilesChanged) actions_.profilesChanged();
  if (changes.originMoves) originMoves_ = changes.originMoves;
  if (changes.floorMoves) floorMoves_ = changes.floorMoves;
  if (session_.isRunning()) {
    frame();
  } else {
    visit_.hidden(clothstream_now_us());
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return HeadsetStep::runs;
}

void Headset::frame() {
  const auto wait = typed<XrFrameWaitInfo>(XR_TYPE_FRAME_WAIT_INFO);
  auto state = typed<XrFrameState>(XR_TYPE_FRAME_STATE);
  check(xrWaitFrame(session_.get(), &wait, &state), "xrWaitFrame");
  const std::uint64_t beginUs = clothstream_now_us(), beginCpuUs = threadCpuUs();
  const auto begin = typed<XrFrameBeginInfo>(XR_TYPE_FRAME_BEGIN_INFO);
  check(xrBeginFrame(session_.get(), &begin), "xrBeginFrame");
  const XrTime time = state.predictedDisplayTime;
  moveRoom(time);
  bool isDrawn = false;
  if (state.shouldRender == XR_TRUE) {
    sample_.hasHead = locate(room_.view(), room_.get(), time, sample_.head);
    actions_.read(room_.get(), time, sample_.limbs);
    if (session_.hasFocus()) {
      hands_.read(room_.get(), time, sample_.limbs);
    } else {
      for (LimbSample& limb : sample_.limbs) limb.hasHand = false;
    }
    if (std::exchange(recenters_, false) || actions_.recenters()) visit_.recenter();
    visit_.frame(sample_, beginUs, displayUs(state, beginUs));
    for (const Pulse& pulse : visit_.pulses()) actions_.vibrate(pulse);
    isDrawn = locateViews(time);
    if (isDrawn) draw();
  } else {
    visit_.hidden(beginUs);
  }
  end(state, isDrawn);
  if (isDrawn) visit_.addFrameTime(clothstream_now_us(), threadCpuUs() - beginCpuUs);
  refreshRate_.suit(visit_.streamRate());
}

void Headset::moveRoom(XrTime time) {
  if (originMoves_ && time >= *originMoves_) {
    spdlog::info("The headset was recentred");
    originMoves_.reset();
    recenters_ = true;
    room_.changed();
  }
  if (floorMoves_ && time >= *floorMoves_) {
    floorMoves_.reset();
    room_.changed();
  }
  room_.update(time);
}

std::uint64_t Headset::displayUs(const XrFrameState& state, std::uint64_t nowUs) {
  timespec time{};
  if (convertTime_ && XR_SUCCEEDED(convertTime_(instance_.get(), state.predictedDisplayTime, &time)))
    return DisplayClock::convertedUs(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec, nowUs);
  return clock_.displayUs(state.predictedDisplayTime, state.predictedDisplayPeriod, nowUs);
}

bool Headset::locateViews(XrTime time) {
  auto info = typed<XrViewLocateInfo>(XR_TYPE_VIEW_LOCATE_INFO);
  info.viewConfigurationType = kStereo;
  info.displayTime = time;
  info.space = room_.get();
  auto state = typed<XrViewState>(XR_TYPE_VIEW_STATE);
  eyes_.fill(typed<XrView>(XR_TYPE_VIEW));
  std::uint32_t count = 0;
  check(xrLocateViews(session_.get(), &info, &state, kEyes, &count, eyes_.data()), "xrLocateViews");
  constexpr XrViewStateFlags kBoth = XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;
  if ((state.viewStateFlags & kBoth) != kBoth || count != kEyes) return false;
  for (std::size_t i = 0; i < kEyes; ++i) {
    const XrFovf& fov = eyes_[i].fov;
    views_[i].view = matrixOf(inverse(visit_.toScene() * poseOf(eyes_[i].pose)));
    views_[i].projection = projectionOf(std::tan(fov.angleLeft), std::tan(fov.angleRight),
                                        std::tan(fov.angleUp), std::tan(fov.angleDown), kNear, kFar);
  }
  return true;
}

void Headset::draw() {
  const Stage& stage = visit_.stage();
  if (stage.topology != topology_) {
    renderer_->upload(stage);
    topology_ = stage.topology;
  }
  colour_->acquire();
  if (depth_) depth_->acquire();
  const VkCommandBuffer commands = commands_->begin();
  const Target target{colour_->view(), depth_ ? depth_->view() : VK_NULL_HANDLE, colour_->shape().size,
                      colour_->density()};
  renderer_->record(commands, target, views_, stage);
  const bool isKept = pictures_ && frames_ % options_.pictureEvery == 0;
  if (isKept) pictures_->record(commands, colour_->image());
  commands_->submit();
  if (isKept) {
    commands_->finish();
    pictures_->write(frames_);
  }
  colour_->release();
  if (depth_) depth_->release();
  ++frames_;
}

void Headset::end(const XrFrameState& state, bool isDrawn) {
  const VkExtent2D size = colour_->shape().size;
  const XrRect2Di all{{0, 0},
                      {static_cast<std::int32_t>(size.width), static_cast<std::int32_t>(size.height)}};
  for (std::uint32_t i = 0; i < kEyes && isDrawn; ++i) {
    shown_[i] = typed<XrCompositionLayerProjectionView>(XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW);
    shown_[i].pose = eyes_[i].pose;
    shown_[i].fov = eyes_[i].fov;
    shown_[i].subImage = {colour_->get(), all, i};
    if (!depth_) continue;
    shownDepth_[i] = typed<XrCompositionLayerDepthInfoKHR>(XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR);
    shownDepth_[i].subImage = {depth_->get(), all, i};
    shownDepth_[i].minDepth = 0;
    shownDepth_[i].maxDepth = 1;
    shownDepth_[i].nearZ = kNear;
    shownDepth_[i].farZ = kFar;
    shown_[i].next = &shownDepth_[i];
  }
  auto projection = typed<XrCompositionLayerProjection>(XR_TYPE_COMPOSITION_LAYER_PROJECTION);
  projection.space = room_.get();
  projection.viewCount = kEyes;
  projection.views = shown_.data();
  if (blending_.background == Background::kTransparent)
    projection.layerFlags = XR_COMPOSITION_LAYER_BLEND_TEXTURE_SOURCE_ALPHA_BIT;
  std::array<const XrCompositionLayerBaseHeader*, 2> layers{};
  std::uint32_t count = 0;
  if (isDrawn && passThrough_) layers[count++] = passThrough_->layer();
  if (isDrawn) layers[count++] = reinterpret_cast<const XrCompositionLayerBaseHeader*>(&projection);
  auto info = typed<XrFrameEndInfo>(XR_TYPE_FRAME_END_INFO);
  info.displayTime = state.predictedDisplayTime;
  info.environmentBlendMode = blending_.mode;
  info.layerCount = count;
  info.layers = layers.data();
  check(xrEndFrame(session_.get(), &info), "xrEndFrame");
}

}  // namespace clothstream::xr

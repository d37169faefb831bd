// SPDX-License-Identifier: MIT
#include "clients/xr/flat/flat.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clients/xr/flat/orbit.h"
#include "clients/xr/flat/window.h"
#include "clients/xr/render/frame_commands.h"
#include "clients/xr/render/offscreen.h"
#include "clients/xr/render/own_device.h"
#include "clients/xr/render/renderer.h"

namespace clothstream::xr {
namespace {

using Clock = std::chrono::steady_clock;

constexpr float kNear = 0.05F, kFar = 100;  // m
constexpr auto kFrameTime = std::chrono::microseconds(16'667);
// Longest time to wait for the scene before a picture is made without it.
constexpr auto kLongestWait = std::chrono::seconds(15);
// Time that the scene is shown before the first picture, so that the panel has everything.
constexpr auto kSettles = std::chrono::seconds(1);
constexpr std::size_t kWarmUp = 10;  // frames whose cost is not counted
// Place of the panel's upper edge before the camera, m: in the left upper corner, or in the middle for
// trouble.
constexpr float kPanelAway = 1.5F, kPanelEdge = 0.03F;
// A mouse is a controller behind the camera, where it touches no cloth.
const Eigen::Vector3f kGripPlace(0, -0.3F, 0.5F);

// Time of the processor that this thread has used.
double threadSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

Eigen::Matrix4f matrixOf(const Pose& pose) {
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix.topLeftCorner<3, 3>() = pose.orientation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = pose.position;
  return matrix;
}

// Processor time of the parts of a frame, ms.
struct Costs {
  std::vector<double> stage, drawing, whole;

  void add(double begin, double staged, double end) {
    stage.push_back(1e3 * (staged - begin));
    drawing.push_back(1e3 * (end - staged));
    whole.push_back(1e3 * (end - begin));
  }
  static double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
    return values[values.size() / 2];
  }
  static double percentile99(std::vector<double> values) {
    if (values.empty()) return 0;
    std::ranges::sort(values);
    return values[values.size() * 99 / 100];
  }
};

}  // namespace

struct Flat::Parts {
  Parts(const FlatOptions& flatOptions, Visit& shown);
  ~Parts();

  void makeRenderer(VkFormat format, VkExtent2D largestTarget);
  void upload();
  void readInput(const MouseInput& mouse, float aspect);
  void placeCamera(float aspect);
  // Makes the stage, and fills in the view.
  void makeStage(float aspect);
  bool isReady() const;
  bool stepWindow();
  bool stepPictures();
  void record(VkCommandBuffer commands, const Target& target);
  void count(double begin, double staged, double end);

  FlatOptions options;
  Visit& visit;
  std::unique_ptr<Window> window;  // null: pictures
  std::unique_ptr<OwnDevice> device;
  std::unique_ptr<Offscreen> offscreen;
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<FrameCommands> commands;
  Orbit camera;
  InputSample sample;
  View view;
  Costs costs;
  std::uint64_t uploaded = 0, aimedAt = 0;
  std::uint32_t frames = 0, pictures = 0;
  Pose aimedFrom;
  VkExtent2D largest{};  // of the renderer
  Clock::time_point start = Clock::now(), next = start, shownSince = start;
  MouseInput mouse;
  float windowAspect = 1;
};

Flat::Parts::Parts(const FlatOptions& flatOptions, Visit& shown) : options(flatOptions), visit(shown) {
  const VkExtent2D size{options.width, options.height};
  if (options.pictures.empty()) {
    const std::string reason = Window::unavailableBecause();
    if (reason.empty()) {
      window = std::make_unique<Window>("ClothStream", size);
    } else {
      options.pictures.assign(1, '.');
      spdlog::info("There is no window ({}); pictures are written to the present folder", reason);
    }
  }
  if (window) {
    constexpr std::array kExtensions{VK_KHR_SWAPCHAIN_EXTENSION_NAME};
    const std::vector<const char*> extensions = Window::instanceExtensions();
    device = std::make_unique<OwnDevice>(extensions, kExtensions);
    window->open(device->get());
    makeRenderer(window->format(), window->largest());
  } else {
    std::error_code error;
    std::filesystem::create_directories(options.pictures, error);
    if (error)
      throw std::runtime_error(
          fmt::format("--pictures: the folder {} cannot be made: {}", options.pictures, error.message()));
    device = std::make_unique<OwnDevice>(std::span<const char* const>(), std::span<const char* const>());
    offscreen = std::make_unique<Offscreen>(device->get(), size, 1);
    makeRenderer(VK_FORMAT_R8G8B8A8_SRGB, size);
    options.frames = std::max(1U, options.frames);
  }
  commands = std::make_unique<FrameCommands>(device->get());
  options.every = std::max(1U, options.every);
  spdlog::info("{} draws", device->name());
  // The first head stands before the scene; the camera follows when the scene is there.
  sample.hasHead = true;
  sample.head.position = {0, 1.6F, 0};
}

Flat::Parts::~Parts() {
  commands.reset();
  renderer.reset();
  offscreen.reset();
  if (window) window->close();
  device.reset();
}

void Flat::Parts::makeRenderer(VkFormat format, VkExtent2D largestTarget) {
  renderer.reset();
  largest = largestTarget;
  uploaded = 0;
  renderer = std::make_unique<Renderer>(
      device->get(), RendererOptions{.colour = format,
                                     .samples = samplesOf(device->get().physical, options.samples),
                                     .largest = largest,
                                     .shadows = options.shadows});
}

// The mouse as a controller with a ray.
void Flat::Parts::readInput(const MouseInput& input, float aspect) {
  LimbSample& limb = sample.limbs[indexOf(Side::right)];
  const Pose& head = sample.head;
  limb.hasController = limb.hasAim = true;
  limb.grip = {head.apply(kGripPlace), head.orientation};
  limb.aim = {head.position,
              head.orientation * Eigen::Quaternionf::FromTwoVectors(-Eigen::Vector3f::UnitZ(),
                                                                    Orbit::directionOf(input.place, aspect))};
  limb.trigger = input.left ? 1.0F : 0.0F;
  if (input.right || (input.left && !visit.isUsed(Side::right))) camera.turn(input.moved);
  if (input.middle) camera.pan(input.moved);
  if (input.scrolled != 0) camera.zoom(input.scrolled);
  if (input.resets) aimedAt = 0;
}

// Aims the camera at a new scene, or at one that stands elsewhere.
void Flat::Parts::placeCamera(float aspect) {
  const Stage& stage = visit.stage();
  const Pose& toScene = visit.toScene();
  const bool hasMoved = (toScene.position - aimedFrom.position).norm() > 1e-4F;
  if (stage.topology != 0 && (aimedAt != stage.topology || hasMoved)) {
    if (aimedAt == 0) shownSince = Clock::now();
    aimedAt = stage.topology;
    aimedFrom = toScene;
    camera.lookAt(inverse(toScene).apply(stage.centre), stage.radius, aspect);
  }
  if (aimedAt == 0) return;
  sample.head = camera.pose();
}

void Flat::Parts::makeStage(float aspect) {
  placeCamera(aspect);
  const float half = std::tan(Orbit::kHalfAngle);
  const bool hasTrouble = !visit.connection().trouble().title.empty();
  const float high = kPanelAway * half, wide = high * aspect;
  const float left = hasTrouble ? 0 : -wide + kPanelWidth / 2 + kPanelEdge;
  visit.setPanelPose(sample.head *
                     Pose{{left, high - kPanelEdge, -kPanelAway}, Eigen::Quaternionf::Identity()});
  const std::uint64_t now = clothstream_now_us();
  visit.frame(sample, now, now + static_cast<std::uint64_t>(kFrameTime.count()));
  if (!options.showsPanel) visit.hidePanel();
  view.view = matrixOf(inverse(visit.toScene() * sample.head));
  view.projection = projectionOf(-half * aspect, half * aspect, half, -half, kNear, kFar);
}

// Whether a picture shows what it should: the scene, or what is in its way.
bool Flat::Parts::isReady() const {
  const bool hasScene = visit.stage().topology != 0 && visit.connection().phase() == Phase::live &&
                        aimedAt != 0 && Clock::now() - shownSince > kSettles;
  return hasScene || visit.connection().phase() == Phase::refused || Clock::now() - start > kLongestWait;
}

void Flat::Parts::upload() {
  if (visit.stage().topology == uploaded) return;
  renderer->upload(visit.stage());
  uploaded = visit.stage().topology;
}

void Flat::Parts::record(VkCommandBuffer buffer, const Target& target) {
  renderer->record(buffer, target, {&view, 1}, visit.stage());
}

void Flat::Parts::count(double begin, double staged, double end) {
  ++frames;
  if (frames > kWarmUp) costs.add(begin, staged, end);
  visit.addFrameTime(clothstream_now_us(), static_cast<std::uint64_t>(1e6 * (end - begin)));
}

bool Flat::Parts::stepWindow() {
  if (!window->poll(mouse)) return false;
  readInput(mouse, windowAspect);
  const double begin = threadSeconds();
  makeStage(windowAspect);
  const double staged = threadSeconds();
  const VkCommandBuffer buffer = commands->begin();
  bool forgets = false;
  const Target target = window->acquire(commands->current(), forgets);
  if (forgets) renderer->forgetTargets();
  if (target.size.width > largest.width || target.size.height > largest.height)
    makeRenderer(window->format(), window->largest());
  upload();
  if (target.colour == VK_NULL_HANDLE) {
    commands->submit();
    std::this_thread::sleep_for(kFrameTime);
    return true;
  }
  windowAspect = static_cast<float>(target.size.width) / static_cast<float>(target.size.height);
  const double drawing = threadSeconds();
  record(buffer, target);
  window->recordPresent(buffer);
  commands->submit(window->available(commands->current()), window->drawn());
  window->present();
  count(begin, staged, staged + threadSeconds() - drawing);
  return (options.frames == 0 || frames < options.frames) && !visit.leaves();
}

bool Flat::Parts::stepPictures() {
  const float aspect = static_cast<float>(options.width) / static_cast<float>(options.height);
  next = std::max(next + kFrameTime, Clock::now());
  std::this_thread::sleep_until(next);
  const double begin = threadSeconds();
  makeStage(aspect);
  const double staged = threadSeconds();
  if (!isReady()) return !visit.leaves();
  upload();
  const VkCommandBuffer buffer = commands->begin();
  const double drawing = threadSeconds();
  record(buffer, offscreen->target());
  const double end = threadSeconds();
  const bool isKept = (frames + 1) % options.every == 0 || frames + 1 == options.frames;
  if (isKept) offscreen->recordRead(buffer);
  commands->submit();
  count(begin, staged, staged + end - drawing);
  if (isKept) {
    commands->finish();
    const std::filesystem::path file =
        std::filesystem::path(options.pictures) / fmt::format("flat_{:04}.png", ++pictures);
    writePng(file, offscreen->size(), offscreen->pixels());
    spdlog::info("Wrote {}", file.string());
  }
  return frames < options.frames && !visit.leaves();
}

Flat::Flat(const FlatOptions& options, Visit& visit) : parts_(std::make_unique<Parts>(options, visit)) {}
Flat::~Flat() = default;

bool Flat::step() {
  return parts_->window ? parts_->stepWindow() : parts_->stepPictures();
}

std::string Flat::summary() const {
  const Costs& costs = parts_->costs;
  if (costs.whole.empty()) return fmt::format("{} frames", parts_->frames);
  return fmt::format(
      "{} frames of {} vertices. Processor time of a frame: median {:.3f} ms (stage {:.3f}, drawing {:.3f}), "
      "99 % below {:.3f} ms",
      parts_->frames, parts_->visit.stage().clothNodeCount, Costs::median(costs.whole),
      Costs::median(costs.stage), Costs::median(costs.drawing), Costs::percentile99(costs.whole));
}

}  // namespace clothstream::xr

// SPDX-License-Identifier: MIT
// A window of GLFW with a swapchain, and its mouse.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "clients/xr/render/handle.h"
#include "clients/xr/render/renderer.h"

struct GLFWwindow;

namespace clothstream::xr {

// Input of the user since the last call of Window::poll().
struct MouseInput {
  Eigen::Vector2f place = Eigen::Vector2f::Zero();  // in the window: -1 to 1, to the right and up
  Eigen::Vector2f moved =
      Eigen::Vector2f::Zero();  // as parts of the height of the window, to the right and up
  float scrolled = 0;           // steps, away from the user
  bool left = false, right = false, middle = false;
  bool resets = false;  // a key asks for the first view
};

class Window {
 public:
  // Starts GLFW. Returns why there can be no window, such as a missing display; "" if there can.
  static std::string unavailableBecause();
  static std::vector<const char*> instanceExtensions();

  Window(const std::string& title, VkExtent2D size);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  // Connects the window with the device, which must outlive this connection. Throws std::runtime_error.
  void open(const GraphicsDevice& device);
  // Ends the connection. Call before the device is destroyed.
  void close();
  VkFormat format() const { return format_; }
  // Largest size of targets. It grows if the window becomes larger than all screens.
  VkExtent2D largest() const { return largest_; }

  // Reads the mouse. Returns false if the window is to be closed.
  bool poll(MouseInput& input);
  // Next image to draw to; its size is 0 while the window is minimised. Waits for the display. `forgets` is
  // set when the image views of earlier targets are gone.
  Target acquire(std::size_t frame, bool& forgets);
  VkSemaphore available(std::size_t frame) const { return available_[frame].get(); }
  VkSemaphore drawn() const { return drawn_[image_].get(); }
  // Records the change of the drawn image to one that is displayed.
  void recordPresent(VkCommandBuffer commands) const;
  void present();

 private:
  void makeSwapchain();
  void remake(bool& forgets);

  GLFWwindow* window_ = nullptr;
  GraphicsDevice device_;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkFormat format_ = VK_FORMAT_UNDEFINED;
  VkColorSpaceKHR space_ = VK_COLOR_SPACE_SRGB_NONLINEAR_KHR;
  VkExtent2D size_{}, largest_{};
  Owned<VkSwapchainKHR> swapchain_;
  std::vector<VkImage> images_;
  std::vector<Owned<VkImageView>> views_;
  std::vector<Owned<VkSemaphore>> available_, drawn_;  // per frame in flight; per image
  std::uint32_t image_ = 0;
  bool isStale_ = false;
  Eigen::Vector2f cursor_ = Eigen::Vector2f::Zero();
  bool hasCursor_ = false;
};

}  // namespace clothstream::xr

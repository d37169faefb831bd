// SPDX-License-Identifier: MIT
#include "clients/xr/flat/window.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace clothstream::xr {
namespace {

float scrolled = 0;  // since the last poll; GLFW calls back on the thread that polls

std::string glfwError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown error";
}

Owned<VkSemaphore> semaphore(VkDevice device) {
  VkSemaphoreCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
  VkSemaphore semaphore = VK_NULL_HANDLE;
  check(vkCreateSemaphore(device, &info, nullptr, &semaphore), "vkCreateSemaphore");
  return {device, semaphore, vkDestroySemaphore};
}

}  // namespace

std::string Window::unavailableBecause() {
  if (glfwInit() != GLFW_TRUE) return glfwError();
  if (glfwVulkanSupported() != GLFW_TRUE) return "this display has no Vulkan";
  return "";
}

std::vector<const char*> Window::instanceExtensions() {
  std::uint32_t count = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&count);
  if (names == nullptr) throw std::runtime_error("GLFW: " + glfwError());
  return {names, names + count};
}

Window::Window(const std::string& title, VkExtent2D size) {
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  window_ = glfwCreateWindow(static_cast<int>(size.width), static_cast<int>(size.height), title.c_str(),
                             nullptr, nullptr);
  if (window_ == nullptr) throw std::runtime_error("GLFW cannot open a window: " + glfwError());
  glfwSetScrollCallback(window_,
                        [](GLFWwindow*, double, double steps) { scrolled += static_cast<float>(steps); });
}

Window::~Window() {
  close();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::open(const GraphicsDevice& device) {
  device_ = device;
  check(glfwCreateWindowSurface(device.instance, window_, nullptr, &surface_), "glfwCreateWindowSurface");
  VkBool32 isSupported = VK_FALSE;
  check(vkGetPhysicalDeviceSurfaceSupportKHR(device.physical, device.queueFamily, surface_, &isSupported),
        "vkGetPhysicalDeviceSurfaceSupportKHR");
  if (isSupported == VK_FALSE)
    throw std::runtime_error("the graphics device cannot show pictures in this window");
  std::uint32_t count = 0;
  check(vkGetPhysicalDeviceSurfaceFormatsKHR(device.physical, surface_, &count, nullptr), "surface formats");
  std::vector<VkSurfaceFormatKHR> formats(count);
  check(vkGetPhysicalDeviceSurfaceFormatsKHR(device.physical, surface_, &count, formats.data()),
        "surface formats");
  for (const VkFormat wanted :
       {VK_FORMAT_B8G8R8A8_SRGB, VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_UNORM, VK_FORMAT_R8G8B8A8_UNORM})
    for (const VkSurfaceFormatKHR& offered : formats)
      if (format_ == VK_FORMAT_UNDEFINED && offered.format == wanted) {
        format_ = wanted;
        space_ = offered.colorSpace;
      }
  if (format_ == VK_FORMAT_UNDEFINED)
    throw std::runtime_error("the window has no format with 8 bits per colour");
  for (std::uint32_t i = 0; i < kFramesInFlight; ++i) available_.push_back(semaphore(device.device));
  // The window can grow to the size of the largest screen without a new renderer.
  int monitors = 0;
  GLFWmonitor** all = glfwGetMonitors(&monitors);
  for (int i = 0; i < monitors; ++i)
    if (const GLFWvidmode* mode = glfwGetVideoMode(all[i])) {
      largest_.width = std::max(largest_.width, static_cast<std::uint32_t>(mode->width));
      largest_.height = std::max(largest_.height, static_cast<std::uint32_t>(mode->height));
    }
  makeSwapchain();
}

void Window::close() {
  if (surface_ == VK_NULL_HANDLE) return;
  vkDeviceWaitIdle(device_.device);
  views_.clear();
  available_.clear();
  drawn_.clear();
  swapchain_.reset();
  vkDestroySurfaceKHR(device_.instance, surface_, nullptr);
  surface_ = VK_NULL_HANDLE;
}

void Window::makeSwapchain() {
  VkSurfaceCapabilitiesKHR can{};
  check(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_.physical, surface_, &can), "surface capabilities");
  size_ = can.currentExtent;
  if (size_.width == UINT32_MAX) {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    size_ = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
  }
  largest_ = {std::max(largest_.width, size_.width), std::max(largest_.height, size_.height)};
  if (size_.width == 0 || size_.height == 0) return;
  VkSwapchainCreateInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR;
  info.surface = surface_;
  info.minImageCount = std::max(can.minImageCount, 3U);
  if (can.maxImageCount != 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
  info.imageFormat = format_;
  info.imageColorSpace = space_;
  info.imageExtent = size_;
  info.imageArrayLayers = 1;
  info.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  info.preTransform = can.currentTransform;
  info.compositeAlpha = (can.supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR) != 0
                            ? VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                            : VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
  info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
  info.clipped = VK_TRUE;
  info.oldSwapchain = swapchain_.get();
  VkSwapchainKHR swapchain = VK_NULL_HANDLE;
  check(vkCreateSwapchainKHR(device_.device, &info, nullptr, &swapchain), "vkCreateSwapchainKHR");
  swapchain_ = {device_.device, swapchain, vkDestroySwapchainKHR};
  std::uint32_t count = 0;
  check(vkGetSwapchainImagesKHR(device_.device, swapchain, &count, nullptr), "vkGetSwapchainImagesKHR");
  images_.resize(count);
  check(vkGetSwapchainImagesKHR(device_.device, swapchain, &count, images_.data()),
        "vkGetSwapchainImagesKHR");
  drawn_.clear();
  for (VkImage image : images_) {
    VkImageViewCreateInfo viewInfo{};
    viewInfo.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
    viewInfo.image = image;
    viewInfo.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
    viewInfo.format = format_;
    viewInfo.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageView view = VK_NULL_HANDLE;
    check(vkCreateImageView(device_.device, &viewInfo, nullptr, &view), "vkCreateImageView");
    views_.emplace_back(device_.device, view, vkDestroyImageView);
    drawn_.push_back(semaphore(device_.device));
  }
}

void Window::remake(bool& forgets) {
  check(vkDeviceWaitIdle(device_.device), "vkDeviceWaitIdle");
  views_.clear();
  forgets = true;
  makeSwapchain();
  isStale_ = false;
}

bool Window::poll(MouseInput& input) {
  scrolled = 0;
  glfwPollEvents();
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  double x = 0, y = 0;
  glfwGetCursorPos(window_, &x, &y);
  const Eigen::Vector2f size(static_cast<float>(std::max(width, 1)), static_cast<float>(std::max(height, 1)));
  const Eigen::Vector2f cursor(static_cast<float>(x), static_cast<float>(y));
  input.place = {2 * cursor.x() / size.x() - 1, 1 - 2 * cursor.y() / size.y()};
  const Eigen::Vector2f moved = hasCursor_ ? Eigen::Vector2f(cursor - cursor_) : Eigen::Vector2f::Zero();
  input.moved = Eigen::Vector2f(moved.x(), -moved.y()) / size.y();
  cursor_ = cursor;
  hasCursor_ = true;
  input.scrolled = scrolled;
  const auto isDown = [&](int button) { return glfwGetMouseButton(window_, button) == GLFW_PRESS; };
  input.left = isDown(GLFW_MOUSE_BUTTON_LEFT);
  input.right = isDown(GLFW_MOUSE_BUTTON_RIGHT);
  input.middle = isDown(GLFW_MOUSE_BUTTON_MIDDLE);
  input.resets = glfwGetKey(window_, GLFW_KEY_HOME) == GLFW_PRESS;
  return glfwWindowShouldClose(window_) == GLFW_FALSE && glfwGetKey(window_, GLFW_KEY_ESCAPE) != GLFW_PRESS;
}

Target Window::acquire(std::size_t frame, bool& forgets) {
  forgets = false;
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (isStale_) remake(forgets);
    if (size_.width == 0 || size_.height == 0) {
      isStale_ = true;  // minimised: look again in the next frame
      return {};
    }
    const VkResult result = vkAcquireNextImageKHR(device_.device, swapchain_.get(), UINT64_MAX,
                                                  available_[frame].get(), VK_NULL_HANDLE, &image_);
    if (result != VK_ERROR_OUT_OF_DATE_KHR) {
      check(result, "vkAcquireNextImageKHR");
      isStale_ = result == VK_SUBOPTIMAL_KHR;
      return {views_[image_].get(), VK_NULL_HANDLE, size_};
    }
    isStale_ = true;
  }
  return {};
}

void Window::recordPresent(VkCommandBuffer commands) const {
  VkImageMemoryBarrier change{};
  change.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  change.srcAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
  change.oldLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  change.newLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  change.image = images_[image_];
  change.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                       VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, 0, 0, nullptr, 0, nullptr, 1, &change);
}

void Window::present() {
  const VkSemaphore wait = drawn_[image_].get();
  const VkSwapchainKHR swapchain = swapchain_.get();
  VkPresentInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
  info.waitSemaphoreCount = 1;
  info.pWaitSemaphores = &wait;
  info.swapchainCount = 1;
  info.pSwapchains = &swapchain;
  info.pImageIndices = &image_;
  const VkResult result = vkQueuePresentKHR(device_.queue, &info);
  if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR)
    isStale_ = true;
  else
    check(result, "vkQueuePresentKHR");
}

}  // namespace clothstream::xr

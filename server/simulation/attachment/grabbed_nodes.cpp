// SPDX-License-Identifier: MIT
// Nodes that grabs hold, and the reports of the grabs, on the device.
#include "server/simulation/attachment/grabbed_nodes.h"

#include <algorithm>

#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::size_t kReportBytes = kMaxGrabs * sizeof(shared::GrabReport);

// Reports and nodes in a buffer that has both.
std::span<shared::GrabReport> reportsIn(const Buffer& both) {
  return both.mapped<shared::GrabReport>().first(kMaxGrabs);
}
std::span<shared::GrabbedNode> nodesIn(const Buffer& both) {
  return both.mapped<shared::GrabbedNode>().subspan(kReportBytes / sizeof(shared::GrabbedNode));
}

}  // namespace

GrabStatus statusOf(const shared::GrabReport& report) {
  return {report.grabbed, report.slipped, {report.offset.x, report.offset.y, report.offset.z}};
}

HeldNodes heldNodes(std::span<const shared::GrabbedNode> nodes, std::span<const shared::GrabReport> reports) {
  HeldNodes held;
  for (const shared::GrabReport& report : reports) held.grabs.push_back(statusOf(report));
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const shared::GrabbedNode& node = nodes[i];
    if (node.grabber < 1 || node.grabber > static_cast<float>(reports.size())) continue;
    held.nodes.push_back({.node = i,
                          .grab = static_cast<std::uint32_t>(node.grabber) - 1,
                          .place = {node.place.x, node.place.y, node.place.z}});
  }
  return held;
}

void setHeldNodes(const HeldNodes& held, std::span<shared::GrabbedNode> nodes,
                  std::span<shared::GrabReport> reports) {
  std::ranges::fill(nodes, shared::GrabbedNode{});
  for (const HeldNode& node : held.nodes)
    nodes[node.node] = {.place = vectorOf(node.place), .grabber = static_cast<float>(node.grab + 1)};
  for (std::size_t i = 0; i < held.grabs.size(); ++i)
    reports[i] = {.nearest = 0,
                  .grabbed = held.grabs[i].taken,
                  .slipped = held.grabs[i].slipped,
                  .reserved0 = 0,
                  .offset = vectorOf(held.grabs[i].offset),
                  .reserved1 = 0};
}

GrabbedNodes::GrabbedNodes(const vulkan::Device& device, std::uint32_t nodeCount)
    : device_(device),
      nodes_(device, BufferPurpose::state, nodeCount * sizeof(shared::GrabbedNode)),
      reports_(device, BufferPurpose::state, kReportBytes),
      reportReadbacks_{Buffer(device, BufferPurpose::readback, kReportBytes),
                       Buffer(device, BufferPurpose::readback, kReportBytes)} {}

void GrabbedNodes::recordClear(vulkan::Recorder& recorder) const {
  recorder.fill(nodes_, 0, nodes_.bytes());
  recorder.fill(reports_, 0, reports_.bytes());
}

void GrabbedNodes::recordBegin(vulkan::Recorder& recorder, std::size_t grab) const {
  const std::size_t report = grab * sizeof(shared::GrabReport);
  recorder.fill(reports_, ~0u, sizeof(shared::uint32_t), report + offsetof(shared::GrabReport, nearest));
  recorder.fill(reports_, 0, sizeof(shared::GrabReport) - offsetof(shared::GrabReport, grabbed),
                report + offsetof(shared::GrabReport, grabbed));
}

void GrabbedNodes::recordReport(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t grabs) const {
  if (grabs > 0) recorder.copy(reports_, reportReadbacks_[slot], grabs * sizeof(shared::GrabReport));
}

std::span<const shared::GrabReport> GrabbedNodes::report(std::uint32_t slot, std::uint32_t grabs) const {
  return reportReadbacks_[slot].mapped<const shared::GrabReport>().first(grabs);
}

void GrabbedNodes::recordSave(vulkan::Recorder& recorder, std::uint32_t grabs) {
  savedGrabs_ = grabs;
  if (grabs == 0) return;
  if (readback_.bytes() == 0)
    readback_ = Buffer(device_, BufferPurpose::readback, kReportBytes + nodes_.bytes());
  recorder.copy(nodes_, readback_, nodes_.bytes(), 0, kReportBytes);
  recorder.copy(reports_, readback_, grabs * sizeof(shared::GrabReport));
}

HeldNodes GrabbedNodes::collect() const {
  if (savedGrabs_ == 0) return {};
  return heldNodes(nodesIn(readback_), reportsIn(readback_).first(savedGrabs_));
}

void GrabbedNodes::recordRestore(vulkan::Recorder& recorder, const HeldNodes& held) {
  if (held.grabs.empty()) {
    recorder.fill(nodes_, 0, nodes_.bytes());
    return;
  }
  if (upload_.bytes() == 0) upload_ = Buffer(device_, BufferPurpose::upload, kReportBytes + nodes_.bytes());
  setHeldNodes(held, nodesIn(upload_), reportsIn(upload_));
  recorder.copy(upload_, nodes_, nodes_.bytes(), kReportBytes);
  recorder.copy(upload_, reports_, held.grabs.size() * sizeof(shared::GrabReport));
}

}  // namespace clothstream::simulation

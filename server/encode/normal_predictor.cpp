// SPDX-License-Identifier: MIT
// Prediction of normals on the device.
#include "server/encode/normal_predictor.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include "kernels/predict_normals.h"
#include "server/encode/normal_tables.h"

namespace clothstream::encode {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::uint32_t kNormalsWorkgroup = 64;

}  // namespace

NormalPredictor::NormalPredictor(const vulkan::Device& device, const codec::StreamLayout& layout,
                                 const codec::hierarchical::Hierarchy& hierarchy, const Buffer& normals,
                                 const std::array<Buffer, 2>& moments, const Buffer& sent) {
  const NormalTables tables = makeNormalTables(layout, hierarchy);
  const auto faces = std::as_bytes(std::span(tables.faces));
  const auto facesOf = std::as_bytes(std::span(tables.facesOf));
  // Bindings need a buffer even without faces.
  faces_ = Buffer(device, BufferPurpose::state, std::max(faces.size(), sizeof tables.faces[0]));
  facesOf_ = Buffer(device, BufferPurpose::state, facesOf.size());
  upload_ = Buffer(device, BufferPurpose::upload, faces_.bytes() + facesOf_.bytes());
  std::ranges::copy(faces, upload_.mapped().begin());
  std::ranges::copy(facesOf, upload_.mapped().subspan(faces_.bytes()).begin());
  for (Buffer& residuals : residuals_)
    residuals = Buffer(device, BufferPurpose::readback, layout.vertexCount() * sizeof(std::uint32_t));
  const vulkan::Kernel kernel(device, kernels::predict_normals, kNormalsWorkgroup);
  for (const Buffer& moment : moments) {
    for (const Buffer& residuals : residuals_)
      bindings_.emplace_back(
          device, kernel,
          std::initializer_list<const Buffer*>{&normals, &moment, &faces_, &facesOf_, &sent, &residuals});
  }
}

void NormalPredictor::recordTables(vulkan::Recorder& recorder) const {
  recorder.copy(upload_, faces_, faces_.bytes());
  recorder.copy(upload_, facesOf_, facesOf_.bytes(), faces_.bytes());
}

void NormalPredictor::record(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t moment,
                             const shared::PredictPush& push) const {
  recorder.dispatch(bindings_[kFrameSlots * moment + slot], push, push.vertexCount);
}

}  // namespace clothstream::encode

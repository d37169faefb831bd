// SPDX-License-Identifier: MIT
// Other libraries' codecs for the positions of a frame, at the same largest error.
#include "tests/bench/peers/peer_codecs.h"

#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#pragma GCC diagnostic pop
#include <meshoptimizer.h>
#include <zstd.h>

namespace clothstream::bench {
namespace {

class DracoMesh final : public PeerCodec {
 public:
  DracoMesh(std::uint32_t rows, std::uint32_t columns, const PeerLattice& lattice) : lattice_(lattice) {
    const std::uint32_t vertices = rows * columns;
    mesh_.set_num_points(vertices);
    for (std::uint32_t row = 0; row + 1 < rows; ++row)
      for (std::uint32_t column = 0; column + 1 < columns; ++column) {
        const std::uint32_t a = row * columns + column, e = a + columns;
        addFace(a, e, a + 1);
        addFace(a + 1, e, e + 1);
      }
    draco::GeometryAttribute position;
    position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
    positionId_ = mesh_.AddAttribute(position, true, vertices);
  }

  const char* name() const override { return "Draco edgebreaker, speed 5"; }

  std::vector<std::byte> encode(std::span<const float> positions) override {
    draco::PointAttribute* attribute = mesh_.attribute(positionId_);
    for (std::uint32_t i = 0; i < positions.size() / 3; ++i)
      attribute->SetAttributeValue(draco::AttributeValueIndex(i), &positions[3 * i]);
    draco::Encoder encoder;
    encoder.SetSpeedOptions(5, 5);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetAttributeExplicitQuantization(draco::GeometryAttribute::POSITION, lattice_.bits, 3,
                                             lattice_.origin,
                                             lattice_.step * static_cast<float>((1 << lattice_.bits) - 1));
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeMeshToBuffer(mesh_, &buffer).ok()) throw std::runtime_error("Draco does not encode");
    std::vector<std::byte> packet(buffer.size());
    std::memcpy(packet.data(), buffer.data(), buffer.size());
    return packet;
  }

  // In Draco's own order of vertices.
  void decode(std::span<const std::byte> packet, std::span<float> positions) override {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(packet.data()), packet.size());
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) throw std::runtime_error("Draco does not decode");
    const auto* attribute = mesh.value()->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    for (std::uint32_t i = 0; i < positions.size() / 3; ++i)
      attribute->GetMappedValue(draco::PointIndex(i), &positions[3 * i]);
  }

 private:
  void addFace(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.AddFace({draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
  }

  PeerLattice lattice_;
  draco::Mesh mesh_;
  int positionId_ = 0;
};

class MeshoptimizerDelta final : public PeerCodec {
 public:
  MeshoptimizerDelta(std::uint32_t vertices, const PeerLattice& lattice, bool zstd)
      : lattice_(lattice), zstd_(zstd), encoded_(vertices), decoded_(vertices), difference_(vertices) {}

  const char* name() const override {
    return zstd_ ? "meshoptimizer v0, temporal differences, zstd 3"
                 : "meshoptimizer v0, temporal differences";
  }

  std::vector<std::byte> encode(std::span<const float> positions) override {
    for (std::size_t i = 0; i < encoded_.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float place = (positions[3 * i + axis] - lattice_.origin[axis]) / lattice_.step;
        const auto value = static_cast<std::uint16_t>(std::lround(place));
        const auto delta = static_cast<std::int16_t>(value - encoded_[i][axis]);
        difference_[i][axis] = static_cast<std::uint16_t>((delta << 1) ^ (delta >> 15));
        encoded_[i][axis] = value;
      }
    std::vector<std::byte> packet(meshopt_encodeVertexBufferBound(encoded_.size(), sizeof(Vertex)));
    packet.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packet.data()), packet.size(),
                                             difference_.data(), encoded_.size(), sizeof(Vertex)));
    if (!zstd_) return packet;
    std::vector<std::byte> small(ZSTD_compressBound(packet.size()));
    small.resize(ZSTD_compress(small.data(), small.size(), packet.data(), packet.size(), 3));
    return small;
  }

  void decode(std::span<const std::byte> packet, std::span<float> positions) override {
    std::vector<std::byte> plain;
    if (zstd_) {
      plain.resize(ZSTD_getFrameContentSize(packet.data(), packet.size()));
      ZSTD_decompress(plain.data(), plain.size(), packet.data(), packet.size());
      packet = plain;
    }
    if (meshopt_decodeVertexBuffer(difference_.data(), decoded_.size(), sizeof(Vertex),
                                   reinterpret_cast<const unsigned char*>(packet.data()), packet.size()) != 0)
      throw std::runtime_error("meshoptimizer does not decode");
    for (std::size_t i = 0; i < decoded_.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint16_t zigzag = difference_[i][axis];
        decoded_[i][axis] = static_cast<std::uint16_t>(decoded_[i][axis] + ((zigzag >> 1) ^ -(zigzag & 1)));
        positions[3 * i + axis] = lattice_.origin[axis] + lattice_.step * decoded_[i][axis];
      }
  }

 private:
  using Vertex = std::array<std::uint16_t, 4>;  // the codec wants multiples of four bytes
  PeerLattice lattice_;
  bool zstd_;
  std::vector<Vertex> encoded_, decoded_, difference_;
};

}  // namespace

std::unique_ptr<PeerCodec> dracoMesh(std::uint32_t rows, std::uint32_t columns, const PeerLattice& lattice) {
  return std::make_unique<DracoMesh>(rows, columns, lattice);
}

std::unique_ptr<PeerCodec> meshoptimizerDelta(std::uint32_t vertices, const PeerLattice& lattice, bool zstd) {
  return std::make_unique<MeshoptimizerDelta>(vertices, lattice, zstd);
}

}  // namespace clothstream::bench

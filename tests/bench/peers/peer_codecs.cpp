// SPDX-License-Identifier: MIT
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
#include <fmt/format.h>
#include <meshoptimizer.h>
#include <zstd.h>

namespace clothstream::bench {
namespace {

// Half a step along each axis, and the rounding of coordinates of a few metres.
double promised(double maxError) {
  return std::sqrt(3.0) * maxError + 2e-6;
}

using LatticePoint = std::array<std::uint16_t, 3>;

class Lattice {
 public:
  explicit Lattice(double maxError) : step_(static_cast<float>(2 * maxError)) {}

  float step() const { return step_; }
  float origin() const { return -step_ * kMiddle; }

  LatticePoint point(const float* position) const {
    LatticePoint point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const long place = std::lround(double{position[axis]} / double{step_}) + kMiddle;
      if (place < 0 || place >= 2 * kMiddle)
        throw std::runtime_error(
            fmt::format("a coordinate of {} m is outside of the lattice", position[axis]));
      point[axis] = static_cast<std::uint16_t>(place);
    }
    return point;
  }
  void write(const LatticePoint& point, float* position) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      position[axis] = step_ * static_cast<float>(int{point[axis]} - kMiddle);
  }

 private:
  static constexpr int kMiddle = 1 << (kLatticeBits - 1);
  float step_;
};

std::uint16_t zigzag(std::uint16_t difference) {
  const auto d = static_cast<std::int16_t>(difference);
  return static_cast<std::uint16_t>((d << 1) ^ (d >> 15));
}

std::uint16_t fromZigzag(std::uint16_t number) {
  return static_cast<std::uint16_t>((number >> 1) ^ -(number & 1));
}

class Zstd {
 public:
  std::span<const std::byte> compress(std::span<const std::byte> plain) {
    packet_.resize(ZSTD_compressBound(plain.size()));
    const std::size_t bytes = ZSTD_compressCCtx(compressor_.get(), packet_.data(), packet_.size(),
                                                plain.data(), plain.size(), kLevel);
    if (ZSTD_isError(bytes) != 0) throw std::runtime_error("zstd cannot compress");
    return std::span(packet_).first(bytes);
  }
  std::span<const std::byte> decompress(std::span<const std::byte> packet) {
    plain_.resize(ZSTD_getFrameContentSize(packet.data(), packet.size()));
    const std::size_t bytes =
        ZSTD_decompressDCtx(decompressor_.get(), plain_.data(), plain_.size(), packet.data(), packet.size());
    if (bytes != plain_.size()) throw std::runtime_error("zstd cannot decompress");
    return plain_;
  }

 private:
  static constexpr int kLevel = 3;
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> compressor_{ZSTD_createCCtx(), &ZSTD_freeCCtx};
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> decompressor_{ZSTD_createDCtx(), &ZSTD_freeDCtx};
  std::vector<std::byte> packet_, plain_;
};

class RawFloats final : public FrameCodec {
 public:
  std::string name() const override { return "raw float32"; }
  double promise() const override { return 0; }
  std::span<const std::byte> encode(const TrueFrame& frame) override {
    const std::span<const std::byte> bytes = std::as_bytes(frame.positions);
    packet_.assign(bytes.begin(), bytes.end());
    return packet_;
  }
  std::span<const float> decode(std::span<const std::byte> packet) override {
    positions_.resize(packet.size() / sizeof(float));
    std::memcpy(positions_.data(), packet.data(), packet.size());
    return positions_;
  }

 private:
  std::vector<std::byte> packet_;
  std::vector<float> positions_;
};

class DracoMesh final : public FrameCodec {
 public:
  // speed: 0 (smallest) to 10.
  DracoMesh(const codec::ClothLayout& cloth, double maxError, int speed)
      : lattice_(maxError),
        maxError_(maxError),
        speed_(speed),
        numbers_(cloth.vertexCount),
        positions_(3 * numbers_.size()) {
    mesh_.set_num_points(cloth.vertexCount);
    const auto addFace = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      mesh_.AddFace({draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
    };
    for (std::size_t i = 0; i < cloth.triangles.size(); i += 3)
      addFace(cloth.triangles[i], cloth.triangles[i + 1], cloth.triangles[i + 2]);
    for (std::uint32_t row = 0; row + 1 < cloth.rows; ++row)
      for (std::uint32_t column = 0; column + 1 < cloth.columns; ++column) {
        const std::uint32_t a = row * cloth.columns + column, e = a + cloth.columns;
        addFace(a, e, a + 1);
        addFace(a + 1, e, e + 1);
      }
    draco::GeometryAttribute position;
    position.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
    positionId_ = mesh_.AddAttribute(position, true, cloth.vertexCount);
    learnOrder();
  }

  std::string name() const override { return fmt::format("Draco, speed {}", speed_); }
  double promise() const override { return promised(maxError_); }

  std::span<const std::byte> encode(const TrueFrame& frame) override {
    setPositions(frame.positions);
    encodeMesh(lattice_.origin(), lattice_.step());
    return std::as_bytes(std::span(buffer_.data(), buffer_.size()));
  }

  std::span<const float> decode(std::span<const std::byte> packet) override {
    const auto mesh = decodeMesh(packet);
    const auto* attribute = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    for (std::uint32_t i = 0; i < numbers_.size(); ++i)
      attribute->GetMappedValue(draco::PointIndex(i), &positions_[3 * std::size_t{numbers_[i]}]);
    return positions_;
  }

 private:
  void setPositions(std::span<const float> positions) {
    draco::PointAttribute* attribute = mesh_.attribute(positionId_);
    for (std::uint32_t i = 0; i < positions.size() / 3; ++i)
      attribute->SetAttributeValue(draco::AttributeValueIndex(i), &positions[3 * std::size_t{i}]);
  }

  void encodeMesh(float origin, float step) {
    const float origins[3]{origin, origin, origin};
    draco::Encoder encoder;
    encoder.SetSpeedOptions(speed_, speed_);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetAttributeExplicitQuantization(draco::GeometryAttribute::POSITION, kLatticeBits, 3, origins,
                                             step * static_cast<float>((1 << kLatticeBits) - 1));
    buffer_.Clear();
    if (!encoder.EncodeMeshToBuffer(mesh_, &buffer_).ok()) throw std::runtime_error("Draco cannot encode");
  }

  static std::unique_ptr<draco::Mesh> decodeMesh(std::span<const std::byte> packet) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(packet.data()), packet.size());
    draco::Decoder decoder;
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) throw std::runtime_error("Draco cannot decode");
    return std::move(mesh).value();
  }

  // Draco's order follows from the triangles alone. A frame whose positions are the vertices' numbers reveals
  // it.
  void learnOrder() {
    constexpr std::uint32_t kRow = 1 << 12;
    std::vector<float> places;
    for (std::uint32_t i = 0; i < numbers_.size(); ++i)
      places.insert(places.end(), {static_cast<float>(i % kRow), static_cast<float>(i / kRow), 0});
    setPositions(places);
    encodeMesh(0, 1);
    const auto mesh = decodeMesh(std::as_bytes(std::span(buffer_.data(), buffer_.size())));
    const auto* attribute = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    if (mesh->num_points() != numbers_.size())
      throw std::runtime_error("Draco changes the number of vertices");
    for (std::uint32_t i = 0; i < numbers_.size(); ++i) {
      std::array<float, 3> place{};
      attribute->GetMappedValue(draco::PointIndex(i), place.data());
      numbers_[i] = static_cast<std::uint32_t>(std::lround(place[0]) + kRow * std::lround(place[1]));
    }
  }

  Lattice lattice_;
  double maxError_;
  int speed_;
  draco::Mesh mesh_;
  int positionId_ = 0;
  draco::EncoderBuffer buffer_;
  std::vector<std::uint32_t> numbers_;  // our vertex numbers in Draco's order
  std::vector<float> positions_;
};

// Each frame alone, or its differences from the previous one.
enum class Prediction : std::uint8_t { intra, inter };

// Vertex codec version 0, followed by zstd.
class Meshoptimizer final : public FrameCodec {
 public:
  Meshoptimizer(std::uint32_t vertices, double maxError, Prediction prediction)
      : lattice_(maxError),
        maxError_(maxError),
        prediction_(prediction),
        encoded_(vertices),
        decoded_(vertices),
        sent_(vertices),
        positions_(3 * std::size_t{vertices}) {}

  std::string name() const override {
    return prediction_ == Prediction::intra ? "meshoptimizer, intra" : "meshoptimizer, inter";
  }
  double promise() const override { return promised(maxError_); }

  std::span<const std::byte> encode(const TrueFrame& frame) override {
    for (std::size_t i = 0; i < sent_.size(); ++i) {
      const LatticePoint point = lattice_.point(&frame.positions[3 * i]);
      for (std::size_t axis = 0; axis < 3; ++axis)
        sent_[i][axis] = prediction_ == Prediction::intra
                             ? point[axis]
                             : zigzag(static_cast<std::uint16_t>(point[axis] - encoded_[i][axis]));
      encoded_[i] = point;
    }
    packet_.resize(meshopt_encodeVertexBufferBound(sent_.size(), sizeof(Vertex)));
    packet_.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packet_.data()),
                                              packet_.size(), sent_.data(), sent_.size(), sizeof(Vertex)));
    return zstd_.compress(packet_);
  }

  std::span<const float> decode(std::span<const std::byte> packet) override {
    const std::span<const std::byte> plain = zstd_.decompress(packet);
    if (meshopt_decodeVertexBuffer(sent_.data(), sent_.size(), sizeof(Vertex),
                                   reinterpret_cast<const unsigned char*>(plain.data()), plain.size()) != 0)
      throw std::runtime_error("meshoptimizer cannot decode");
    for (std::size_t i = 0; i < sent_.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        decoded_[i][axis] = prediction_ == Prediction::intra
                                ? sent_[i][axis]
                                : static_cast<std::uint16_t>(decoded_[i][axis] + fromZigzag(sent_[i][axis]));
      lattice_.write(decoded_[i], &positions_[3 * i]);
    }
    return positions_;
  }

 private:
  using Vertex = std::array<std::uint16_t, 4>;  // the codec requires multiples of four bytes
  Lattice lattice_;
  double maxError_;
  Prediction prediction_;
  std::vector<LatticePoint> encoded_, decoded_;
  std::vector<Vertex> sent_;
  std::vector<std::byte> packet_;
  std::vector<float> positions_;
  Zstd zstd_;
};

// Differences from the previous frame; low and high bytes of each axis are in separate planes.
class ZstdPlanes final : public FrameCodec {
 public:
  ZstdPlanes(std::uint32_t vertices, double maxError)
      : lattice_(maxError),
        maxError_(maxError),
        encoded_(vertices),
        decoded_(vertices),
        planes_(6 * std::size_t{vertices}),
        positions_(3 * std::size_t{vertices}) {}

  std::string name() const override { return "zstd, delta planes"; }
  double promise() const override { return promised(maxError_); }

  std::span<const std::byte> encode(const TrueFrame& frame) override {
    for (std::size_t i = 0; i < encoded_.size(); ++i) {
      const LatticePoint point = lattice_.point(&frame.positions[3 * i]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::uint16_t number = zigzag(static_cast<std::uint16_t>(point[axis] - encoded_[i][axis]));
        planes_[axis * encoded_.size() + i] = static_cast<std::byte>(number & 255);
        planes_[(3 + axis) * encoded_.size() + i] = static_cast<std::byte>(number >> 8);
      }
      encoded_[i] = point;
    }
    return zstd_.compress(planes_);
  }

  std::span<const float> decode(std::span<const std::byte> packet) override {
    const std::span<const std::byte> planes = zstd_.decompress(packet);
    for (std::size_t i = 0; i < decoded_.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int low = std::to_integer<int>(planes[axis * decoded_.size() + i]);
        const int high = std::to_integer<int>(planes[(3 + axis) * decoded_.size() + i]);
        decoded_[i][axis] = static_cast<std::uint16_t>(
            decoded_[i][axis] + fromZigzag(static_cast<std::uint16_t>(low | high << 8)));
      }
      lattice_.write(decoded_[i], &positions_[3 * i]);
    }
    return positions_;
  }

 private:
  Lattice lattice_;
  double maxError_;
  std::vector<LatticePoint> encoded_, decoded_;
  std::vector<std::byte> planes_;
  std::vector<float> positions_;
  Zstd zstd_;
};

}  // namespace

std::vector<std::unique_ptr<FrameCodec>> peerCodecs(const codec::ClothLayout& cloth, double maxError) {
  std::vector<std::unique_ptr<FrameCodec>> peers;
  peers.push_back(std::make_unique<DracoMesh>(cloth, maxError, 0));
  peers.push_back(std::make_unique<Meshoptimizer>(cloth.vertexCount, maxError, Prediction::intra));
  peers.push_back(std::make_unique<Meshoptimizer>(cloth.vertexCount, maxError, Prediction::inter));
  peers.push_back(std::make_unique<ZstdPlanes>(cloth.vertexCount, maxError));
  return peers;
}

std::unique_ptr<FrameCodec> rawFloats() {
  return std::make_unique<RawFloats>();
}

}  // namespace clothstream::bench

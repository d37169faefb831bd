// SPDX-License-Identifier: MIT
#include "server/meshes/draco_mesh.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#include <draco/compression/attributes/prediction_schemes/mesh_prediction_scheme_data.h>
#include <draco/compression/attributes/prediction_schemes/mesh_prediction_scheme_tex_coords_decoder.h>
#include <draco/compression/attributes/prediction_schemes/mesh_prediction_scheme_tex_coords_portable_decoder.h>
#include <draco/compression/attributes/prediction_schemes/prediction_scheme_wrap_decoding_transform.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_edgebreaker_shared.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/corner_table.h>
#include <draco/mesh/mesh_attribute_corner_table.h>
#pragma GCC diagnostic pop

// How many orientations of texture coordinates a mesh states is the only number that Draco up to 1.5.7 does
// not bound: it reads as many bits as stated, up to 2^31, from a file of any size. The functions below are
// specialisations for the types that Draco uses. They are strong symbols, and those of its static library are
// weak, so the linker takes these. The test Draco.RefusesMoreOrientationsThanCorners fails if it does not.
namespace draco {
namespace {

using Wrap = PredictionSchemeWrapDecodingTransform<int, int>;
using Whole = MeshPredictionSchemeData<CornerTable>;                 // no seam
using Divided = MeshPredictionSchemeData<MeshAttributeCornerTable>;  // at seams of the attribute

// Each corner has one orientation at most.
template <typename Data, typename Predictor>
bool readOrientations(const Data& mesh, DecoderBuffer& buffer, Predictor& predictor) {
  std::int32_t count = 0;
  if (!buffer.Decode(&count) || count < 0 || count > mesh.corner_table()->num_corners()) return false;
  RAnsBitDecoder bits;
  if (!bits.StartDecoding(&buffer)) return false;
  predictor.ResizeOrientations(count);
  // A bit says whether an orientation is that of its predecessor.
  bool orientation = true;
  for (int i = 0; i < count; ++i) {
    if (!bits.DecodeNextBit()) orientation = !orientation;
    predictor.set_orientation(i, orientation);
  }
  bits.EndDecoding();
  return true;
}

}  // namespace

template <>
bool MeshPredictionSchemeTexCoordsPortableDecoder<int, Wrap, Whole>::DecodePredictionData(
    DecoderBuffer* buffer) {
  return readOrientations(mesh_data(), *buffer, predictor_) &&
         MeshPredictionSchemeDecoder<int, Wrap, Whole>::DecodePredictionData(buffer);
}

template <>
bool MeshPredictionSchemeTexCoordsPortableDecoder<int, Wrap, Divided>::DecodePredictionData(
    DecoderBuffer* buffer) {
  return readOrientations(mesh_data(), *buffer, predictor_) &&
         MeshPredictionSchemeDecoder<int, Wrap, Divided>::DecodePredictionData(buffer);
}

// Encoders do not write the older scheme any more.
template <>
bool MeshPredictionSchemeTexCoordsDecoder<int, Wrap, Whole>::DecodePredictionData(DecoderBuffer*) {
  return false;
}

template <>
bool MeshPredictionSchemeTexCoordsDecoder<int, Wrap, Divided>::DecodePredictionData(DecoderBuffer*) {
  return false;
}

}  // namespace draco

namespace clothstream::meshes {
namespace {

// Decoder of Draco that checks sizes before they are used. Draco calls its virtual functions in this order:
// InitializeDecoder(), DecodeConnectivity(), CreateAttributesDecoder() for each group of attributes, and
// DecodeAllAttributes() when it knows all attributes and has allocated no values.
template <typename Base>
class BoundedDecoder final : public Base {
 public:
  explicit BoundedDecoder(const DracoRequest& request) : request_(request) {}

  const std::string& problem() const { return problem_; }

 private:
  static constexpr bool kIsEdgebreaker = std::is_same_v<Base, draco::MeshEdgebreakerDecoder>;

  bool refuse(std::string text) {
    problem_ = std::move(text);
    return false;
  }

  bool InitializeDecoder() override {
    // glTF allows version 2.2 only. Older ones have other fields, and decoders for them that are little used.
    if (this->bitstream_version() != DRACO_BITSTREAM_VERSION(2, 2))
      return refuse(
          fmt::format("has version {}.{} of Draco, which is not supported: compress it with version 2.2",
                      this->bitstream_version() >> 8, this->bitstream_version() & 0xFF));
    if constexpr (kIsEdgebreaker) {
      std::uint8_t traversal = 0;
      draco::DecoderBuffer ahead = *this->buffer();
      if (!ahead.Decode(&traversal)) return false;
      if (traversal != draco::MESH_EDGEBREAKER_STANDARD_ENCODING &&
          traversal != draco::MESH_EDGEBREAKER_VALENCE_ENCODING)
        return refuse("has an unknown traversal");
    }
    return Base::InitializeDecoder();
  }

  bool DecodeConnectivity() override {
    draco::DecoderBuffer ahead = *this->buffer();
    std::uint32_t faces = 0, points = 0;
    if constexpr (kIsEdgebreaker) {
      // The number of vertices without seams; texture coordinates add points at seams, three per face at
      // most.
      if (!draco::DecodeVarint(&points, &ahead) || !draco::DecodeVarint(&faces, &ahead)) return false;
      std::uint8_t attributeTables = 0;
      if (!ahead.Decode(&attributeTables)) return false;
      if (attributeTables > kMaxDracoAttributes) return refuse(tooManyAttributes(attributeTables));
    } else {
      if (!draco::DecodeVarint(&faces, &ahead) || !draco::DecodeVarint(&points, &ahead)) return false;
    }
    if (faces > request_.maxFaces)
      return refuse(fmt::format("states {} faces; the file has {} outside of it", faces, request_.maxFaces));
    if (!checkPoints(points)) return false;
    // A decoder of Draco up to 1.5.5 allows more sides of faces than pairs of vertices. The product fits.
    if (kIsEdgebreaker && std::uint64_t{3} * faces > std::uint64_t{points} * (std::max(points, 1u) - 1))
      return refuse(fmt::format("states {} faces for {} vertices", faces, points));
    return Base::DecodeConnectivity() && checkPoints(this->mesh()->num_points());
  }

  bool CreateAttributesDecoder(std::int32_t group) override {
    return group < kMaxDracoAttributes ? Base::CreateAttributesDecoder(group)
                                       : refuse(tooManyAttributes(group + 1));
  }

  bool DecodeAllAttributes() override {
    const draco::Mesh& mesh = *this->mesh();
    if (mesh.num_attributes() > kMaxDracoAttributes) return refuse(tooManyAttributes(mesh.num_attributes()));
    std::int64_t bytes = 0, components = 0;
    for (int i = 0; i < mesh.num_attributes(); ++i) {
      bytes += mesh.attribute(i)->byte_stride();
      components += mesh.attribute(i)->num_components();
    }
    if (bytes > kMaxDracoPointBytes || components > kMaxDracoComponents)
      return refuse(
          fmt::format("has {} bytes in {} numbers for each point; at most {} bytes in {} numbers are allowed",
                      bytes, components, kMaxDracoPointBytes, kMaxDracoComponents));
    return Base::DecodeAllAttributes();
  }

  bool checkPoints(std::uint32_t points) {
    return points <= request_.maxPoints ||
           refuse(fmt::format("states {} points; the file has {} outside of it", points, request_.maxPoints));
  }

  static std::string tooManyAttributes(int count) {
    return fmt::format("has {} attributes; at most {} are allowed", count, kMaxDracoAttributes);
  }

  const DracoRequest& request_;
  std::string problem_;
};

// Reads an attribute of `count` floats per point, or of the first numbers of such a vector, and 0 for the
// others.
template <int count, typename Vector>
bool readAttribute(const draco::Mesh& mesh, std::uint32_t id, std::vector<Vector>& values,
                   std::size_t components = count) {
  const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(id);
  const bool isMapped = attribute != nullptr && !attribute->is_mapping_identity();
  if (attribute == nullptr || attribute->num_components() != static_cast<int>(components)) return false;
  if (isMapped && attribute->indices_map_size() < mesh.num_points()) return false;
  values.reserve(mesh.num_points());
  for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
    const draco::AttributeValueIndex at = attribute->mapped_index(i);
    Vector value = Vector::Zero();
    if (at.value() >= attribute->size() || !attribute->ConvertValue<float, count>(at, value.data()))
      return false;
    values.push_back(value);
  }
  return true;
}

template <typename Base>
tl::expected<DracoMesh, std::string> decodeWith(draco::DecoderBuffer& buffer, const DracoRequest& request) {
  BoundedDecoder<Base> decoder(request);
  draco::Mesh mesh;
  const draco::Status status = decoder.Decode(draco::DecoderOptions(), &buffer, &mesh);
  if (!decoder.problem().empty()) return tl::unexpected(decoder.problem());
  if (!status.ok()) return tl::unexpected(fmt::format("is broken: {}", status.error_msg_string()));
  DracoMesh decoded;
  if (!readAttribute<3>(mesh, request.positions, decoded.positions))
    return tl::unexpected(fmt::format("has no positions in its attribute {}", request.positions));
  if (request.uvs && !readAttribute<2>(mesh, *request.uvs, decoded.uvs))
    return tl::unexpected(fmt::format("has no texture coordinates in its attribute {}", *request.uvs));
  for (const auto& [id, components] : request.vectors)
    if (components > 4 || !readAttribute<4>(mesh, id, decoded.vectors.emplace_back(), components))
      return tl::unexpected(
          fmt::format("does not have {} numbers for each point in its attribute {}", components, id));
  decoded.indices.reserve(std::size_t{3} * mesh.num_faces());
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
    for (const draco::PointIndex& point : mesh.face(f)) {
      if (point.value() >= mesh.num_points())
        return tl::unexpected(
            fmt::format("has a face that names point {} of {}", point.value(), mesh.num_points()));
      decoded.indices.push_back(point.value());
    }
  return decoded;
}

}  // namespace

tl::expected<DracoMesh, std::string> decodeDraco(std::span<const std::byte> bytes,
                                                 const DracoRequest& request) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::DecoderBuffer ahead = buffer;
  draco::DracoHeader header;
  if (!draco::PointCloudDecoder::DecodeHeader(&ahead, &header).ok())
    return tl::unexpected(std::string("does not start with a header of Draco"));
  if (header.encoder_type != draco::TRIANGULAR_MESH)
    return tl::unexpected(std::string("is not a triangle mesh"));
  // Metadata takes more memory than its bytes.
  if ((header.flags & METADATA_FLAG_MASK) != 0)
    return tl::unexpected(std::string("has metadata, which is not supported: compress it without"));
  if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING)
    return decodeWith<draco::MeshSequentialDecoder>(buffer, request);
  if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING)
    return decodeWith<draco::MeshEdgebreakerDecoder>(buffer, request);
  return tl::unexpected(fmt::format("has the unknown encoding {}", header.encoder_method));
}

}  // namespace clothstream::meshes

// SPDX-License-Identifier: MIT
// Golden packets of tests/golden.
#include "tests/codec/golden.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace clothstream::codec {
namespace {

const std::string kFolder = "tests/golden/";

// 64-bit numbers are hexadecimal strings, because many JSON readers turn numbers into doubles.
std::string hexadecimal(std::uint64_t value) {
  return fmt::format("{:016x}", value);
}
std::uint64_t fromHexadecimal(const nlohmann::json& text) {
  return std::stoull(text.get<std::string>(), nullptr, 16);
}

std::ifstream openToRead(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + path);
  return in;
}

std::vector<std::byte> readBytes(const std::string& path) {
  std::ifstream in = openToRead(path);
  std::vector<std::byte> bytes;
  for (std::istreambuf_iterator<char> at(in), end; at != end; ++at)
    bytes.push_back(static_cast<std::byte>(*at));
  return bytes;
}

void writeBytes(const std::string& path, const std::vector<std::byte>& bytes) {
  std::ofstream out(path, std::ios::binary);
  for (const std::byte byte : bytes) out.put(static_cast<char>(byte));
}

GoldenStream readStream(const nlohmann::json& json) {
  GoldenStream stream;
  stream.name = json.at("name");
  stream.layout.epoch = json.at("epoch");
  stream.layout.codec = json.at("codec");
  stream.layout.maxError = json.at("maxError");
  stream.layout.qualities = json.value("qualities", std::uint8_t{1});
  stream.layout.origin = json.value("origin", stream.layout.origin);
  stream.layout.normals = json.at("normals") == "octahedral" ? NormalMode::octahedral : NormalMode::none;
  for (const nlohmann::json& cloth : json.at("cloths")) {
    stream.layout.cloths.push_back({cloth.at("vertexCount"), cloth.at("rows"), cloth.at("columns"),
                                    cloth.value("triangles", std::vector<std::uint32_t>{}),
                                    cloth.value("restPositions", std::vector<float>{})});
  }
  for (const nlohmann::json& packet : json.at("packets")) {
    const std::string file = packet.at("file");
    stream.packets.push_back({file, readBytes(kFolder + file), packet.at("tick"),
                              packet.at("kind") == "key" ? PacketKind::key : PacketKind::predicted,
                              fromHexadecimal(packet.at("reconstructionHash")),
                              fromHexadecimal(packet.at("positionsHash")),
                              fromHexadecimal(packet.at("coarsePositionsHash"))});
  }
  for (const std::string file : json.value("refused", nlohmann::json::array()))
    stream.refused.push_back({file, readBytes(kFolder + file)});
  for (const nlohmann::json& normal : json.at("normalSamples"))
    stream.normals.push_back({normal.at("vertex"), normal.at("normal")});
  return stream;
}

nlohmann::ordered_json describe(const GoldenStream& stream) {
  nlohmann::ordered_json json{
      {"name", stream.name},
      {"epoch", stream.layout.epoch},
      {"codec", stream.layout.codec},
      {"maxError", stream.layout.maxError},
      {"normals", stream.layout.normals == NormalMode::octahedral ? "octahedral" : "none"}};
  if (stream.layout.qualities > 1) json["qualities"] = stream.layout.qualities;
  if (stream.layout.origin != StreamLayout{}.origin) json["origin"] = stream.layout.origin;
  for (const ClothLayout& cloth : stream.layout.cloths) {
    nlohmann::ordered_json& described = json["cloths"].emplace_back();
    described = {{"vertexCount", cloth.vertexCount}, {"rows", cloth.rows}, {"columns", cloth.columns}};
    if (!cloth.triangles.empty()) described["triangles"] = cloth.triangles;
    if (!cloth.restPositions.empty()) described["restPositions"] = cloth.restPositions;
  }
  for (const GoldenPacket& packet : stream.packets) {
    json["packets"].push_back({{"file", packet.file},
                               {"tick", packet.tick},
                               {"kind", packet.kind == PacketKind::key ? "key" : "predicted"},
                               {"reconstructionHash", hexadecimal(packet.reconstructionHash)},
                               {"positionsHash", hexadecimal(packet.positionsHash)},
                               {"coarsePositionsHash", hexadecimal(packet.coarsePositionsHash)}});
  }
  for (const GoldenRefusal& refused : stream.refused) json["refused"].push_back(refused.file);
  for (const GoldenNormal& normal : stream.normals)
    json["normalSamples"].push_back({{"vertex", normal.vertex}, {"normal", normal.xyz}});
  return json;
}

}  // namespace

std::vector<GoldenStream> readGoldenStreams() {
  std::ifstream in = openToRead(kFolder + "streams.json");
  std::vector<GoldenStream> streams;
  for (const nlohmann::json& stream : nlohmann::json::parse(in)) streams.push_back(readStream(stream));
  return streams;
}

void writeGoldenStreams(const std::vector<GoldenStream>& streams) {
  nlohmann::ordered_json json;
  for (const GoldenStream& stream : streams) {
    json.push_back(describe(stream));
    for (const GoldenPacket& packet : stream.packets) writeBytes(kFolder + packet.file, packet.bytes);
    for (const GoldenRefusal& refused : stream.refused) writeBytes(kFolder + refused.file, refused.bytes);
  }
  std::ofstream(kFolder + "streams.json") << json.dump(2) << '\n';
}

std::vector<GoldenNormal> sampleNormals(std::span<const float> normals) {
  const std::size_t vertices = normals.size() / 3, count = std::min(vertices, kGoldenNormals);
  std::vector<GoldenNormal> samples(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t vertex = i * vertices / count;
    samples[i].vertex = static_cast<std::uint32_t>(vertex);
    for (std::size_t c = 0; c < 3; ++c)
      samples[i].xyz[c] = std::round(kNormalSteps * double{normals[3 * vertex + c]}) / kNormalSteps;
  }
  return samples;
}

std::uint64_t hashFloats(std::span<const float> values) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (unsigned shift = 0; shift < 32; shift += 8) hash = (hash ^ (bits >> shift & 0xffu)) * 0x100000001b3u;
  }
  return hash;
}

}  // namespace clothstream::codec

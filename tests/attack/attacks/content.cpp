// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

std::string uploadDenseVertices(const Target& target) {
  v1::Scene scene = sheet("dense", 2, 1);
  v1::Mesh& mesh = *scene.mutable_cloths(0)->mutable_mesh();
  constexpr int kSide = 256;
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      for (const int coordinate : {column, row, 0}) mesh.add_positions(static_cast<float>(coordinate) / 128);
  for (std::uint32_t row = 0; row + 1 < kSide; ++row)
    for (std::uint32_t column = 0; column + 1 < kSide; ++column) {
      const std::uint32_t a = row * kSide + column;
      for (const std::uint32_t node : {a, a + 1, a + kSide + 1}) mesh.add_triangles(node);
    }
  mesh.set_weld_distance(std::ldexp(1.0f, -30));
  return upload(*stubOf(target), scene.SerializeAsString());
}

std::string uploadFan(const Target& target) {
  v1::Scene scene = sheet("fan", 2, 1);
  v1::Mesh& mesh = *scene.mutable_cloths(0)->mutable_mesh();
  constexpr std::uint32_t kTriangles = 100'000;
  for (int i = 0; i < 3; ++i) mesh.add_positions(0);
  for (std::uint32_t i = 0; i < kTriangles; ++i) {
    const double angle = 2 * std::numbers::pi * i / kTriangles;
    mesh.add_positions(static_cast<float>(100 * std::cos(angle)));
    mesh.add_positions(static_cast<float>(100 * std::sin(angle)));
    mesh.add_positions(0);
    for (const std::uint32_t node : {0u, i + 1, (i + 1) % kTriangles + 1}) mesh.add_triangles(node);
  }
  return upload(*stubOf(target), scene.SerializeAsString());
}

void appendVarint(std::string& bytes, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<char>(value | 0x80));
  bytes.push_back(static_cast<char>(value));
}

std::uint64_t tagOf(const google::protobuf::Descriptor& message, const std::string& field) {
  constexpr int kLengthDelimited = 2;
  return static_cast<std::uint64_t>(message.FindFieldByName(field)->number() << 3 | kLengthDelimited);
}

std::string uploadEmptyPins(const Target& target) {
  v1::Scene scene = sheet("pins", 2, 1);
  std::string pin, cloth = scene.cloths(0).SerializeAsString();
  appendVarint(pin, tagOf(*v1::Cloth::descriptor(), "pins"));
  appendVarint(pin, 0);
  while (cloth.size() < 100'000'000) cloth += pin;
  scene.clear_cloths();
  std::string content = scene.SerializeAsString();
  appendVarint(content, tagOf(*v1::Scene::descriptor(), "cloths"));
  appendVarint(content, cloth.size());
  return upload(*stubOf(target), content + cloth);
}

std::string randomBytes(const Target& target) {
  std::uint32_t state = 1;
  std::uint64_t connections = 0;
  repeat(target, [&] {
    const int file = connectTo(connections++ % 2 == 0 ? target.grpc : target.web);
    std::string bytes(4096, ' ');
    for (char& byte : bytes) byte = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
    ::send(file, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    ::close(file);
  });
  return fmt::format("{} connections", connections);
}

constexpr Attack kAttacksContent[] = {
    {"dense_vertices", "upload 65,536 vertices with a tiny weld distance", &uploadDenseVertices,
     "(accepted|refused: ).*"},
    {"fan", "upload 100,000 triangles around one vertex", &uploadFan, "refused: .*"},
    {"empty_pins", "upload 100 MB of empty pins", &uploadEmptyPins, "(refused|the stream was closed): .*"},
    {"random_bytes", "send random bytes to both ports", &randomBytes, "[1-9][0-9]* connections"},
};

}  // namespace

std::span<const Attack> contentAttacks() {
  return kAttacksContent;
}

}  // namespace clothstream::attack

// SPDX-License-Identifier: MIT
// Fills a Stage from a cs_client of libclothstream.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include <clothstream/core.h>

#include "clients/xr/stage/stage.h"
#include "clients/xr/text/painter.h"

namespace clothstream::xr {

class StageReader {
 public:
  // `painter` draws names, and must outlive the reader.
  explicit StageReader(TextPainter& painter);

  // Reads what cs_play_out has chosen, and colliders, participants and materials. Call with the client acquired, after
  // cs_play_out. `events`: all CS_EVENT bits since the last call; CS_EVENT_DESCRIPTION, CS_EVENT_PARAMETERS,
  // CS_EVENT_PARTICIPANTS and CS_EVENT_PRESENCE make it read what seldom changes. Before the description, the stage has
  // no cloth. `drawsOwn`: own colliders are drawn faintly, for programs that do not draw hands themselves. Allocates
  // nothing while topology and participants stay.
  void read(cs_client* client, std::uint32_t events, bool drawsOwn, Stage& stage);

 private:
  struct Hull {
    std::uint32_t collider = 0;       // index
    std::uint32_t firstNode = 0, nodeCount = 0;
    std::uint32_t part = 0, frame = 0;
    bool isBody = false;
    float shrink = 1;
  };
  struct Person {
    std::string name;
    Colour colour;
    std::shared_ptr<const Picture> picture;
    bool wearsBody = false;
    std::uint64_t pass = 0;
  };

  void readTopology(const cs_client* client, Stage& stage);
  void readMaterials(const cs_client* client, Stage& stage);
  void readPeople(const cs_client* client);
  void readNodes(const cs_client* client, Stage& stage);
  void readColliders(const cs_client* client, bool drawsOwn, Stage& stage);

  TextPainter& painter_;
  std::vector<Hull> hulls_;
  std::vector<std::uint32_t> clothOfPart_; // cloth of each part of a cloth
  std::vector<std::uint32_t> dyes_;        // number of each part's dye
  std::vector<bool> woven_;
  std::unordered_map<std::uint64_t, Person> people_;
  const std::uint32_t* triangles_ = nullptr;
  std::uint32_t indexCount_ = 0, vertexCount_ = 0;
  std::uint64_t pass_ = 0;
};

// Adds a tracked hand to a list: a tapered capsule for each bone. Each joint is {x, y, z, radius}, in the order of
// OpenXR (26 joints).
void addHand(const float* joints, const Colour& colour, bool hidesOnly, std::vector<Solid>& out);

// Adds a thin glowing ray.
void addRay(const Eigen::Vector3f& from, const Eigen::Vector3f& to, const Colour& colour, std::vector<Solid>& out);

// Colour of a participant, the same for everyone.
Colour colourOf(std::uint64_t participant);

}  // namespace clothstream::xr

// SPDX-License-Identifier: MIT
// Fills a Stage from a cs_client of libclothstream.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
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

  // Reads what cs_play_out has chosen, and colliders, participants and materials. Call with the client
  // acquired, after cs_play_out. `events`: all CS_EVENT bits since the last call; CS_EVENT_DESCRIPTION,
  // CS_EVENT_PARAMETERS, CS_EVENT_PARTICIPANTS and CS_EVENT_PRESENCE make it read what seldom changes. Before
  // the description, the stage has no cloth. `drawsOwn`: own colliders are drawn faintly, for programs that
  // do not draw hands themselves. Allocates nothing while topology and participants stay.
  void read(cs_client* client, std::uint32_t events, bool drawsOwn, Stage& stage);

 private:
  // A collider of the scene that is a hull or mesh.
  struct Hull {
    std::uint32_t collider = 0;  // index
    std::uint32_t firstNode = 0, nodeCount = 0;
    std::uint32_t frame = 0;  // in Stage::frames
    float shrink = 1;
    std::optional<std::uint32_t> headPart;  // part with the head, of a body that can be worn
    std::string name;
  };
  struct Person {
    std::string name;
    std::shared_ptr<const Picture> picture;  // null without a name
  };
  struct ClothPart {
    std::uint32_t cloth = 0;
    std::uint32_t dye = 0;
    bool woven = false;
  };

  bool describes(const cs_client* client) const;
  void readTopology(const cs_client* client, Stage& stage);
  void readCloth(const cs_client* client, std::uint32_t index, Stage& stage);
  void readHull(const cs_client* client, std::uint32_t index, Stage& stage);
  void readBounds(const cs_client* client, Stage& stage) const;
  void readMaterials(const cs_client* client, Stage& stage) const;
  void readPeople(const cs_client* client);
  void readNodes(const cs_client* client, Stage& stage) const;
  void readHulls(const cs_client* client, bool hidesOwnHead, Stage& stage) const;
  void readColliders(const cs_client* client, bool drawsOwn, Stage& stage);
  void addLabel(const cs_collider& head, Stage& stage);

  TextPainter& painter_;
  std::vector<Hull> hulls_;
  std::vector<ClothPart> parts_;  // the first parts of the stage
  std::unordered_map<std::uint64_t, Person> people_;
  // Of the description that was read.
  const std::uint32_t* triangles_ = nullptr;
  std::uint32_t indexCount_ = 0, vertexCount_ = 0;
  std::uint64_t topology_ = 0;
};

}  // namespace clothstream::xr

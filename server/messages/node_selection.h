// SPDX-License-Identifier: MIT
// Nodes of a cloth that its pins and attachments select.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "clothstream/v1/scene.pb.h"
#include "server/messages/mesh_message.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

struct NodeSelection {
  std::vector<model::GridRange> ranges;
  std::vector<std::uint32_t> vertices;  // indices of nodes
  std::vector<model::Region> regions;
};

// Fields of a message that select nodes, with their names.
struct NamedNodes {
  std::string_view rangesField, verticesField, regionsField;
  const google::protobuf::RepeatedPtrField<v1::GridRange>& ranges;
  const google::protobuf::RepeatedField<std::uint32_t>& vertices;
  const google::protobuf::RepeatedPtrField<v1::Region>& regions;
};

// The shape of the cloth must be set. `nodes` is the result of toMeshCloth(), empty for grids. A vertex that
// a repair has divided selects all of its nodes.
NodeSelection toSelection(Checks& checks, const Path& path, const NamedNodes& named,
                          const model::Cloth& cloth, const VertexNodes& nodes);

model::Region toRegion(Checks& checks, const Path& path, const v1::Region& message);

void write(const model::GridRange& range, v1::GridRange& message);
void write(const model::Region& region, v1::Region& message);

}  // namespace clothstream::messages

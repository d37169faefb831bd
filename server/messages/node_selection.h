// SPDX-License-Identifier: MIT
// Nodes of a cloth that its pins and attachments select.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "clothstream/v1/scene.pb.h"
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

// The shape of the cloth must be set. `nodeOfVertex` is the result of toMeshCloth(), empty for grids.
NodeSelection toSelection(Checks& checks, const Path& path, const NamedNodes& named,
                          const model::Cloth& cloth, std::span<const std::uint32_t> nodeOfVertex);

void write(const model::GridRange& range, v1::GridRange& message);
void write(const model::Region& region, v1::Region& message);

}  // namespace clothstream::messages

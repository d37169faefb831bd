// SPDX-License-Identifier: MIT
// Sparse matrices of the constraints' systems, without their values.
#include "server/simulation/assembled/assembled_tables.h"

#include <algorithm>
#include <cassert>

#include "server/model/springs.h"

namespace clothstream::simulation {
namespace {

constexpr std::uint32_t kLanes = CLOTHSTREAM_SOLVE_LANES, kLaneRows = CLOTHSTREAM_ASSEMBLED_LANE_ROWS,
                        kChunkRows = CLOTHSTREAM_ASSEMBLED_CHUNK_ROWS;

float whole(std::size_t number) {
  assert(number < 1u << 24);
  return static_cast<float>(number);
}

std::uint32_t count(const auto& table) {
  return static_cast<std::uint32_t>(table.size());
}

// One list of a table of lists: four numbers per texel. `filler` fills the last texel.
class List {
 public:
  List(std::vector<shared::NumbersRecord>& table, float filler)
      : table_(table), filler_(filler), first_(table.size()) {}

  void push(float number) {
    if (length_ % 4 == 0) table_.push_back({{filler_, filler_, filler_, filler_}});
    shared::vec4& four = table_.back().four;
    float* const places[] = {&four.x, &four.y, &four.z, &four.w};
    *places[length_++ % 4] = number;
  }
  shared::EntriesRecord range() const { return {whole(first_), whole(table_.size()), 0, 0}; }

 private:
  std::vector<shared::NumbersRecord>& table_;
  float filler_;
  std::size_t first_, length_ = 0;
};

// A cloth with its constraints.
struct Source {
  const model::Cloth& cloth;
  std::uint32_t number, firstNode;
  std::vector<model::SpringLink> links;
  model::SpringAdjacency adjacency;
  std::vector<std::uint8_t> pinned;

  std::uint32_t chunks() const { return std::max(1u, (count(links) + kChunkRows - 1) / kChunkRows); }
};

// Length of the longest row of the matrix, in texels.
std::uint32_t longestRow(const Source& source) {
  std::uint32_t longest = 0;
  for (const model::SpringLink& link : source.links) {
    std::size_t entries = 1;
    for (const std::uint32_t node : {link.a, link.b})
      if (source.pinned[node] == 0) entries += source.adjacency.of(node).size() - 1;
    longest = std::max(longest, static_cast<std::uint32_t>((entries + 3) / 4));
  }
  return longest;
}

// Upper bound of the loop rounds of an invocation in one iteration of a solve by one workgroup.
std::uint64_t roundsOf(const Source& source, const AssembledCut& cut) {
  const std::uint64_t lanes = kLanes / cut.workgroup, tree = 2 * lanes + 16;
  const std::uint64_t multiply = lanes * (kLaneRows * (longestRow(source) + 2) + 1) + tree + 1;
  const std::uint64_t update = lanes + 2;
  return source.chunks() * (multiply + update + 1) + lanes + tree + 1;
}

// Entry of a row: `source` is 2 p + q if node p of the row is node q of the column.
struct Entry {
  std::uint32_t column, source;
};

std::vector<Entry> entriesOf(const Source& from, std::uint32_t row) {
  const model::SpringLink& own = from.links[row];
  std::vector<Entry> entries{{row, CLOTHSTREAM_DIAGONAL}};
  for (const std::uint32_t p : {0u, 1u}) {
    const std::uint32_t node = p == 0 ? own.a : own.b;
    if (from.pinned[node] != 0) continue;
    for (const std::uint32_t column : from.adjacency.of(node))
      if (column != row) entries.push_back({column, 2 * p + (from.links[column].a == node ? 0 : 1)});
  }
  std::ranges::sort(entries, {}, &Entry::column);
  return entries;
}

void appendRows(const Source& from, AssembledTables& tables) {
  const std::uint32_t firstRow = count(tables.rows);
  for (std::uint32_t i = 0; i < from.links.size(); ++i) {
    const model::SpringLink& link = from.links[i];
    List columns(tables.columns, whole(firstRow + i)), sources(tables.sources, CLOTHSTREAM_NO_ENTRY);
    for (const Entry& entry : entriesOf(from, i)) {
      columns.push(whole(firstRow + entry.column));
      sources.push(whole(entry.source));
    }
    tables.rows.push_back({whole(from.firstNode + link.a), whole(from.firstNode + link.b), link.restLength,
                           whole(CLOTHSTREAM_SPRING_KINDS * from.number + static_cast<int>(link.kind))});
    tables.entries.push_back(columns.range());
  }
}

void appendNodes(const Source& from, std::uint32_t firstRow, AssembledTables& tables) {
  for (std::uint32_t node = 0; node < from.cloth.nodeCount(); ++node) {
    List rows(tables.nodeRows, -1);
    for (const std::uint32_t link : from.adjacency.of(node))
      rows.push(whole(2 * std::size_t{firstRow + link} + (from.links[link].a == node ? 0 : 1)));
    tables.nodeEntries[from.firstNode + node] = rows.range();
  }
  const std::uint32_t end = from.firstNode + from.cloth.nodeCount();
  for (std::uint32_t node = from.firstNode; node < end; node += kLanes)
    tables.nodeRanges.push_back({whole(from.number), whole(node), whole(std::min(node + kLanes, end)), 0});
}

void appendSystem(const Source& from, AssembledTables& tables) {
  const std::uint32_t firstRow = count(tables.rows), chunks = from.chunks();
  const float system = whole(tables.systems.size());
  tables.cloths.push_back(from.number);
  appendRows(from, tables);
  appendNodes(from, firstRow, tables);
  tables.systems.push_back(
      {whole(from.number), whole(firstRow), whole(tables.rows.size()), whole(tables.chunks.size())});
  for (std::uint32_t chunk = 0; chunk < chunks; ++chunk)
    tables.chunks.push_back({system, whole(chunk), whole(chunks), 0});
}

}  // namespace

AssembledTables assembledTables(std::span<const model::Cloth> cloths, const AssembledCut& cut) {
  AssembledTables tables;
  std::vector<Source> parts;
  std::uint32_t firstNode = 0;
  tables.nodeEntries.resize(clothOffsets(cloths).back(), {0, 0, 0, 0});
  for (std::uint32_t i = 0; i < cloths.size(); firstNode += cloths[i++].nodeCount()) {
    if (!model::isAssembled(cloths[i].solver)) continue;
    std::vector<model::SpringLink> links = model::systemLinks(cloths[i]);
    model::SpringAdjacency adjacency = model::springAdjacency(links, cloths[i].nodeCount());
    Source source{
        cloths[i], i, firstNode, std::move(links), std::move(adjacency), model::pinnedNodes(cloths[i])};
    // A dispatch must have room for one iteration and the measurement at its end.
    const std::uint64_t rounds = roundsOf(source, cut);
    if (source.cloth.nodeCount() > cut.wholeNodes || 2 * rounds > cut.rounds) {
      parts.push_back(std::move(source));
      continue;
    }
    appendSystem(source, tables);
    tables.wholeIterations = std::max(tables.wholeIterations, source.cloth.solver.iterations);
    tables.wholeRounds = std::max(tables.wholeRounds, static_cast<std::uint32_t>(rounds));
  }
  tables.wholeSystems = {0, count(tables.systems)};
  tables.partChunks.first = count(tables.chunks);
  for (const Source& source : parts) {
    appendSystem(source, tables);
    tables.partIterations = std::max(tables.partIterations, source.cloth.solver.iterations);
  }
  tables.partChunks.count = count(tables.chunks) - tables.partChunks.first;
  return tables;
}

}  // namespace clothstream::simulation

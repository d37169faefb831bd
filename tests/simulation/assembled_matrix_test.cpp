// SPDX-License-Identifier: MIT
// The sparse matrices of assembled constraints, entry by entry and multiplied, against dense ones in double
// precision.
#include <vector>

#include <gtest/gtest.h>

#include "kernels/fill_jacobian.h"
#include "kernels/multiply_jacobians.h"
#include "kernels/multiply_system.h"
#include "server/model/springs.h"
#include "server/reference/constraint_system.h"
#include "server/simulation/assembled/assembled_tables.h"
#include "server/simulation/device_table.h"
#include "server/vulkan/kernel.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::AssembledTables;
using simulation::DeviceTable;
using simulation::NodeState;
using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::uint32_t kWorkgroup = 8;
constexpr double kSubstepSeconds = 1.0 / 720;

class AssembledMatrix : public GpuTest {};

// Two grids and a mesh, of which some have neighbours that are both pinned; one is not assembled.
model::Scene variedScene() {
  model::Cloth sheet = assembled(calmCloth(9, 14), true);
  sheet.pins = {topRow(sheet), {.firstRow = 4, .lastRow = 6, .firstColumn = 3, .lastColumn = 3}};
  model::Cloth disc = assembled(discCloth(5), true);
  disc.name = "disc";
  disc.pinnedVertices = {0, 1, 2, 40};
  model::Cloth other = assembled(calmCloth(6, 7), true);
  other.name = "other";
  other.solver.path = model::ConstraintPath::matrixFree;
  model::Cloth small = assembled(calmCloth(17, 23), false);
  small.name = "small";
  return sceneOf({sheet, other, disc, small});
}

// The system of one cloth in the reference.
reference::ConstraintSystem systemOf(const model::Scene& scene, std::size_t number, const NodeState& state) {
  const model::Cloth& cloth = scene.cloths[number];
  const std::uint32_t first = simulation::clothOffsets(scene.cloths)[number];
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  std::vector<reference::Vec3> positions, velocities;
  std::vector<double> inverseMasses;
  for (std::uint32_t i = first; i < first + cloth.nodeCount(); ++i) {
    positions.push_back(state.positions[i].cast<double>());
    velocities.push_back(state.velocities[i].cast<double>());
    inverseMasses.push_back(masses[i]);
  }
  std::vector<reference::Constraint> constraints;
  for (const model::SpringLink& link : model::systemLinks(cloth))
    constraints.push_back({link.a, link.b, (positions[link.b] - positions[link.a]).norm() - link.restLength});
  return {
      constraints,    positions, velocities, inverseMasses, model::scaledCompliance(cloth, kSubstepSeconds),
      kSubstepSeconds};
}

std::vector<float> listOf(const shared::EntriesRecord& range,
                          const std::vector<shared::NumbersRecord>& table) {
  std::vector<float> list;
  for (auto texel = static_cast<std::size_t>(range.firstTexel);
       texel < static_cast<std::size_t>(range.endTexel); ++texel) {
    const shared::vec4& four = table[texel].four;
    list.insert(list.end(), {four.x, four.y, four.z, four.w});
  }
  return list;
}

TEST(AssembledTables, HaveTheEntriesOfTheMatrix) {
  const model::Scene scene = variedScene();
  std::mt19937 random(2);
  const NodeState state = randomState(scene, random, 0.003f, 1);
  const AssembledTables tables = simulation::assembledTables(scene.cloths, {kWorkgroup, 1'000'000, 65'000});
  ASSERT_EQ(tables.cloths, (std::vector<std::uint32_t>{0, 2, 3}));
  for (std::size_t i = 0; i < tables.cloths.size(); ++i) {
    SCOPED_TRACE(scene.cloths[tables.cloths[i]].name);
    const Eigen::MatrixXd A = systemOf(scene, tables.cloths[i], state).matrix();
    const auto first = static_cast<std::size_t>(tables.systems[i].firstRow);
    ASSERT_EQ(static_cast<Eigen::Index>(tables.systems[i].endRow) - static_cast<Eigen::Index>(first),
              A.rows());
    std::uint64_t all = 0;
    for (Eigen::Index row = 0; row < A.rows(); ++row) {
      const shared::EntriesRecord& range = tables.entries[first + static_cast<std::size_t>(row)];
      const std::vector<float> columns = listOf(range, tables.columns),
                               sources = listOf(range, tables.sources);
      Eigen::Index found = -1;
      for (std::size_t entry = 0; entry < columns.size(); ++entry) {
        if (sources[entry] == CLOTHSTREAM_NO_ENTRY) continue;
        const Eigen::Index column =
            static_cast<Eigen::Index>(columns[entry]) - static_cast<Eigen::Index>(first);
        ASSERT_GT(column, found) << "row " << row;
        for (++found; found < column; ++found) ASSERT_EQ(A(row, found), 0) << row << ", " << found;
        EXPECT_EQ(sources[entry] == CLOTHSTREAM_DIAGONAL, row == column);
        ++all;
      }
      for (++found; found < A.cols(); ++found) ASSERT_EQ(A(row, found), 0) << row << ", " << found;
    }
    EXPECT_EQ(all, model::systemEntries(scene.cloths[tables.cloths[i]]));
  }
}

Buffer texelsOf(const std::vector<shared::vec4>& values, std::vector<Buffer>& uploads) {
  const std::size_t bytes = values.size() * sizeof(shared::vec4);
  uploads.emplace_back(device(), BufferPurpose::upload, bytes);
  std::ranges::copy(values, uploads.back().mapped<shared::vec4>().begin());
  return {device(), BufferPurpose::texels, bytes};
}

std::vector<shared::vec4> vectorsOf(const std::vector<model::Vec3>& vectors, const std::vector<float>& w) {
  std::vector<shared::vec4> texels;
  for (std::size_t i = 0; i < vectors.size(); ++i)
    texels.push_back({vectors[i].x(), vectors[i].y(), vectors[i].z(), w[i]});
  return texels;
}

// Results of the kernels for a state: b, and A times a vector with one number per row.
struct Products {
  std::vector<float> sides, products;
};

Products productsOf(const model::Scene& scene, const AssembledTables& tables, const NodeState& state,
                    const std::vector<float>& vector) {
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  const DeviceTable cloths(device(), simulation::clothRecords(scene.cloths, kSubstepSeconds)),
      systems(device(), tables.systems), chunks(device(), tables.chunks), rows(device(), tables.rows),
      entries(device(), tables.entries), columns(device(), tables.columns), sources(device(), tables.sources);
  std::vector<Buffer> uploads;
  std::vector<shared::vec4> wanted;
  for (const float value : vector) wanted.push_back({value, 0, 0, 0});
  const Buffer positions = texelsOf(vectorsOf(state.positions, masses), uploads),
               velocities = texelsOf(vectorsOf(state.velocities, masses), uploads),
               unused = texelsOf(wanted, uploads);
  const std::size_t half = unused.bytes();
  const Buffer blocks(device(), BufferPurpose::texels, 2 * half),
      values(device(), BufferPurpose::texels, tables.columns.size() * sizeof(shared::vec4)),
      vectors(device(), BufferPurpose::texels, 2 * half),
      sums(device(), BufferPurpose::state, tables.chunks.size() * 2 * sizeof(float)),
      solves(device(), BufferPurpose::state, tables.systems.size() * sizeof(shared::SolveRecord)),
      readback(device(), BufferPurpose::readback, 2 * half);
  const vulkan::Bindings filling(device(), {device(), kernels::fill_jacobian, kWorkgroup},
                                 {&cloths.texels(), &systems.texels(), &chunks.texels(), &rows.texels(),
                                  &positions, &velocities, &blocks, &vectors, &solves});
  const vulkan::Bindings assembling(device(), {device(), kernels::multiply_jacobians, kWorkgroup},
                                    {&cloths.texels(), &systems.texels(), &chunks.texels(), &entries.texels(),
                                     &columns.texels(), &sources.texels(), &blocks, &values});
  const vulkan::Bindings multiplying(
      device(), {device(), kernels::multiply_system, kWorkgroup},
      {&cloths.texels(), &systems.texels(), &chunks.texels(), &entries.texels(), &columns.texels(), &values,
       &vectors, &vectors, &sums, &solves});
  const std::uint64_t threads = tables.chunks.size() * std::uint64_t{kWorkgroup};
  Products found;
  run([&](vulkan::Recorder& recorder) {
    for (const DeviceTable* table : {&cloths, &systems, &chunks, &rows, &entries, &columns, &sources})
      table->recordUpload(recorder);
    recorder.copy(uploads[0], positions, positions.bytes());
    recorder.copy(uploads[1], velocities, velocities.bytes());
    recorder.barrier();
    recorder.dispatch(filling, shared::AssemblePush{static_cast<float>(1 / kSubstepSeconds)}, threads);
    recorder.barrier();
    recorder.dispatch(assembling, threads);
    recorder.copy(vectors, readback, half);
    recorder.barrier();
    recorder.copy(uploads[2], vectors, half);
    recorder.barrier();
    shared::MultiplierPush push{};
    push.rows = static_cast<std::uint32_t>(tables.rows.size());
    recorder.dispatch(multiplying, push, threads);
    recorder.barrier();
    recorder.copy(vectors, readback, half, half, half);
  });
  const std::span<const shared::vec4> texels = readback.mapped<const shared::vec4>();
  for (const shared::vec4& side : texels.first(vector.size())) found.sides.push_back(side.x);
  for (const shared::vec4& product : texels.last(vector.size())) found.products.push_back(product.x);
  return found;
}

// A direction is wrong by 1e-6 of itself, most of it from the reciprocal of its length; so an entry is by
// 3e-6 of an inverse mass, with its own rounding, and on the diagonal by twice that. A product adds at most a
// rounding of what is summed so far for each of its entries. A length is wrong by 1e-6 of itself, a speed by
// that and its own rounding.
TEST_F(AssembledMatrix, MultipliesLikeTheDenseMatrix) {
  const model::Scene scene = variedScene();
  std::mt19937 random(3);
  const NodeState state = randomState(scene, random, 0.003f, 1);
  const AssembledTables tables = simulation::assembledTables(scene.cloths, {kWorkgroup, 1'000'000, 65'000});
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<float> vector(tables.rows.size());
  for (float& value : vector) value = unit(random);
  const Products found = productsOf(scene, tables, state, vector);
  for (std::size_t i = 0; i < tables.cloths.size(); ++i) {
    SCOPED_TRACE(scene.cloths[tables.cloths[i]].name);
    const reference::ConstraintSystem system = systemOf(scene, tables.cloths[i], state);
    const Eigen::MatrixXd A = system.matrix();
    const auto first = static_cast<std::size_t>(tables.systems[i].firstRow);
    const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXf>(&vector[first], A.rows()).cast<double>();
    const Eigen::VectorXd expected = A * p, side = system.side() / kSubstepSeconds;
    for (Eigen::Index row = 0; row < A.rows(); ++row) {
      const std::size_t at = first + static_cast<std::size_t>(row);
      EXPECT_NEAR(found.products[at], expected[row], 5e-6 * A.row(row).cwiseAbs().sum() + 3e-6 * A(row, row))
          << row;
      EXPECT_NEAR(found.sides[at], side[row], 3e-6 * (0.06 / kSubstepSeconds + 4)) << row;
    }
    EXPECT_GT(expected.norm(), 1);
  }
}

}  // namespace
}  // namespace clothstream::tests

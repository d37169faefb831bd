// SPDX-License-Identifier: MIT
// What is simulated, as plain data: cloths, springs, pins, colliders, environment.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/model/collider.h"
#include "server/model/pose.h"

namespace clothstream::model {

// Metres, kilograms, seconds, newtons; coordinates as in pose.h.

// Hooke spring with a dashpot along its axis, [Va21] Eq. 1.
struct Spring {
  float stiffness = 0;  // N/m
  float damping = 0;    // N s/m
};

// Rectangle of nodes, both ends included, every rowStep-th row and columnStep-th column.
struct GridRange {
  std::uint32_t firstRow = 0, lastRow = 0, rowStep = 1;
  std::uint32_t firstColumn = 0, lastColumn = 0, columnStep = 1;

  bool contains(std::uint32_t row, std::uint32_t column) const;
};

// rows x columns nodes, row-major. With the identity pose it hangs in the XY plane: columns along +X, centred
// on x = 0, rows down from y = 0.
struct Grid {
  std::uint32_t rows = 2, columns = 2;
  float width = 1, height = 1;  // m, between the outermost nodes
  Pose pose = {};

  std::uint32_t nodeCount() const { return rows * columns; }
};

enum class SolverKind : std::uint8_t {
  massSpring,  // every spring is a force
  constraint,  // structural and shear springs keep their length: implicit constraint enforcement, [Va21] Eq.
               // 3-11
  acad,  // they are forces until a substep would stretch them too far: then constraints for that substep,
         // [Va21] 3.3
  xpbd,  // each spring is corrected in turn, as far as its stiffness says: extended position-based dynamics,
         // [MMC16]
  implicitEuler,  // every spring is a force, that of the substep's end: Baraff and Witkin, "Large steps in
                  // cloth simulation", 1998
};

// How a constraint system is kept while it is solved. Both give the same motion but for rounding.
enum class ConstraintPath : std::uint8_t {
  matrixFree,  // products are gathered from the springs
  assembled,   // the paper's sparse matrices, [Va21] 3.2.2: a baseline
};

// What turns a cloth's springs into motion. All but `kind` are of solvers that iterate.
struct Solver {
  SolverKind kind = SolverKind::massSpring;
  bool bendConstraints = false;  // bend springs as well: the paper's "all springs"
  // m/N. Absent: kRelativeCompliance of what a node gives way in a substep; xpbd: of structural and shear
  // springs, and absent one over their stiffness.
  std::optional<float> compliance;
  std::uint32_t iterations = 20;  // in a substep: of conjugate gradients, at most; xpbd: through all springs
  float tolerance = 0.001f;       // of the residual's norm, relative to where it started
  // acad: the stretch, as a part of its length, beyond which no substep is to take a spring.
  float activation = 0.1f;
  // The part of what a spring is too long already that a substep takes back (Baumgarte's stabilisation); of
  // `constraint` also of what it is too short. All of it gives the nodes that speed. Absent: all for
  // `constraint`, kCorrectionFraction for acad.
  std::optional<float> correctionFraction = {};
  ConstraintPath path = ConstraintPath::matrixFree;  // of `constraint`
};

inline constexpr float kCorrectionFraction = 0.15f;
float correctionFraction(const Solver& solver);

// Whether its system is one of sparse matrices.
bool isAssembled(const Solver& solver);

// Of h^2 / m, the compliance with which the number of iterations hardly depends on the cloth's size.
inline constexpr float kRelativeCompliance = 0.01f;

// Nodes are balls that keep out of each other. Pairs of one cloth that are nearer at rest than kNeighbours
// times the sum of their radii do not collide: springs keep them apart.
struct SelfCollision {
  float radius = 0;       // m, above 0
  float friction = 0.3f;  // Coulomb; of two cloths the mean counts
};
inline constexpr float kNeighbours = 1.1f;

// How often a substep looks who touches and puts them apart. The part of an overlap that is taken back each
// time, and the most speed that balls get for that, m/s.
inline constexpr int kContactIterations = 2;
inline constexpr float kOverlapCorrectionFraction = 0.5f;
inline constexpr float kPushOutSpeed = 3;

struct Mesh;  // mesh.h

// A part of space, its surface included.
struct Region {
  Vec3 centre = Vec3::Zero();
  std::optional<float> radius;  // m, of a sphere; absent: a box
  Vec3 size = Vec3::Zero();     // m, of the box, from face to face

  bool contains(const Vec3& point) const;
};

// Nodes that move as one with a frame: each keeps the place in it that it has at rest, when the frame is
// where it starts.
struct Attachment {
  std::string name;
  std::vector<GridRange> ranges;        // of a grid
  std::vector<std::uint32_t> vertices;  // nodes
  std::vector<Region> regions;          // whatever starts there
  std::string collider;                 // whose frame it is; empty: the one that follows
  Pose pose;
  Motion motion;
};

// An attached node moves no faster, m/s.
inline constexpr float kMaxAttachmentSpeed = 30;

// Of the way that a node in somebody's grab is out of its place, what a substep takes back.
inline constexpr float kCaughtUp = 0.25f;

// Long-range attachments: [KCM12] Kim, Chentanez, Mueller-Fischer, "Long Range Attachments", SCA 2012.
struct Tethers {
  float slack = 0.02f;  // beyond the distance along the cloth at rest, a part of it
};

struct Cloth {
  std::string name;
  std::string material;              // that it was made of, some numbers changed perhaps; empty: none
  Grid grid;                         // of a cloth without mesh
  std::shared_ptr<const Mesh> mesh;  // null: the cloth is the grid
  float mass = 0;                    // kg, of the whole cloth; nodeMasses() says how it is spread
  Spring structural, shear, bend;
  float dihedralBending = 0;                  // N m, across edges between faces
  float damping = 0;                          // 1/s
  float drag = 0, lift = 0;                   // coefficients, dimensionless
  float friction = 0.3f;                      // Coulomb, dimensionless
  float thickness = 0.005f;                   // m kept from a collider's surface
  std::vector<GridRange> pins;                // of a grid
  std::vector<std::uint32_t> pinnedVertices;  // nodes
  std::vector<Region> pinnedRegions;          // whatever starts there
  Solver solver;
  std::optional<SelfCollision> selfCollision;  // absent: it passes through cloth
  std::vector<Attachment> attachments;
  std::optional<Tethers> tethers;

  std::uint32_t nodeCount() const;
  float nodeMass() const { return mass / static_cast<float>(nodeCount()); }  // kg, mean
};

// What the wind strays by; wind.h says how.
struct Gust {
  float strength = 0;  // m/s, of each component
  float seconds = 2;   // from turn to turn
};

struct Environment {
  Vec3 gravity = Vec3(0, -9.81f, 0);
  Vec3 wind = Vec3::Zero();  // m/s; in a scene the mean
  float airDensity = 1.2f;   // kg/m^3
  Gust gust = {};            // of a scene; none where the wind is that of a tick
};

enum class Integrator : std::uint8_t { semiImplicitEuler, explicitEuler, rungeKutta4 };
enum class Normals : std::uint8_t { none, octahedral };
enum class Coding : std::uint8_t { entropy, packed };

struct StreamSettings {
  float maxError = 0.0005f;  // m an axis
  Normals normals = Normals::none;
  Coding coding = Coding::entropy;
  std::uint8_t temporalLayers = 1;  // 1 to 3
  std::uint8_t qualities = 3;       // 1 to 4, each with twice the max error of the one before
};

struct Scene {
  std::string name;
  std::string description;
  std::uint32_t simulationRate = 72;  // ticks/s
  std::uint32_t streamRate = 72;      // frames/s, divides simulationRate
  std::uint32_t substeps = 10;        // per tick
  Integrator integrator = Integrator::semiImplicitEuler;
  Environment environment;
  std::vector<Cloth> cloths;
  std::vector<Collider> colliders;
  StreamSettings stream;

  double tickSeconds() const { return 1.0 / simulationRate; }
  double substepSeconds() const { return tickSeconds() / substeps; }
  std::uint32_t nodeCount() const;
};

// At rest, m^2.
double areaOf(const Cloth& cloth);

// Start positions of the nodes, world space; a grid's row-major.
std::vector<Vec3> restPositions(const Grid& grid);
std::vector<Vec3> restPositions(const Cloth& cloth);

// kg a node, pinned or not: a grid's all alike, a mesh's by their shares of its area.
std::vector<double> nodeMasses(const Cloth& cloth);

// One byte a node: 1 where no force moves it, because it is pinned or attached. Ranges must lie inside the
// grid, vertices must exist.
std::vector<std::uint8_t> pinnedNodes(const Cloth& cloth);

// Likewise: 1 where the attachment has it.
std::vector<std::uint8_t> attachedNodes(const Cloth& cloth, const Attachment& attachment);

// Where the frame of an attachment is at a simulated time, when nobody moved it.
Pose frameAt(const Scene& scene, const Attachment& attachment, double seconds);

// Lengths at rest along a column (between columns), along a row (between rows), and along the diagonal, m.
struct GridSpacing {
  float column, row, diagonal;
};
GridSpacing spacing(const Grid& grid);

// How far streamed positions may be off for normals that are as good whatever the mesh: a part of the finest
// cloth's mean edge, m.
float suitedMaxError(const Scene& scene);

}  // namespace clothstream::model

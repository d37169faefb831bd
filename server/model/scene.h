// SPDX-License-Identifier: MIT
// Scene as plain data: cloths, springs, pins, colliders, environment.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/parameters/cloth_parameters.h"
#include "proto/parameters/environment_parameters.h"
#include "proto/parameters/settings.h"
#include "server/model/collider.h"
#include "server/model/local_wind.h"
#include "server/model/pose.h"

namespace clothstream::model {

// Units are metres, kilograms, seconds and newtons. pose.h defines the coordinates.

// Hooke spring with a dashpot along its axis, [Va21] Eq. 1. Both are 0 by default: no spring.
struct Spring {
  float stiffness = 0;  // N/m
  float damping = 0;    // N s/m
};

// Rectangle of grid nodes: every rowStep-th row and columnStep-th column, both ends included.
struct GridRange {
  std::uint32_t firstRow = 0, lastRow = 0, rowStep = 1;
  std::uint32_t firstColumn = 0, lastColumn = 0, columnStep = 1;

  std::uint64_t nodeCount() const {
    return (std::uint64_t{lastRow - firstRow} / rowStep + 1) * ((lastColumn - firstColumn) / columnStep + 1);
  }
};

// rows x columns nodes, row-major. With the identity pose the grid hangs in the XY plane. Columns run along
// +X, centred on x = 0. Rows run down from y = 0.
struct Grid {
  std::uint32_t rows = 2, columns = 2;
  float width = 1, height = 1;  // m, between the outermost nodes
  Pose pose = {};

  std::uint32_t nodeCount() const { return rows * columns; }
};

enum class SolverKind : std::uint8_t {
  // Every spring is a force.
  massSpring,
  // Structural and shear springs keep their length: implicit constraint enforcement, [Va21] Eq. 3-11.
  constraint,
  // Springs are forces. A spring that a substep would stretch too far is a constraint for that substep,
  // [Va21] 3.3.
  acad,
  // Springs are corrected one after another, each according to its stiffness: extended position-based
  // dynamics, [MMC16].
  xpbd,
  // Every spring is a force, evaluated at the end of the substep: Baraff and Witkin, "Large steps in cloth
  // simulation", 1998.
  implicitEuler,
};

// How acad chooses and holds constraints.
enum class AcadMode : std::uint8_t {
  // Springs pull and never push to keep the activation's length, in rounds that follow the motion. Springs
  // are no stiffer than the substep bears.
  limit,
  // [Va21] 3.3 and Fig. 5 to the letter. A spring that is longer than the activation at the start of a
  // substep has no force in it, and is a constraint to its rest length instead.
  paper,
};

// Storage of a constraint system during a solve. Both paths give the same motion except for rounding.
enum class ConstraintPath : std::uint8_t {
  matrixFree,  // products are gathered from the springs
  assembled,   // sparse matrices as in [Va21] 3.2.2; slower, a baseline for comparison
};

// Solver of one cloth. All fields except `kind` apply to solvers that iterate.
struct Solver {
  SolverKind kind = SolverKind::massSpring;
  bool bendConstraints = false;  // bend springs are constraints too: "all springs" in [Va21]
  // m/N. For xpbd it applies to structural and shear springs; absent means 1 / stiffness. For the other
  // solvers absent means kRelativeCompliance * h^2 / m. For AcadMode::paper absent means 0, and for
  // AcadMode::limit kLimitCompliance * h^2 / m.
  std::optional<float> compliance;
  // Per substep: maximum conjugate gradient iterations; for xpbd the rounds through all springs.
  std::uint32_t iterations = parameters::kIterations.initial;
  float tolerance = parameters::kTolerance.initial;  // maximum norm of the residual, relative to its start
  // For acad: maximum stretch that a substep may give a spring, as a fraction of its length.
  float activation = parameters::kActivation.initial;
  // Fraction of an existing length error that a substep corrects (Baumgarte stabilisation). The error is
  // stretch; for `constraint` also compression. The correction gives the nodes speed. Absent means 1. Only
  // for `constraint` and AcadMode::paper.
  std::optional<float> correctionFraction = {};
  ConstraintPath path = ConstraintPath::matrixFree;  // for `constraint`
  AcadMode acadMode = AcadMode::limit;               // for acad
};

// For AcadMode::limit: rounds per substep, which share the iterations, and the default compliance as a
// fraction of h^2 / m. A tenth of this compliance holds no better, and the cloth does not come to rest.
inline constexpr std::uint32_t kLimitRounds = 3;
inline constexpr float kLimitCompliance = 0.2f;
float correctionFraction(const Solver& solver);

// True if the solver is acad with this mode.
bool isAcad(const Solver& solver, AcadMode mode);

// Iterations of one solve: AcadMode::limit divides those of a substep among its rounds.
std::uint32_t iterationsOf(const Solver& solver);

// True if the solver multiplies sparse matrices.
bool isAssembled(const Solver& solver);

// Default compliance as a fraction of h^2 / m. With it, the number of iterations hardly depends on the
// cloth's size.
inline constexpr float kRelativeCompliance = 0.01f;

// Nodes are balls that do not overlap. Two nodes of one cloth do not collide if they are nearer at rest than
// kNeighbours times the sum of their radii, because springs keep them apart.
struct SelfCollision {
  float radius = 0;  // m, above 0
  // Coulomb. Two cloths use the mean of their values.
  float friction = initial(parameters::ClothNumber::ballFriction);
  // True: motions are shortened so that no triangle of the cloth passes through one of a cloth with the same
  // setting, or of its own.
  bool nothingPasses = false;
};
inline constexpr float kNeighbours = 1.1f;

// Contact iterations per substep.
inline constexpr int kContactIterations = 2;
// Fraction of an overlap that one contact iteration corrects.
inline constexpr float kOverlapCorrectionFraction = 0.5f;
// Maximum speed of that correction, m/s.
inline constexpr float kPushOutSpeed = 3;

struct Mesh;       // mesh.h
struct ClothSkin;  // cloth_skin.h

// Sphere or box in space, its surface included.
struct Region {
  Vec3 centre = Vec3::Zero();
  std::optional<float> radius;  // m, of the sphere; absent: the region is a box
  Vec3 size = Vec3::Zero();     // m, of the box, from face to face

  bool contains(const Vec3& point) const;
};

// Nodes that move rigidly with a frame. Each node keeps its rest position relative to the frame's initial
// pose.
struct Attachment {
  std::string name;
  std::vector<GridRange> ranges;        // nodes of a grid
  std::vector<std::uint32_t> vertices;  // nodes by index
  std::vector<Region> regions;          // nodes whose rest position lies inside
  std::string collider;                 // name of the collider that is the frame; empty: uses pose and motion
  Pose pose;
  Motion motion;
};

// Maximum speed of an attached node, m/s.
inline constexpr float kMaxAttachmentSpeed = 30;

// Time in which a grab draws its place to itself, seconds.
inline constexpr double kGrabDrawSeconds = 0.2;
// Fraction of a grabbed node's distance from its place that a substep corrects.
inline constexpr float kGrabCorrectionFraction = 0.25f;

// Long-range attachments: [KCM12] Kim, Chentanez, Mueller-Fischer, "Long Range Attachments", SCA 2012.
struct Tethers {
  // Extra length, as a fraction of the distance along the cloth at rest.
  float slack = initial(parameters::ClothNumber::tetherSlack);
};

// Correction by means of nodes that are never farther apart than at rest: coarse_level.h.
struct CoarseCorrection {
  std::uint32_t cells =
      8;  // coarse cells along the longer side of a grid; a mesh has as many coarse nodes, 2 to 16
  std::uint32_t sweeps = 4;  // rounds through the coarse links in a correction, 1 to 16
  std::uint32_t every = 2;   // substeps between two corrections, 1 to 64
  std::uint32_t levels = 1;  // 2: a level with a quarter of the cells, at least 2, acts first

  bool operator==(const CoarseCorrection&) const = default;
};

struct Cloth {
  std::string name;
  // Name of the material that the cloth was last made of; empty: none. Its numbers may have changed since.
  std::string material;
  Grid grid;                         // used if there is no mesh
  std::shared_ptr<const Mesh> mesh;  // null: the cloth is the grid
  float mass = 0;                    // kg, whole cloth; nodeMasses() distributes it
  // Units, ranges and defaults of the following numbers are in proto/parameters/cloth_parameters.h.
  Spring structural, shear, bend;
  float dihedralBending = initial(parameters::ClothNumber::dihedralBending);  // across edges between faces
  float damping = initial(parameters::ClothNumber::damping);
  float drag = initial(parameters::ClothNumber::drag), lift = initial(parameters::ClothNumber::lift);
  float friction = initial(parameters::ClothNumber::friction);
  float thickness = initial(parameters::ClothNumber::thickness);  // distance kept from a collider's surface
  std::vector<GridRange> pins;                                    // nodes of a grid
  std::vector<std::uint32_t> pinnedVertices;                      // nodes by index
  std::vector<Region> pinnedRegions;                              // nodes whose rest position lies inside
  Solver solver;
  std::optional<SelfCollision> selfCollision;  // absent: the cloth passes through cloth
  std::vector<Attachment> attachments;
  std::optional<Tethers> tethers;
  std::optional<CoarseCorrection> coarse;  // absent: springs alone
  std::shared_ptr<const ClothSkin> skin;   // null: the cloth follows no joints
  // Of the gas inside a closed mesh above the pressure outside, at the volume at rest, Pa; 0: no gas. gas.h
  float pressure = initial(parameters::ClothNumber::pressure);

  std::uint32_t nodeCount() const;
  float nodeMass() const { return mass / static_cast<float>(nodeCount()); }  // kg, mean
};

// True if nothing passes through this cloth.
inline bool boundsMotion(const Cloth& cloth) {
  return cloth.selfCollision && cloth.selfCollision->nothingPasses;
}

// Units, ranges and defaults of the following numbers are in proto/parameters/environment_parameters.h.

// Variation of the wind; wind.h describes it.
struct Gust {
  float strength = initial(parameters::kGust, 0);  // maximum deviation of each component; 0: no gusts
  float seconds = initial(parameters::kGust, 1);   // time between two turning points of a component
};

struct Environment {
  Vec3 gravity = Vec3(0, initial(parameters::kGravity, 1), 0);
  Vec3 wind = Vec3::Zero();                             // in a scene the mean, in a tick the wind at its time
  float airDensity = initial(parameters::kAirDensity);  // 0 switches drag and lift off
  Gust gust = {};                                       // in a scene only
};

// Where the environment keeps a number of the table of parameters. `number` is the index in its field.
float& numberOf(Environment& environment, parameters::EnvironmentField field, std::uint32_t number);

enum class Integrator : std::uint8_t { semiImplicitEuler, explicitEuler, rungeKutta4 };
enum class Normals : std::uint8_t { none, octahedral };

struct StreamSettings {
  float maxError = 0.0005f;  // m, per axis
  Normals normals = Normals::none;
  std::uint8_t qualities = 3;  // 1 to 4; each has twice the maximum error of the previous one
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
  std::vector<SceneWind> winds;  // in addition to that of the environment
  StreamSettings stream;

  double tickSeconds() const { return 1.0 / simulationRate; }
  double substepSeconds() const { return tickSeconds() / substeps; }
  std::uint32_t nodeCount() const;
};

// Area at rest, m^2.
double areaOf(const Cloth& cloth);

// Start positions of the nodes in world space. Grid nodes are row-major.
std::vector<Vec3> restPositions(const Grid& grid);
std::vector<Vec3> restPositions(const Cloth& cloth);

// Mass of each node in kg, pinned or not. Grid nodes have equal masses; mesh nodes have their share of the
// area.
std::vector<double> nodeMasses(const Cloth& cloth);

// One byte per node: 1 if it is pinned or attached, or follows its joints exactly, so that no force moves it.
// Ranges must lie inside the grid and vertices must exist.
std::vector<std::uint8_t> pinnedNodes(const Cloth& cloth);

// One byte per node: 1 if it belongs to the attachment.
std::vector<std::uint8_t> attachedNodes(const Cloth& cloth, const Attachment& attachment);

// Pose of an attachment's frame at a simulated time, if no participant has moved it.
Pose frameAt(const Scene& scene, const Attachment& attachment, double seconds);

// Rest lengths in metres: between columns, between rows, and along the diagonal.
struct GridSpacing {
  float column, row, diagonal;
};
GridSpacing spacing(const Grid& grid);

// Default maximum error of streamed positions in metres: a fraction of the finest cloth's mean edge. Normals
// are then equally accurate for every mesh.
float suitedMaxError(const Scene& scene);

// Largest distance along each axis from originOf() that all qualities of the stream hold, in metres. Nodes
// must not be beyond it.
float reachOf(const StreamSettings& stream);
// Max error in metres from which on streams hold this distance.
float maxErrorFor(float distance);

}  // namespace clothstream::model

// SPDX-License-Identifier: MIT
// One substep of every node of the grids: spring and air forces, integration and collision. [Va21] Alg. 1,
// gathered node by node.
//
// An invocation walks down a strip of one column. Neighbours come from texel buffers into a window of
// registers that slides along, so that each node reads five positions instead of thirteen. The force of a
// vertical spring, and of a triangle, serves both rows that it touches. Neither changes a bit of the result,
// so that the result depends neither on the strip's length nor on the workgroup's size. The loop over rows is
// unrolled, so that moving the window costs nothing. Writes cannot race: each node belongs to one invocation,
// and reads go to other buffers.

#extension GL_EXT_control_flow_attributes : require

const int kLocalWindBinding = 10;

#include "shaders/mass_spring/state.glsl"
#include "shaders/shared/grid_strip.glsl"

// Without a window, nodes are read just before the force that needs them, so that a GPU needs fewer
// registers.
const bool kWindow = kRowsPerInvocation > 1;

// A node in the window, or at `index` if there is no window.
Node nodeOf(Node window, uint index) {
  if (kWindow) {
    return window;
  }
  return fetchNode(index);
}

layout(std430, binding = 9) writeonly buffer Stretches {
  uint stretches[];  // dispatch sizes, x, y, z; then the marks of walks (StateBuffers)
};

// ACAD's limits of the springs of a grid, squared, each less a margin for the accelerations of its ends.
struct Limits {
  float right, below, shear;
  float allowed;  // square of what the accelerations of a spring's ends may add, m^2
};

float shortened(float restLength, float activation, float margin) {
  precise float longest = restLength + activation * restLength;
  precise float most = (longest - margin) * 0.99999;
  precise float squared = most > 0.0 ? most * most : 0.0;
  return squared;
}

// Where a node is at the end of the substep without acceleration. The paper decides by the substep's start.
vec3 expectedPlace(vec3 position, vec3 velocity) {
  precise vec3 place = kTestsMotion ? position + push.stepSeconds * velocity : position;
  return place;
}

bool isLong(vec3 a, vec3 b, float limit) {
  precise vec3 d = b - a;
  return dotProduct(d, d) > limit;
}

// True if a structural or shear spring of the quad below and to the right of `here` may become too long. A
// bend spring is only too long if one of the two structural springs along it is.
bool isQuadLong(vec3 here, vec3 right, vec3 below, vec3 rightBelow, Limits limits) {
  return isLong(here, right, limits.right) || isLong(here, below, limits.below) ||
         isLong(here, rightBelow, limits.shear) || isLong(right, below, limits.shear);
}

// Walks of kSolveWalk rows that a strip may touch.
const uint kSolveWalk = CLOTHSTREAM_SOLVE_WALK;
// Not 0 if a strip may begin inside a walk and end in another; below 4 * kSolveWalk.
const uint kOffset = (kRowsPerInvocation % kSolveWalk) * (kSolveWalk % kRowsPerInvocation);
const uint kMarks =
    (kRowsPerInvocation + kSolveWalk - 1) / kSolveWalk + (kOffset + 4 * kSolveWalk - 1) / (4 * kSolveWalk);

// Marks the walks of a strip. All invocations store the same numbers.
void markStretched(Strip strip) {
  stretches[push.stretchSize] = push.stretchGroups;
  uint first = strip.row / kSolveWalk;
  [[unroll]] for (uint i = 0; i < kMarks; ++i) {
    uint last = min(strip.row + kRowsPerInvocation, strip.rows) - 1;
    uint walk = min(first + i, last / kSolveWalk);
    stretches[push.firstMark + strip.firstNode + walk * strip.columns + strip.column] = 1;
  }
}

void main() {
  Strip strip = locateStrip(push.firstTile);
  if (strip.row >= strip.rows) {
    return;
  }
  ClothRecord cloth = clothAt(cloths, strip.cloth);
  uint columns = strip.columns;
  uint lastRow = strip.rows - 1;

  // Loads beyond an edge read the edge instead. Their springs have no stiffness, and their triangles no area.
  bool hasLeft = strip.column > 0;
  bool hasRight = strip.column + 1 < columns;
  bool hasLeft2 = strip.column > 1;
  bool hasRight2 = strip.column + 2 < columns;
  uint toLeft = hasLeft ? 1 : 0;
  uint toRight = hasRight ? 1 : 0;
  uint toLeft2 = hasLeft2 ? 2 : 0;
  uint toRight2 = hasRight2 ? 2 : 0;
  uint start = strip.firstNode + strip.column;

  bool bendLimited = cloth.solvesBend != 0.0;
  Spring alongRow = Spring(cloth.structuralStiffness, cloth.structuralDamping, cloth.columnSpacing,
                           longestSquared(cloth.columnSpacing, cloth.activation, true));
  Spring alongColumn = Spring(cloth.structuralStiffness, cloth.structuralDamping, cloth.rowSpacing,
                              longestSquared(cloth.rowSpacing, cloth.activation, true));
  Spring shear = Spring(cloth.shearStiffness, cloth.shearDamping, cloth.diagonalSpacing,
                        longestSquared(cloth.diagonalSpacing, cloth.activation, true));
  Spring bendRow = Spring(cloth.bendStiffness, cloth.bendDamping, 2.0 * cloth.columnSpacing,
                          longestSquared(2.0 * cloth.columnSpacing, cloth.activation, bendLimited));
  Spring bendColumn = Spring(cloth.bendStiffness, cloth.bendDamping, 2.0 * cloth.rowSpacing,
                             longestSquared(2.0 * cloth.rowSpacing, cloth.activation, bendLimited));
  // A node's acceleration a adds at most h^2 |a| to the length of its springs. A quarter of the activation is
  // left for both ends. If a node accelerates more, its springs count as stretched.
  float shortest = min(cloth.columnSpacing, cloth.rowSpacing);
  precise float margin = kTestsMotion ? 0.25 * cloth.activation * shortest : 0.0;
  precise float allowed = margin * margin;
  Limits limits = Limits(shortened(alongRow.restLength, cloth.activation, margin),
                         shortened(alongColumn.restLength, cloth.activation, margin),
                         shortened(shear.restLength, cloth.activation, margin), allowed);
  bool stretched = false;
  Spring leftSpring = where(hasLeft, alongRow);
  Spring rightSpring = where(hasRight, alongRow);
  Spring left2Spring = where(hasLeft2, bendRow);
  Spring right2Spring = where(hasRight2, bendRow);
  Spring leftShear = where(hasLeft, shear);
  Spring rightShear = where(hasRight, shear);
  precise float drag = push.airFactor * cloth.drag;
  precise float lift = push.airFactor * cloth.lift;
  Air air = Air(push.wind, drag, lift, push.localWinds);

  // The window has the columns left, centre and right, and the rows above, here and below.
  uint row = strip.row;
  uint index = start + row * columns;
  uint aboveIndex = start + (row > 0 ? row - 1 : 0) * columns;
  uint belowIndex = start + min(row + 1, lastRow) * columns;
  Node leftAbove, left, below, rightAbove, right;
  if (kWindow) {
    leftAbove = fetchNode(aboveIndex - toLeft);
    left = fetchNode(index - toLeft);
    below = fetchNode(belowIndex);
    rightAbove = fetchNode(aboveIndex + toRight);
    right = fetchNode(index + toRight);
  }
  Node above = fetchNode(aboveIndex);
  Node here = fetchNode(index);
  here.velocity = fetchVelocity(index);
  vec3 expected, expectedRight;
  if (kTestsStretch) {
    uint rightIndex = index + toRight;
    expected = expectedPlace(here.position, here.velocity);
    expectedRight = expectedPlace(texelFetch(positions, int(rightIndex)).xyz,
                                  kTestsMotion ? fetchVelocity(rightIndex) : vec3(0.0));
  }

  // Forces from rows before the strip: upward springs of its first row, the bend spring of its second row,
  // and the triangles above.
  vec3 aboveForce = springForce(here, above, where(row > 0, alongColumn));
  vec3 above2Force =
      springForce(here, fetchNode(start + (row > 1 ? row - 2 : 0) * columns), where(row > 1, bendColumn));
  vec3 nextAbove2Force, leftAboveAir, rightAboveAir1, rightAboveAir2;
  if (kWindow) {
    nextAbove2Force = springForce(below, above, where(row > 0, bendColumn));
  }
  if (kAir && kWindow) {
    leftAboveAir = airForce(above, left, here, air);
    rightAboveAir1 = airForce(above, here, rightAbove, air);
    rightAboveAir2 = airForce(rightAbove, here, right, air);
  }

  Node moved[kRowsPerInvocation];
  vec3 origins[kRowsPerInvocation];
  bool idle = true;
  // Rows past the cloth's last row repeat that row and are not stored.
  [[unroll]] for (uint k = 0; k < kRowsPerInvocation; ++k) {
    bool hasBelow = row < lastRow;
    bool hasBelow2 = row + 1 < lastRow;
    index = start + min(row, lastRow) * columns;
    belowIndex = start + min(row + 1, lastRow) * columns;
    Node below2 = fetchNode(start + min(row + 2, lastRow) * columns);
    vec3 below2Force = springForce(here, below2, where(hasBelow2, bendColumn));
    below = nodeOf(below, belowIndex);
    vec3 belowForce = springForce(here, below, where(hasBelow, alongColumn));
    left = nodeOf(left, index - toLeft);
    precise vec3 force = springForce(here, left, leftSpring);
    right = nodeOf(right, index + toRight);
    force = force + springForce(here, right, rightSpring);
    force = force + aboveForce;
    force = force + belowForce;
    leftAbove = nodeOf(leftAbove, aboveIndex - toLeft);
    force = force + springForce(here, leftAbove, where(row > 0, leftShear));
    rightAbove = nodeOf(rightAbove, aboveIndex + toRight);
    force = force + springForce(here, rightAbove, where(row > 0, rightShear));
    Node leftBelow = fetchNode(belowIndex - toLeft);
    force = force + springForce(here, leftBelow, where(hasBelow, leftShear));
    Node rightBelow = fetchNode(belowIndex + toRight);
    force = force + springForce(here, rightBelow, where(hasBelow, rightShear));
    force = force + springForce(here, fetchNode(index - toLeft2), left2Spring);
    force = force + springForce(here, fetchNode(index + toRight2), right2Spring);
    force = force + above2Force;
    force = force + below2Force;

    if (kAir) {
      if (!kWindow) {
        leftAboveAir = airForce(above, left, here, air);
        rightAboveAir1 = airForce(above, here, rightAbove, air);
        rightAboveAir2 = airForce(rightAbove, here, right, air);
      }
      // A quad with corners a b above e f has the triangles (a, e, b) and (b, e, f).
      vec3 leftAir1 = airForce(left, leftBelow, here, air);
      vec3 leftAir2 = airForce(here, leftBelow, below, air);
      vec3 rightAir1 = airForce(here, below, right, air);
      precise vec3 sum = leftAboveAir + rightAboveAir1 + rightAboveAir2 + leftAir1 + leftAir2 + rightAir1;
      force = force + sum;
      leftAboveAir = leftAir2;
      rightAboveAir1 = rightAir1;
      rightAboveAir2 = airForce(right, below, rightBelow, air);
    }

    moved[k] = moveNode(here, force, cloth.velocityDecay);
    if (kTestsStretch) {
      if (kTestsMotion && !kSpringDamping && !kAir) {
        below.velocity = fetchVelocity(belowIndex);
        rightBelow.velocity = fetchVelocity(belowIndex + toRight);
      }
      vec3 expectedBelow = expectedPlace(below.position, below.velocity);
      vec3 expectedRightBelow = expectedPlace(rightBelow.position, rightBelow.velocity);
      precise vec3 gained = (2.0 * push.stepSeconds) * (moved[k].velocity - here.velocity);
      stretched = stretched ||
                  isQuadLong(expected, expectedRight, expectedBelow, expectedRightBelow, limits) ||
                  (kTestsMotion && dotProduct(gained, gained) > limits.allowed);
      expected = expectedBelow;
      expectedRight = expectedRightBelow;
    }
    if (kColliders) {
      origins[k] = here.position;
      NearList list = fetchNearList(index);
      idle = idle && list.count == 0 && covers(list, here.position, moved[k].position);
    } else if (row <= lastRow) {
      store(index, moved[k]);
    }

    aboveForce = -belowForce;
    above2Force = nextAbove2Force;
    nextAbove2Force = -below2Force;
    leftAbove = left;
    left = leftBelow;
    rightAbove = right;
    right = rightBelow;
    here = below;
    if (!kSpringDamping && !kAir && !kTestsMotion) {
      here.velocity = fetchVelocity(belowIndex);
    }
    below = below2;
    ++row;
  }

  if (kTestsStretch && stretched) {
    markStretched(strip);
  }

  if (kColliders) {
    // Each round takes the first row of the window. A software device runs this code once even if nothing is
    // near, so that the code must not be repeated for each row.
    uint k = 0;
    do {
      Node node = moved[0];
      vec3 from = origins[0];
      if (!idle) {
        if (node.inverseMass > 0.0) {
          bool exists = strip.row + k <= lastRow;
          CollidingNode collidingNode =
              CollidingNode(start + min(strip.row + k, lastRow) * columns, strip.cloth,
                            exists ? node.inverseMass : 0.0, cloth.thickness, cloth.friction);
          collideWithAll(collidingNode, push.collision, from, node.position, node.velocity);
        }
        [[unroll]] for (uint i = 0; i + 1 < kRowsPerInvocation; ++i) {
          moved[i] = moved[i + 1];
          origins[i] = origins[i + 1];
        }
        moved[kRowsPerInvocation - 1] = node;
      }
      ++k;
    } while (!idle && k < kRowsPerInvocation);
    [[unroll]] for (uint i = 0; i < kRowsPerInvocation; ++i) {
      row = strip.row + i;
      if (row <= lastRow) {
        store(start + row * columns, moved[i]);
      }
    }
  }
}

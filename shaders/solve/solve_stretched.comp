// SPDX-License-Identifier: MIT
// Solves the systems of ACAD's grids for the ends of stretched springs only, one workgroup per cloth: lists
// these nodes, computes their springs, solves by conjugate gradients, and moves the nodes. It gives the same
// bits as check_stretch.comp, prepare_grids.comp, solve_velocities.comp and apply_velocities.comp: what these
// add for other nodes is zero, and the sums have the same order.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/conjugate_gradient_step.glsl"
#include "shaders/solve/stretched_nodes.glsl"

layout(std430, binding = 7) coherent buffer FreeVelocities {
  vec4 velocities[];
};
// The vectors of the solve (linear_system.glsl), by place in the list of nodes. Those of `kTotals` are by
// node. The same memory twice, as the springs: conjugate_gradient.glsl.
layout(binding = 8, rgba32f) uniform coherent readonly imageBuffer texels;
layout(std430, binding = 9) coherent buffer Vectors {
  vec4 vectors[];
};
// Stretched springs at a node: their `along` and the place of the other end. A texel has two springs. The
// texels with the first two springs of all nodes come first.
layout(binding = 10, rgba32f) uniform coherent readonly imageBuffer springTexels;
layout(std430, binding = 11) coherent buffer Springs {
  vec2 springs[];
};
layout(std430, binding = 13) coherent buffer Solves {
  SolveRecord solves[];
};

// The chunks of a batch are added up at the same time.
const uint kBatchChunks = 16, kBatchWalks = kBatchChunks * kLanes;
const uint kMostChunks = CLOTHSTREAM_STRETCHED_CHUNKS, kMostBatches = kMostChunks / kBatchChunks;

shared vec2 walkSums[kBatchWalks];
shared vec2 chunkSums[kMostChunks];
shared uint firstWalks[kMostBatches + 1];  // of each batch: index of its first listed walk
shared uint batches[kMostBatches];         // those with a walk
shared uint batchCount;
shared uint stretchedSprings, mostTexels;
shared SolveRecord solve;

uint vectorAt(uint which, uint place) {
  return which * push.nodes + system.firstNode + place;
}
vec4 fetch(uint which, uint place) {
  return imageLoad(texels, int(vectorAt(which, place)));
}

End endAt(uint node) {
  int index = int(system.firstNode + node);
  vec4 start = texelFetch(positions, index);
  vec3 free = kPaper ? start.xyz : imageLoad(freeTexels, index).xyz;
  return End(kLimit ? free : start.xyz, start.w, vec3(0.0),
             kLimit ? vec3(0.0) : texelFetch(freeVelocities, index).xyz, free);
}

void storeSpring(bool exists, uint place, uint number, float along, uint other) {
  if (exists) {
    springs[2 * (number / 2 * push.nodes + system.firstNode + place) + number % 2] = vec2(along, other);
  }
}

// Neighbours in the order in which prepare_grids.comp adds their impulses. The spring to one of the first
// five, or to the node left below, counts as the node's own.
const uint kImpulseOrder[12] = uint[](1, 3, 7, 9, 11, 0, 2, 4, 5, 6, 8, 10);
const bool kCounts[12] = bool[](false, true, false, true, false, false, true, true, false, true, false, true);

void prepareNode(uint place, uint round, bool exists) {
  uint node = lists[at(kNodes, place)];
  ivec2 rowColumn = ivec2(node / system.columns, node % system.columns);
  End here = endAt(node);
  vec3 impulses[12];
  uint number = 0, own = 0;
  [[unroll]] for (uint i = 0; i < 12; ++i) {
    impulses[i] = vec3(0.0);
    if (i < kNeighbours) {
      uint other = nodeAt(rowColumn + kOffsets[i]);
      Weight weight = weightOf(here, endAt(other), springKind(restLengthOf(i), 0.0, 0.0), cloth,
                               hasSpringTo(i, rowColumn + kOffsets[i]));
      impulses[i] = weight.impulse;
      bool stretched = weight.along > 0.0;
      storeSpring(exists && stretched, place, number, weight.along, placeOfNode(other));
      number += stretched ? 1 : 0;
      own += stretched && kCounts[i] ? 1 : 0;
    }
  }
  storeSpring(exists && (number == 0 || number % 2 == 1), place, number, 0.0, place);
  storeSpring(exists && number == 0, place, 1, 0.0, place);
  precise vec3 impulse = impulses[kImpulseOrder[0]];
  [[unroll]] for (uint i = 1; i < 12; ++i) {
    impulse = impulse + impulses[kImpulseOrder[i]];
  }
  vec3 total = kLimit && round > 0 && isContinued(node) ? fetch(kTotals, node).xyz : vec3(0.0);
  Start start = startOf(here, impulse, cloth.scaledCompliance, total);
  uint springTexelCount = max((number + 1) / 2, 1);
  if (exists) {
    vectors[vectorAt(kResiduals, place)] = start.residual;
    vectors[vectorAt(kCorrections, place)] = vec4(start.correction, 0.0);
    vectors[vectorAt(kPlaces, place)] = vec4(here.place, springTexelCount);
    if (kLimit) {
      vectors[vectorAt(kTotals, node)] = vec4(total, 0.0);
    }
    atomicAdd(stretchedSprings, own);
    atomicMax(mostTexels, springTexelCount);
  }
}

void prepareNodes(uint nodes, uint round) {
  if (self() == 0) {
    stretchedSprings = mostTexels = 0;
  }
  barrier();
  uint place = self();
  do {
    prepareNode(min(place, max(nodes, 1) - 1), round, place < nodes);
    place += width();
  } while (place < nodes);
  finishPass();
}

// Finds the batches with listed walks. The others add nothing.
void findBatches(uint walks) {
  uint all = (system.chunks + kBatchChunks - 1) / kBatchChunks;
  for (uint batch = self(); batch <= all; batch += width()) {
    uint low = 0, high = walks;
    while (low < high) {
      uint middle = (low + high) / 2;
      bool before = lists[at(kWalks, middle)] < batch * kBatchWalks;
      low = before ? middle + 1 : low;
      high = before ? high : middle;
    }
    firstWalks[batch] = low;
  }
  for (uint chunk = self(); chunk < kMostChunks; chunk += width()) {
    chunkSums[chunk] = vec2(0.0);
  }
  barrier();
  if (self() == 0) {
    uint count = 0;
    for (uint batch = 0; batch < all; ++batch) {
      if (firstWalks[batch] < firstWalks[batch + 1]) {
        batches[count] = batch;
        ++count;
      }
    }
    batchCount = count;
  }
  barrier();
}

struct Point {
  vec3 place;
  vec3 z;  // preconditioned residual
};

Point pointAt(vec3 position, ResidualRecord own) {
  precise vec3 z = own.preconditioner * own.residual;
  return Point(position, z);
}

// Force of a spring at `here`, as in conjugate_gradient.glsl.
vec3 pull(Point here, Point other, float along) {
  precise vec3 d = other.place - here.place;
  precise vec3 relative = here.z - other.z;
  precise vec3 force = (along * dotProduct(d, relative)) * d;
  return force;
}

// Computes A z of a node.
void multiplyNode(uint place, bool exists) {
  ResidualRecord own = residualFrom(fetch(kResiduals, place));
  vec4 position = fetch(kPlaces, place);
  Point here = pointAt(position.xyz, own);
  uint count = exists ? uint(position.w) : 1;
  precise vec3 sum = cloth.scaledCompliance * own.residual;
  // All nodes take as many rounds: a software device would run one more to find the end of each.
  uint texel = 0;
  do {
    vec4 two = imageLoad(springTexels, int(min(texel, count - 1) * push.nodes + system.firstNode + place));
    vec2 along = texel < count ? two.xz : vec2(0.0);
    [[unroll]] for (uint j = 0; j < 2; ++j) {
      uint other = uint(j == 0 ? two.y : two.w);
      Point point = pointAt(fetch(kPlaces, other).xyz, residualFrom(fetch(kResiduals, other)));
      sum = sum + pull(here, point, along[j]);
    }
    ++texel;
  } while (texel < mostTexels);
  precise vec3 kept = own.preconditioner > 0.0 ? sum : vec3(0.0);
  if (exists) {
    vectors[vectorAt(kProducts, place)] = vec4(kept, dotProduct(here.z, kept));
  }
}

// Sums over the nodes of a walk: residual . z and z . A z, with z the preconditioned residual.
vec2 sumOfWalk(uint walk) {
  uint nodes = bitCount(lists[at(kMasks, walk)] & kAllOfWalk);
  uint first = lists[at(kFirsts, walk)];
  precise vec2 sums = vec2(0.0);
  [[unroll]] for (uint k = 0; k < kWalk; ++k) {
    uint place = first + min(k, max(nodes, 1) - 1);
    ResidualRecord own = residualFrom(fetch(kResiduals, place));
    precise vec3 z = own.preconditioner * own.residual;
    vec2 part = vec2(dotProduct(own.residual, z), fetch(kProducts, place).w);
    sums = k < nodes ? sums + part : sums;
  }
  return sums;
}

// Adds up the chunks of a batch in the order of sumOfLanes().
void addBatch(uint batch) {
  uint i = self();
  do {
    walkSums[i] = vec2(0.0);
    i += width();
  } while (i < kBatchWalks);
  barrier();
  uint end = firstWalks[batch + 1];
  i = firstWalks[batch] + self();
  do {
    uint walk = lists[at(kWalks, min(i, end - 1))];
    vec2 sums = sumOfWalk(walk);
    if (i < end) {
      walkSums[walk - batch * kBatchWalks] = sums;
    }
    i += width();
  } while (i < end);
  barrier();
  for (uint half_ = kLanes / 2; half_ > 0; half_ /= 2) {
    for (uint pair = self(); pair < kBatchChunks * half_; pair += width()) {
      uint lane = pair / half_ * kLanes + pair % half_;
      precise vec2 sum = walkSums[lane] + walkSums[lane + half_];
      walkSums[lane] = sum;
    }
    barrier();
  }
  for (uint chunk = self(); chunk < kBatchChunks; chunk += width()) {
    chunkSums[batch * kBatchChunks + chunk] = walkSums[chunk * kLanes];
  }
  barrier();
}

// Decides whether to continue, and by which step.
void takeSums(bool normOnly) {
  for (uint i = 0; i < batchCount; ++i) {
    addBatch(batches[i]);
  }
  for (uint lane = self(); lane < kLanes; lane += width()) {
    precise vec2 sum = vec2(0.0);
    for (uint chunk = lane; chunk < system.chunks; chunk += kLanes) {
      sum = sum + chunkSums[chunk];
    }
    lanes[lane] = sum;
  }
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    SolveRecord next = measured(solve, sums.x, cloth, normOnly);
    if (next.running != 0) {
      next = stepped(next, sums);
    }
    solve = next;
  }
  barrier();
}

// Takes the step at a node.
void updateNode(uint place, bool exists) {
  bool first = solve.iterations == 1;
  ResidualRecord before = residualFrom(fetch(kResiduals, place));
  vec3 oldDirection = first ? vec3(0.0) : fetch(kDirections, place).xyz;
  vec3 oldImage = first ? vec3(0.0) : fetch(kImages, place).xyz;
  precise vec3 direction = before.preconditioner * before.residual + solve.directionShare * oldDirection;
  precise vec3 image = fetch(kProducts, place).xyz + solve.directionShare * oldImage;
  precise vec3 residual = before.residual - solve.stepLength * image;
  precise vec3 correction = fetch(kCorrections, place).xyz + solve.stepLength * direction;
  uint node = kLimit ? lists[at(kNodes, place)] : 0;
  precise vec3 total = kLimit ? fetch(kTotals, node).xyz + solve.stepLength * direction : vec3(0.0);
  if (exists) {
    vectors[vectorAt(kDirections, place)].xyz = direction;
    vectors[vectorAt(kImages, place)].xyz = image;
    vectors[vectorAt(kResiduals, place)].xyz = residual;
    vectors[vectorAt(kCorrections, place)].xyz = correction;
    if (kLimit) {
      vectors[vectorAt(kTotals, node)].xyz = total;
    }
  }
}

// Conjugate gradients.
void solveNodes(uint nodes) {
  if (self() == 0) {
    solve = SolveRecord(0, 0.0, stretchedSprings, 0, 0.0, 0.0, 0.0, 0.0, 0);
  }
  barrier();
  do {
    uint place = self();
    do {
      multiplyNode(min(place, max(nodes, 1) - 1), place < nodes);
      place += width();
    } while (place < nodes);
    finishPass();
    takeSums(false);
    uint end = solve.running == 0 ? 0 : nodes;
    place = self();
    do {
      updateNode(min(place, max(nodes, 1) - 1), place < end);
      place += width();
    } while (place < end);
    finishPass();
  } while (solve.running != 0 && solve.iterations < uint(cloth.solverIterations));
  takeSums(true);
}

// Adds the solution to the free motion. If a collision follows, it stores the result.
void moveNodes(uint nodes, bool last) {
  bool kept = last && push.collides != 0;
  uint place = self();
  do {
    uint inside = min(place, max(nodes, 1) - 1);
    uint node = system.firstNode + lists[at(kNodes, inside)];
    vec3 correction = fetch(kCorrections, inside).xyz;
    vec4 from = freePositions[node];
    precise vec3 position = from.xyz + push.substepSeconds * correction;
    precise vec3 velocity = velocities[node].xyz + correction;
    if (place < nodes) {
      freePositions[node] = vec4(kept ? position : snapTiny(position), from.w);
      velocities[node] = vec4(kept ? velocity : snapTiny(velocity), 0.0);
    }
    place += width();
  } while (place < nodes);
  finishPass();
}

// Rounds of loops that an invocation needs for the iterations of a solve.
uint loopsOf(uint walks, uint nodes) {
  uint wide = width();
  uint products = (nodes + wide - 1) / wide * (4 + mostTexels);
  uint sums = (walks + wide - 1) / wide + batchCount * (3 * kBatchWalks / wide + 24) + 4 * kLanes / wide + 24;
  return (products + sums + 4) * (uint(cloth.solverIterations) + 1);
}

// True if this workgroup has solved a round. `spent` counts the rounds of its loops.
bool solveRound(uint round, bool resumed, inout uint spent) {
  uint head = kTables * push.nodes + kHead * system.number;
  if (!resumed) {
    findNodes(round);
    prepareNodes(listed[1], round);
  }
  uint walks = listed[0], nodes = listed[1];
  findBatches(walks);
  uint loops = loopsOf(walks, nodes);
  spent += loops + 8 * shareOf(walkCount);
  if (!kContinues && spent > push.mostLoops && nodes > 0) {
    if (self() == 0) {
      lists[head] = walks;
      lists[head + 1] = nodes;
      lists[head + 2] = mostTexels;
      lists[head + 3] = stretchedSprings;
      lists[head + 4] = round;
      lists[head + 5] = 1;
      stretches[push.nextSize] = push.systems;
    }
    return false;
  }
  if (nodes == 0) {
    return false;
  }
  solveNodes(nodes);
  if (self() == 0) {
    lists[head + 1] = nodes;
    solves[system.number] = solve;
  }
  moveNodes(nodes, round + 1 == push.rounds);
  return true;
}

void main() {
  system = systemAt(push.firstSystem + gl_WorkGroupID.x);
  cloth = clothAt(cloths, system.cloth);
  walkCount = (system.rows + kWalk - 1) / kWalk * system.columns;
  uint round = 0, spent = 0;
  bool resumed = false;
  if (kContinues) {
    uint head = kTables * push.nodes + kHead * system.number;
    bool continued = lists[head + 5] != 0;
    round = continued ? lists[head + 4] : push.rounds;
    resumed = true;
    if (self() == 0) {
      listed[0] = lists[head];
      listed[1] = continued ? lists[head + 1] : 0;
      mostTexels = lists[head + 2];
      stretchedSprings = lists[head + 3];
    }
    barrier();
    if (self() == 0) {
      lists[head + 5] = 0;
      stretches[push.nextSize] = 0;
    }
  } else if (self() == 0) {
    stretches[push.stretchSize] = 0;
  }
  bool solved;
  do {
    solved = solveRound(round, resumed, spent);
    resumed = false;
    ++round;
  } while (solved && round < push.rounds);
}

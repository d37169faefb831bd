// SPDX-License-Identifier: MIT
// Applies tethers and grabs to the nodes at a substep's end, after solver and collisions.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

// False leaves out code that no cloth needs.
layout(constant_id = 1) const bool kTethers = true;
layout(constant_id = 2) const bool kGrabs = true;

layout(binding = 2) uniform samplerBuffer tethers;  // TetherRecord by node
layout(std430, binding = 3) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 4) buffer Velocities {
  vec4 velocities[];
};
layout(std430, binding = 5) buffer GrabbedNodes {
  GrabbedNode grabbed[];
};

layout(push_constant) uniform Push {
  PullPush push;
};

struct State {
  vec3 position;
  vec3 velocity;
};

bool isTaut(vec3 position, TetherEnd tether) {
  if (tether.anchor == 0.0) {
    return false;
  }
  precise vec3 away = position - positions[int(tether.anchor) - 1].xyz;
  precise float squared = tether.distance * tether.distance;
  return dotProduct(away, away) > squared;
}

// Moves a node back to the end of its tether, [KCM12] 3.2, and removes the velocity that led beyond it. This
// kernel does not write anchors.
State tie(State node, TetherEnd tether) {
  if (!isTaut(node.position, tether)) {
    return node;
  }
  int anchor = int(tether.anchor) - 1;
  vec3 end = positions[anchor].xyz;
  precise vec3 away = node.position - end;
  precise float squared = dotProduct(away, away);
  precise vec3 direction = away * reciprocalSquareRoot(max(squared, 1e-24));
  precise vec3 position = end + tether.distance * direction;
  precise float leaving = max(dotProduct(node.velocity - velocities[anchor].xyz, direction), 0.0);
  precise vec3 velocity = node.velocity - leaving * direction;
  return State(position, velocity);
}

vec3 placeAt(GrabRecord grab, vec3 offset, vec3 inGrab, float progress) {
  vec4 orientation = orientationAt(grab.orientation, grab.orientationChange, progress);
  precise float left = grab.left + progress * grab.leftChange;
  precise vec3 place = grab.position + progress * grab.motion + left * offset + rotate(orientation, inGrab);
  return place;
}

// Gives a node the velocity of its place in the grab, plus a velocity towards that place, limited by the
// grab's force.
State pull(State node, float inverseMass, uint number, GrabRecord grab, vec3 inGrab, vec3 after) {
  vec3 before = placeAt(grab, reports[number].offset, inGrab, push.progressBefore);
  precise vec3 carried = push.substepRate * (after - before);
  precise vec3 lag = push.substepRate * (after - node.position);
  precise vec3 wanted = (1.0 - push.caughtUp) * (carried - node.velocity) + push.caughtUp * lag;
  precise float share = grab.force * reciprocal(float(reports[number].grabbed));
  precise float most = (share * inverseMass) * push.substepSeconds;
  precise float squared = dotProduct(wanted, wanted);
  precise float mostSquared = most * most;
  precise vec3 gained = wanted;
  if (squared > mostSquared) {
    gained = wanted * (most * reciprocalSquareRoot(max(squared, 1e-24)));
  }
  precise vec3 position = node.position + push.substepSeconds * gained;
  precise vec3 velocity = node.velocity + gained;
  return State(position, velocity);
}

void pullNode(uint index) {
  TetherEnd none = TetherEnd(0.0, 0.0);
  TetherRecord tether = TetherRecord(TetherEnd[2](none, none));
  GrabbedNode taken = GrabbedNode(vec3(0.0), 0.0);
  if (kTethers) {
    tether = tetherAt(tethers, index);
  }
  if (kGrabs) {
    taken = grabbed[index];
  }
  if (tether.ends[0].anchor == 0.0 && taken.grabber == 0.0) {
    return;
  }
  vec4 position = positions[index];
  float inverseMass = position.w;
  bool isPulled =
      taken.grabber != 0.0 || isTaut(position.xyz, tether.ends[0]) || isTaut(position.xyz, tether.ends[1]);
  if (inverseMass == 0.0 || !isPulled) {
    return;
  }
  State node = State(position.xyz, velocities[index].xyz);
  if (kTethers) {
    // The shorter tether comes last, so that its length is exact.
    node = tie(node, tether.ends[1]);
    node = tie(node, tether.ends[0]);
  }
  if (kGrabs && taken.grabber > 0.0) {
    uint number = uint(taken.grabber) - 1;
    GrabRecord grab = grabAt(grabs, number);
    vec3 place = placeAt(grab, reports[number].offset, taken.place, push.progressAfter);
    precise vec3 out_ = place - node.position;
    bool isReleased = grab.state == kReleasedGrab;
    bool slips = dotProduct(out_, out_) > grab.squaredSlip;
    if (isReleased || slips) {
      grabbed[index] = GrabbedNode(vec3(0.0), 0.0);
      if (!isReleased) {
        atomicAdd(reports[number].slipped, 1);
      }
    } else {
      node = pull(node, inverseMass, number, grab, taken.place, place);
    }
  }
  positions[index].xyz = snapTiny(node.position);
  velocities[index].xyz = snapTiny(node.velocity);
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    pullNode(node);
  }
}

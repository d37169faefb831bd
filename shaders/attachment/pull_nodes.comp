// SPDX-License-Identifier: MIT
// What tethers and grabs do to a node at a substep's end, after its solver and its collisions.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

// What there is none of is left out.
layout(constant_id = 1) const bool kTethers = true;
layout(constant_id = 2) const bool kGrabs = true;

layout(binding = 2) uniform samplerBuffer tethers;  // TetherRecord, a node
layout(std430, binding = 3) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 4) buffer Velocities {
  vec4 velocities[];
};
layout(std430, binding = 5) buffer Grabbed {
  vec4 grabbed[];  // as in begin_grabs.comp
};

layout(push_constant) uniform Push {
  PullPush push;
};

struct State {
  vec3 position;
  vec3 velocity;
};

bool isTaut(vec3 position, float anchor, float length_) {
  if (anchor == 0.0) {
    return false;
  }
  precise vec3 away = position - positions[int(anchor) - 1].xyz;
  return dotProduct(away, away) > length_ * length_;
}

// Back to the end of the tether, [KCM12] 3.2, without the velocity that led beyond it. Anchors are nodes that
// this kernel does not write.
State tie(State node, float anchor, float length_) {
  if (!isTaut(node.position, anchor, length_)) {
    return node;
  }
  int at = int(anchor) - 1;
  vec3 end = positions[at].xyz;
  precise vec3 away = node.position - end;
  precise float squared = dotProduct(away, away);
  precise vec3 direction = away * reciprocalSquareRoot(max(squared, 1e-24));
  precise vec3 position = end + length_ * direction;
  precise float leaving = max(dotProduct(node.velocity - velocities[at].xyz, direction), 0.0);
  precise vec3 velocity = node.velocity - leaving * direction;
  return State(position, velocity);
}

// The velocity of its place in the grab, and what takes the node there, as far as the grab's force does.
State pull(State node, float inverseMass, uint grab, vec3 inGrab, vec3 after) {
  vec4 start = grabTexel(grab, 0);
  vec4 motion = grabTexel(grab, 1);
  vec4 turned = turnedAt(grabTexel(grab, 2), grabTexel(grab, 3), push.progressBefore);
  precise vec3 before = start.xyz + push.progressBefore * motion.xyz + rotate(turned, inGrab);
  precise vec3 carried = push.substepRate * (after - before);
  precise vec3 lag = push.substepRate * (after - node.position);
  precise vec3 wanted = (1.0 - push.caughtUp) * (carried - node.velocity) + push.caughtUp * lag;
  precise float share = motion.w * reciprocal(float(reports[grab].held));
  precise float most = (share * inverseMass) * push.substepSeconds;
  precise float squared = dotProduct(wanted, wanted);
  precise vec3 gained = wanted;
  if (squared > most * most) {
    gained = wanted * (most * reciprocalSquareRoot(max(squared, 1e-24)));
  }
  precise vec3 position = node.position + push.substepSeconds * gained;
  precise vec3 velocity = node.velocity + gained;
  return State(position, velocity);
}

vec3 placeAtEnd(uint grab, vec3 inGrab) {
  vec4 start = grabTexel(grab, 0);
  vec4 motion = grabTexel(grab, 1);
  vec4 turned = turnedAt(grabTexel(grab, 2), grabTexel(grab, 3), push.progressAfter);
  precise vec3 place = start.xyz + push.progressAfter * motion.xyz + rotate(turned, inGrab);
  return place;
}

void hold(uint index) {
  vec4 tether = kTethers ? texelFetch(tethers, int(index)) : vec4(0.0);
  vec4 hold = kGrabs ? grabbed[index] : vec4(0.0);
  if (tether.x == 0.0 && hold.w == 0.0) {
    return;
  }
  vec4 position = positions[index];
  float inverseMass = position.w;
  bool isPulled =
      hold.w != 0.0 || isTaut(position.xyz, tether.x, tether.y) || isTaut(position.xyz, tether.z, tether.w);
  if (inverseMass == 0.0 || !isPulled) {
    return;
  }
  State node = State(position.xyz, velocities[index].xyz);
  if (kTethers) {
    // The shorter last: it holds exactly.
    node = tie(node, tether.z, tether.w);
    node = tie(node, tether.x, tether.y);
  }
  if (kGrabs && hold.w > 0.0) {
    uint grab = uint(hold.w) - 1;
    vec3 place = placeAtEnd(grab, hold.xyz);
    precise vec3 out_ = place - node.position;
    bool lets = grabTexel(grab, 4).x == kReleasedGrab;
    bool slips = dotProduct(out_, out_) > grabTexel(grab, 0).w;
    if (lets || slips) {
      grabbed[index] = vec4(0.0);
      if (!lets) {
        atomicAdd(reports[grab].slipped, 1);
      }
    } else {
      node = pull(node, inverseMass, grab, hold.xyz, place);
    }
  }
  positions[index].xyz = snapTiny(node.position);
  velocities[index].xyz = snapTiny(node.velocity);
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    hold(node);
  }
}

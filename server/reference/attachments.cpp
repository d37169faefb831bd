// SPDX-License-Identifier: MIT
// Attachments, tethers and grabs of the reference.
#include "server/reference/attachments.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/model/cloth_skin.h"

namespace clothstream::reference {
namespace {

Vec3 placeIn(const Pose& pose, const Vec3& inFrame) {
  return pose.position + pose.orientation * inFrame;
}

// [KCM12] 3.2.
void tie(ReferenceCloth& cloth, std::size_t node, const model::Tether& tether, double slack) {
  if (tether.anchor == model::Tether::kNone) return;
  const double length = double{tether.length} * (1 + slack);
  const Vec3 away = cloth.positions()[node] - cloth.positions()[tether.anchor];
  if (away.norm() <= length) return;
  const Vec3 direction = away.normalized();
  cloth.positions()[node] = cloth.positions()[tether.anchor] + length * direction;
  const double leaving = (cloth.velocities()[node] - cloth.velocities()[tether.anchor]).dot(direction);
  if (leaving > 0) cloth.velocities()[node] -= leaving * direction;
}

}  // namespace

void carryAlong(ReferenceCloth& cloth, const Carry& carry) {
  const Quaternion turn = carry.to.orientation * carry.from.orientation.conjugate();
  for (Vec3& position : cloth.positions())
    position = carry.to.position + turn * (position - carry.from.position);
  for (Vec3& velocity : cloth.velocities()) velocity = turn * velocity;
}

Attachments::Attachments(const model::Scene& scene) {
  for (std::size_t c = 0; c < scene.cloths.size(); ++c) {
    const model::Cloth& cloth = scene.cloths[c];
    const std::vector<model::Vec3> places = model::startPositions(scene, cloth);
    for (const model::Attachment& attachment : cloth.attachments) {
      const Pose frame = toPose(model::frameAt(scene, attachment, 0));
      const std::vector<std::uint8_t> attached = model::attachedNodes(cloth, attachment);
      for (std::size_t node = 0; node < attached.size(); ++node)
        if (attached[node] != 0)
          attached_.push_back(
              {c, node, start_.size(),
               frame.orientation.conjugate() * (places[node].cast<double>() - frame.position)});
      start_.push_back(frame);
    }
    tethers_.push_back(cloth.tethers ? model::nodeTethers(cloth) : std::vector<model::NodeTethers>());
    slack_.push_back(cloth.tethers ? double{cloth.tethers->slack} : 0);
    held_.emplace_back(cloth.nodeCount());
  }
}

void Attachments::begin(std::vector<ReferenceCloth>& cloths, std::span<const Pose> frames,
                        std::span<const Grab> grabs, double tickSeconds) {
  for (const Attached& attached : attached_) {
    ReferenceCloth& cloth = cloths[attached.cloth];
    const Pose& frame = frames.empty() ? start_[attached.frame] : frames[attached.frame];
    Vec3 velocity = (placeIn(frame, attached.place) - cloth.positions()[attached.node]) / tickSeconds;
    const double speed = velocity.norm();
    if (speed > model::kMaxAttachmentSpeed) velocity *= model::kMaxAttachmentSpeed / speed;
    cloth.velocities()[attached.node] = velocity;
  }
  status_.resize(std::max(status_.size(), grabs.size()));
  for (std::size_t g = 0; g < grabs.size(); ++g) {
    const Grab& grab = grabs[g];
    if (grab.state != Grab::State::takes) continue;
    status_[g] = {};
    Vec3 begin = grab.start.position;
    double reach = grab.reach;
    if (grab.place) {
      const std::span<const Vec3> positions = cloths[grab.place->cloth].positions();
      begin.setZero();
      for (std::size_t i = 0; i < 3; ++i) begin += grab.place->weights[i] * positions[grab.place->nodes[i]];
      reach = 0;
      for (const std::size_t node : grab.place->nodes)
        reach = std::max(reach, (positions[node] - begin).norm());
    }
    status_[g].offset = begin - grab.start.position;
    const auto distance = [&](std::size_t c, std::size_t node) {
      return (cloths[c].positions()[node] - begin).norm();
    };
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < cloths.size(); ++c)
      for (std::size_t node = 0; node < held_[c].size(); ++node)
        if (cloths[c].inverseMasses()[node] > 0) nearest = std::min(nearest, distance(c, node));
    if (nearest > std::max(grab.radius, reach)) continue;
    const double within = std::max(grab.radius, nearest);
    for (std::size_t c = 0; c < cloths.size(); ++c)
      for (std::size_t node = 0; node < held_[c].size(); ++node) {
        std::optional<Held>& held = held_[c][node];
        const bool isFree = !held || grabs[held->grab].state != Grab::State::holds;
        if (!isFree || cloths[c].inverseMasses()[node] == 0 || distance(c, node) > within) continue;
        // The first of several beginning grabs gets the node.
        if (held && held->grab < g && grabs[held->grab].state == Grab::State::takes) continue;
        held = {g, grab.start.orientation.conjugate() * (cloths[c].positions()[node] - begin)};
        ++status_[g].taken;
      }
  }
}

void Attachments::apply(std::vector<ReferenceCloth>& cloths, std::span<const Grab> grabs,
                        std::uint32_t substep, std::uint32_t substeps, double tickSeconds) {
  const double h = tickSeconds / substeps;
  for (std::size_t c = 0; c < cloths.size(); ++c) {
    ReferenceCloth& cloth = cloths[c];
    for (std::size_t node = 0; node < held_[c].size(); ++node) {
      if (cloth.inverseMasses()[node] == 0) continue;
      if (!tethers_[c].empty())
        for (const std::size_t k : {1u, 0u}) tie(cloth, node, tethers_[c][node][k], slack_[c]);
      std::optional<Held>& held = held_[c][node];
      if (!held) continue;
      const Grab& grab = grabs[held->grab];
      const ColliderStep step = stepOf(grab.start, grab.end, substep, substeps, tickSeconds);
      const auto offsetAt = [&](double substepsDone) -> Vec3 {
        const double progress = substepsDone / substeps;
        return std::lerp(grab.leftAtStart, grab.leftAtEnd, progress) * status_[held->grab].offset;
      };
      const Vec3 before = placeIn(step.before, held->place) + offsetAt(substep);
      const Vec3 after = placeIn(step.after, held->place) + offsetAt(substep + 1.0);
      Vec3& position = cloth.positions()[node];
      Vec3& velocity = cloth.velocities()[node];
      const bool slips = grab.leftAtEnd == 0 && (after - position).norm() > grab.slipDistance;
      if (grab.state == Grab::State::free || slips) {
        if (grab.state != Grab::State::free) ++status_[held->grab].slipped;
        held.reset();
        continue;
      }
      Vec3 gained = (1 - double{model::kGrabCorrectionFraction}) * ((after - before) / h - velocity) +
                    double{model::kGrabCorrectionFraction} * (after - position) / h;
      const double most = grab.maxForce / status_[held->grab].taken * cloth.inverseMasses()[node] * h;
      if (gained.norm() > most) gained *= most / gained.norm();
      velocity += gained;
      position += h * gained;
    }
  }
}

}  // namespace clothstream::reference

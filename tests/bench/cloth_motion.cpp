// SPDX-License-Identifier: MIT
// Motions of one cloth: small steps of extended position-based dynamics (M. Macklin et al., Small Steps in
// Physics Simulation, 2019).
#include "tests/bench/cloth_motion.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace clothstream::bench {
namespace {

using Vec3 = Eigen::Vector3d;

constexpr double kFrameSeconds = 1.0 / 72;
constexpr double kEdge = 2;        // m
constexpr double kDensity = 0.2;   // kg/m^2
constexpr int kGustStride = 4;     // vertices between samples of the gusts
constexpr int kForceInterval = 4;  // substeps between air forces, and between searches for contacts

struct Constraint {
  int a, b;
  double restLength, compliance;
};

struct Gust {
  Vec3 wave, amplitude;
  double phase;
};

class Motion {
 public:
  explicit Motion(const MotionSettings& settings)
      : settings_(settings),
        width_(static_cast<int>(settings.size)),
        spacing_(kEdge / (width_ - 1)),
        dt_(kFrameSeconds / settings.substeps),
        collides_(settings.scene != MotionScene::flag) {
    random_.seed(settings.seed);
    const std::size_t n = static_cast<std::size_t>(width_ * width_);
    positions_.assign(n, Vec3::Zero());
    before_ = velocities_ = smoothed_ = forces_ = positions_;
    inverseMasses_.assign(n, 1 / (kDensity * spacing_ * spacing_));
    place();
    pin();
    connect();
    for (int i = 0; i < 24; ++i) addGust(i);
    if (settings.scene == MotionScene::drape)
      sphere_ = {0, 0.75, 0}, sphereRadius_ = 0.45, sphereFriction_ = 0.24;
    if (settings.scene == MotionScene::curtain) sphereRadius_ = 0.25;
    if (settings.scene != MotionScene::drape) floor_ = -10;
  }

  // Number of frames before the first one that is used.
  int warmUp() const {
    return settings_.scene == MotionScene::flag ? 72 : settings_.scene == MotionScene::curtain ? 144 : 0;
  }

  void advance(int frame) {
    const int substeps = static_cast<int>(settings_.substeps);
    for (int substep = 0; substep < substeps; ++substep) {
      time_ = (frame + substep / static_cast<double>(substeps)) * kFrameSeconds;
      moveSphere(frame < 0);
      if (substep % kForceInterval == 0) blow();
      if (collides_ && substep % kForceInterval == 0) findContacts();
      integrate();
      project();
      if (collides_) separate();
      collide();
      for (std::size_t i = 0; i < positions_.size(); ++i) {
        velocities_[i] =
            inverseMasses_[i] == 0 ? Vec3::Zero() : Vec3((positions_[i] - before_[i]) * (1 / dt_));
      }
      if (substep % 2 == 0) damp();
    }
  }

  void write(std::span<float> out) const {
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        out[3 * i + c] = static_cast<float>(positions_[i][static_cast<Eigen::Index>(c)]);
    }
  }

 private:
  int at(int column, int row) const { return row * width_ + column; }
  Vec3& position(int column, int row) { return positions_[static_cast<std::size_t>(at(column, row))]; }
  double uniform() { return uniform_(random_); }

  void place() {
    for (int row = 0; row < width_; ++row) {
      for (int column = 0; column < width_; ++column) {
        const double u = column * spacing_ - 1, v = row * spacing_ - 1;
        Vec3 p = Vec3::Zero();
        if (settings_.scene == MotionScene::drape) p = {u + 0.22, 1.5, v + 0.08};
        if (settings_.scene == MotionScene::flag) p = {u + 1, 1 - v, 0.02 * std::sin(3 * u) * (u + 1)};
        if (settings_.scene == MotionScene::curtain) {
          p = {u * 0.82, 1.15 - v * 0.99, 0.07 * std::sin(u * std::numbers::pi * 5)};
        }
        for (int c = 0; c < 3; ++c) p[c] += 1e-4 * uniform();
        position(column, row) = p;
      }
    }
  }

  void pin() {
    const auto hold = [&](int column, int row) {
      inverseMasses_[static_cast<std::size_t>(at(column, row))] = 0;
    };
    if (settings_.scene == MotionScene::flag) {
      for (int k = 0; k < std::max(2, width_ / 50); ++k) hold(0, k), hold(0, width_ - 1 - k);
    }
    if (settings_.scene == MotionScene::curtain) {
      for (int column = 0; column < width_; column += std::max(1, width_ / 20)) hold(column, 0);
      hold(width_ - 1, 0);
    }
  }

  // Orders the list so that neighbours in it share no vertex.
  void connect() {
    constexpr double kStretch = 0, kShear = 2e-6, kBend = 2e-3;
    const auto add = [&](int column, int row, int toColumn, int toRow, double compliance) {
      if (toColumn < 0 || toColumn >= width_ || toRow >= width_) return;
      const double length = std::hypot(toColumn - column, toRow - row) * spacing_;
      constraints_.push_back({at(column, row), at(toColumn, toRow), length, compliance});
    };
    const auto all = [&](int firstRow, int rowStep, int firstColumn, int columnStep, int right, int down,
                         double compliance) {
      for (int row = firstRow; row < width_; row += rowStep) {
        for (int column = firstColumn; column < width_; column += columnStep) {
          add(column, row, column + right, row + down, compliance);
        }
      }
    };
    for (int k = 0; k < 2; ++k) all(0, 1, k, 2, 1, 0, kStretch);
    for (int k = 0; k < 2; ++k) all(k, 2, 0, 1, 0, 1, kStretch);
    for (int k = 0; k < 2; ++k) all(k, 2, 0, 1, 1, 1, kShear);
    for (int k = 0; k < 2; ++k) all(k, 2, 0, 1, -1, 1, kShear);
    for (int k = 0; k < 4; ++k) all(0, 1, k, 4, 2, 0, kBend);
    for (int k = 0; k < 4; ++k) all(k, 4, 0, 1, 0, 2, kBend);
  }

  void addGust(int i) {
    const double length = std::exp(std::log(0.25) + (std::log(3.0) - std::log(0.25)) * (i / 23.0));
    Vec3 direction = Vec3::Zero(), amplitude = Vec3::Zero();
    for (int c = 0; c < 3; ++c) direction[c] = uniform();
    direction /= direction.norm();
    for (int c = 0; c < 3; ++c) amplitude[c] = uniform();
    amplitude -= direction * amplitude.dot(direction);
    gusts_.push_back({direction * (2 * std::numbers::pi / length), amplitude * std::pow(length / 3, 0.4),
                      uniform() * std::numbers::pi});
  }

  static Vec3 spherePath(double time) {
    if (time < 0.5) return {-0.25, 0.85, -0.9};
    const double s = time - 0.5;
    return {-0.25 + 0.5 * (0.5 - 0.5 * std::cos(s * 2 * std::numbers::pi / 7.2)),
            0.85 + 0.15 * std::sin(s * 1.1), -0.9 * std::cos(s * 2 * std::numbers::pi / 3.6)};
  }

  void moveSphere(bool warmingUp) {
    if (settings_.scene != MotionScene::curtain) return;
    const Vec3 from = spherePath(warmingUp ? 0 : time_);
    sphere_ = spherePath(warmingUp ? 0 : time_ + dt_);
    sphereMove_ = sphere_ - from;
  }

  // Mean wind, and strength of its gusts.
  std::pair<Vec3, double> wind() const {
    if (settings_.scene != MotionScene::flag) return {Vec3::Zero(), 0.05};
    const double t = time_;
    const double g =
        1 + 0.35 * std::sin(0.9 * t) + 0.25 * std::sin(2.3 * t + 1) + 0.15 * std::sin(5.1 * t + 2);
    const double side = 2.2 * std::sin(0.7 * t) + 1.2 * std::sin(1.9 * t + 0.5);
    return {Vec3(6 * g * settings_.wind, 0, settings_.wind * side), 1.8 * g * settings_.wind};
  }

  void blow() {
    const auto [mean, strength] = wind();
    const int samples = (width_ + kGustStride - 1) / kGustStride + 1;
    std::vector<Vec3> gusts(static_cast<std::size_t>(samples * samples), Vec3::Zero());
    if (settings_.scene == MotionScene::flag) {
      for (int row = 0; row < samples; ++row) {
        for (int column = 0; column < samples; ++column) {
          const Vec3 drifted =
              position(std::min(column * kGustStride, width_ - 1), std::min(row * kGustStride, width_ - 1)) -
              Vec3(6 * time_, 0, 0);
          Vec3 sum = Vec3::Zero();
          for (const Gust& gust : gusts_)
            sum += gust.amplitude * std::sin(gust.wave.dot(drifted) + gust.phase + 0.8 * time_);
          gusts[static_cast<std::size_t>(row * samples + column)] = sum * strength;
        }
      }
    }
    const auto windAt = [&, mean = mean](int column, int row) -> Vec3 {
      const int c = column / kGustStride, r = row / kGustStride;
      const double fc = (column % kGustStride) / static_cast<double>(kGustStride),
                   fr = (row % kGustStride) / static_cast<double>(kGustStride);
      const auto gust = [&](int gc, int gr) -> const Vec3& {
        return gusts[static_cast<std::size_t>(std::min(gr, samples - 1) * samples +
                                              std::min(gc, samples - 1))];
      };
      const Vec3 above = gust(c, r) * (1 - fc) + gust(c + 1, r) * fc;
      const Vec3 below = gust(c, r + 1) * (1 - fc) + gust(c + 1, r + 1) * fc;
      return mean + above * (1 - fr) + below * fr;
    };
    std::fill(forces_.begin(), forces_.end(), Vec3::Zero());
    for (int row = 0; row + 1 < width_; ++row) {
      for (int column = 0; column + 1 < width_; ++column) {
        const std::size_t a = static_cast<std::size_t>(at(column, row)), b = a + 1,
                          c = a + static_cast<std::size_t>(width_), d = c + 1;
        const Vec3 normalArea = (positions_[d] - positions_[a]).cross(positions_[c] - positions_[b]) * 0.5;
        const double area = normalArea.norm();
        if (area < 1e-12) continue;
        const Vec3 normal = normalArea * (1 / area);
        const Vec3 velocity = (velocities_[a] + velocities_[b] + velocities_[c] + velocities_[d]) * 0.25;
        const Vec3 relative = windAt(column, row) - velocity;
        const double through = relative.dot(normal), speed = relative.norm();
        const Vec3 force = (normal * (0.6 * area * through * speed * 1.2) +
                            (relative - normal * through) * (0.6 * area * speed * 0.03)) *
                           0.25;
        for (const std::size_t corner : {a, b, c, d}) forces_[corner] += force;
      }
    }
  }

  // Finds pairs that are near but not neighbours in the grid.
  void findContacts() {
    constexpr std::uint32_t kBuckets = 1u << 17;
    const double cell = contactDistance() + 0.5 * spacing_;
    contacts_.clear();
    firstInBucket_.assign(kBuckets, -1);
    nextInBucket_.assign(positions_.size(), -1);
    const auto bucketOf = [](int x, int y, int z) {
      const auto mix = [](int value, std::uint32_t factor) {
        return static_cast<std::uint32_t>(value) * factor;
      };
      return (mix(x, 73856093u) ^ mix(y, 19349663u) ^ mix(z, 83492791u)) & (kBuckets - 1);
    };
    const auto cellOf = [cell](double x) { return static_cast<int>(std::floor(x / cell)); };
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      const Vec3& p = positions_[i];
      const int x = cellOf(p.x()), y = cellOf(p.y()), z = cellOf(p.z());
      std::vector<std::uint32_t>& seen = seenBuckets_;
      seen.clear();
      for (int k = 0; k < 27; ++k) {
        const std::uint32_t bucket = bucketOf(x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1);
        if (std::find(seen.begin(), seen.end(), bucket) != seen.end()) continue;
        seen.push_back(bucket);
        for (int j = firstInBucket_[bucket]; j >= 0; j = nextInBucket_[static_cast<std::size_t>(j)]) {
          const int self = static_cast<int>(i);
          if (std::abs(self % width_ - j % width_) <= 1 && std::abs(self / width_ - j / width_) <= 1)
            continue;
          if ((p - positions_[static_cast<std::size_t>(j)]).squaredNorm() < cell * cell)
            contacts_.push_back({self, j});
        }
      }
      const std::uint32_t bucket = bucketOf(x, y, z);
      nextInBucket_[i] = firstInBucket_[bucket];
      firstInBucket_[bucket] = static_cast<int>(i);
    }
  }

  void integrate() {
    const double fastest = collides_ ? 0.4 * spacing_ / dt_ : 1e9;
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      before_[i] = positions_[i];
      if (inverseMasses_[i] == 0) continue;
      Vec3& v = velocities_[i];
      v.y() -= 9.81 * dt_;
      v += forces_[i] * (dt_ * inverseMasses_[i]);
      const double speed = v.norm();
      if (speed > fastest) v *= fastest / speed;
      positions_[i] += v * dt_;
    }
  }

  void project() {
    for (const Constraint& constraint : constraints_) {
      const std::size_t a = static_cast<std::size_t>(constraint.a),
                        b = static_cast<std::size_t>(constraint.b);
      const double sum = inverseMasses_[a] + inverseMasses_[b];
      const Vec3 edge = positions_[b] - positions_[a];
      const double length = edge.norm();
      if (sum == 0 || length < 1e-12) continue;
      const double lambda =
          (length - constraint.restLength) / (sum + constraint.compliance / (dt_ * dt_)) / length;
      positions_[a] += edge * (inverseMasses_[a] * lambda);
      positions_[b] -= edge * (inverseMasses_[b] * lambda);
    }
  }

  void separate() {
    const double radius = contactDistance();
    for (const auto& [first, second] : contacts_) {
      const std::size_t i = static_cast<std::size_t>(first), j = static_cast<std::size_t>(second);
      const Vec3 between = positions_[i] - positions_[j];
      const double squared = between.squaredNorm();
      if (squared >= radius * radius || squared < 1e-18) continue;
      const double length = std::sqrt(squared);
      const Vec3 push = between * (0.25 * (radius - length) / length);
      if (inverseMasses_[i] > 0) positions_[i] += push;
      if (inverseMasses_[j] > 0) positions_[j] -= push;
      const Vec3 moveI = positions_[i] - before_[i], moveJ = positions_[j] - before_[j];
      const Vec3 mean = (moveI + moveJ) * 0.5;
      constexpr double kFriction = 0.2;
      if (inverseMasses_[i] > 0) positions_[i] += (mean - moveI) * kFriction;
      if (inverseMasses_[j] > 0) positions_[j] += (mean - moveJ) * kFriction;
    }
  }

  void collide() {
    constexpr double kSkin = 0.004, kFloorFriction = 0.5;
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      if (inverseMasses_[i] == 0) continue;
      Vec3& p = positions_[i];
      const Vec3 out = p - sphere_;
      const double distance = out.norm(), surface = sphereRadius_ + kSkin;
      if (sphereRadius_ > 0 && distance < surface) {
        const Vec3 normal = out * (1 / distance);
        const double depth = surface - distance;
        p += normal * depth;
        const Vec3 slip = p - before_[i] - sphereMove_;
        rub(p, slip - normal * slip.dot(normal), sphereFriction_ * depth);
      }
      if (p.y() < floor_ + kSkin) {
        const double depth = floor_ + kSkin - p.y();
        p.y() = floor_ + kSkin;
        rub(p, Vec3(p.x() - before_[i].x(), 0, p.z() - before_[i].z()), kFloorFriction * depth);
      }
    }
  }

  static void rub(Vec3& p, const Vec3& slip, double most) {
    const double length = slip.norm();
    if (length > 0) p -= slip * std::min(1.0, most / length);
  }

  // Smooths velocities among neighbours.
  void damp() {
    const double scale = width_ / 100.0;
    const double part = settings_.damping * scale * scale * dt_ * 2;
    for (int row = 0; row < width_; ++row) {
      for (int column = 0; column < width_; ++column) {
        Vec3 sum = Vec3::Zero();
        double count = 0;
        const auto add = [&](int c, int r) {
          if (c < 0 || r < 0 || c >= width_ || r >= width_) return;
          sum += velocities_[static_cast<std::size_t>(at(c, r))];
          count += 1;
        };
        add(column - 1, row);
        add(column + 1, row);
        add(column, row - 1);
        add(column, row + 1);
        const std::size_t i = static_cast<std::size_t>(at(column, row));
        smoothed_[i] = velocities_[i] + (sum * (1 / count) - velocities_[i]) * part;
      }
    }
    for (std::size_t i = 0; i < velocities_.size(); ++i) {
      if (inverseMasses_[i] > 0) velocities_[i] = smoothed_[i] * (1 - 0.05 * dt_ * 2);
    }
  }

  double contactDistance() const { return 0.6 * spacing_; }

  MotionSettings settings_;
  int width_;
  double spacing_, dt_;
  bool collides_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  std::vector<Vec3> positions_, before_, velocities_, smoothed_, forces_;
  std::vector<double> inverseMasses_;
  std::vector<Constraint> constraints_;
  std::vector<Gust> gusts_;
  std::vector<std::pair<int, int>> contacts_;
  std::vector<int> firstInBucket_, nextInBucket_;
  std::vector<std::uint32_t> seenBuckets_;
  Vec3 sphere_ = Vec3::Zero(), sphereMove_ = Vec3::Zero();
  double sphereRadius_ = 0, sphereFriction_ = 0.25, floor_ = 0, time_ = 0;
};

}  // namespace

void playMotion(const MotionSettings& settings,
                const std::function<void(std::uint32_t, std::span<const float>)>& use) {
  Motion motion(settings);
  std::vector<float> positions(std::size_t{3} * settings.size * settings.size);
  const int frames = static_cast<int>(settings.frames);
  for (int frame = -motion.warmUp(); frame < frames; ++frame) {
    motion.advance(frame);
    if (frame < 0) continue;
    motion.write(positions);
    use(static_cast<std::uint32_t>(frame), positions);
  }
}

}  // namespace clothstream::bench

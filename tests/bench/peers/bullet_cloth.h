// SPDX-License-Identifier: MIT
// A square sheet in Bullet, hung by two corners.
#pragma once

#include <cstdint>
#include <memory>

namespace clothstream::bench {

class BulletCloth {
 public:
  // size x size nodes on 1 m, 1 kg, with structural and diagonal links and bend links over two edges.
  BulletCloth(std::uint32_t size, int positionIterations);
  ~BulletCloth();

  void step(float seconds);

  // Mean of |length - rest| / rest over the edges along rows and columns.
  double meanStrain() const;

 private:
  struct World;
  std::uint32_t size_;
  std::unique_ptr<World> world_;
};

}  // namespace clothstream::bench

// SPDX-License-Identifier: MIT
#include "server/delivery/cubic_window.h"

#include <algorithm>
#include <cmath>

namespace clothstream::delivery {

void CubicWindow::acknowledge(double bytes, double passed, double roundTrip) {
  time_ += passed;
  // Section 4.3, equation 4: as fast as Reno with the same decrease, until Reno's window has recovered.
  const double alpha = reno_ < prior_ ? 3 * (1 - kBeta) / (1 + kBeta) : 1;
  reno_ += alpha * kSegment * bytes / window_;
  // Section 4.2, equation 1, and section 4.4: the window of a round trip later, in steps.
  const double target = plateau_ + kC * kSegment * std::pow(time_ + roundTrip - climb_, 3);
  window_ += (std::clamp(target, window_, 1.5 * window_) - window_) * bytes / window_;
  window_ = std::max(window_, reno_);
}

void CubicWindow::reduce() {
  prior_ = window_;
  // Section 4.7: fast convergence.
  plateau_ = window_ < plateau_ ? window_ * (1 + kBeta) / 2 : window_;
  window_ *= kBeta;
  reno_ = window_;
  time_ = 0;
  // Section 4.2, equation 2.
  climb_ = std::cbrt((plateau_ - window_) / (kC * kSegment));
}

}  // namespace clothstream::delivery

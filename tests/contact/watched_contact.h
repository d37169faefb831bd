// SPDX-License-Identifier: MIT
// A scripted hand, a simulated cloth, and a link with a delay: what a user with local contact sees. The
// server sees the hand half a round trip late, and the client shows the cloth as it was the delay of its
// play-out ago.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/contact/scripted_hand.h"

namespace clothstream::tests {

// Joints of the hand at a time in seconds.
using HandScript = std::function<HandJoints(double seconds)>;

struct Motion {
  std::string name;
  HandScript hand;
  double seconds = 0;  // until the hand has rested for some time
};

// A flat hand and fingertips that push through the cloth, 0.6 m at up to `speed`, m/s.
Motion flatHandAt(double speed);
Motion fingersAt(double speed);
// Twice 0.4 m through the cloth and back.
Motion inAndOut();
// 0.4 m along the cloth, 3 cm inside it.
Motion stroke();
std::vector<Motion> allMotions();

// Lengths in metres.
struct ContactFigures {
  double deepest = 0;          // depth of the shown cloth in the hand
  double deepestWithout = 0;   // the same without local contact
  double deepestOnServer = 0;  // depth of the cloth in the hand, as the server simulates both
  double largest = 0;          // correction
  double left = 0;             // correction at the end
  // Largest change of a correction from one display frame to the next, less the way of the hand in this
  // frame.
  double change = 0;
  // The same less the longer of two ways: of the hand now, and of the hand that the shown cloth answers to.
  double changeBesidesAnswer = 0;
};

// Shows 90 frames a second of a cloth of 0.8 m with 81 x 81 nodes.
ContactFigures watch(const Motion& motion, double roundTripSeconds);

}  // namespace clothstream::tests

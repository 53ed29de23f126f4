/// The constants of tracking. docs/reference/tracking.md has their reasons and sensitivities.
#pragma once

namespace dynmesh {

struct TrackingConstants {
  double prediction = 0.8;
  int passes = 6;
  int steps = 8;
  double weight = 0.05;
  double scale = 1.5;
  double wide = 8;
  double narrow = 3;
  double agreement = 0.5;
  double precondition = 1;
  double pull = 0.5;
  int averagings = 4;
  int wide_passes = 3;
  double lateral = 1e9;
  double rigid_radius = 8;
  int rigid_steps = 0;
  int memory_averagings = 1;
  double weight_growth = 1;
  double facing = 0.0;
  double scale_first = 1.5;
  double x1 = 0, x2 = 0, x3 = 0, x4 = 0, x5 = 0, x6 = 0;
};

}  // namespace dynmesh

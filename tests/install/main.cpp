// A frame that is completed in place, in both precisions.
#include <cmath>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <limits>
#include <vector>

template <class Real>
bool completes_a_translation() {
  const std::vector<dynmesh::Index> faces = {0, 1, 2, 2, 1, 3};
  std::vector<Real> frame = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  dynmesh::Completer<Real> completer({faces.data(), 2}, {frame.data(), 4});
  for (Real& x : frame) x = std::numeric_limits<Real>::quiet_NaN();
  frame[0] = frame[1] = frame[2] = 5;
  const dynmesh::Points<Real> points(frame.data(), 4);
  const dynmesh::FrameReport report = completer.push(points, points);
  const auto is_near = [](Real x, Real expected) { return std::abs(x - expected) < Real(1e-5); };
  return report.filled == 3 && is_near(frame[9], 6) && is_near(frame[10], 6) &&
         is_near(frame[11], 5);
}

int main() {
  const bool good = completes_a_translation<float>() && completes_a_translation<double>();
  std::printf("dynmesh %s: %s\n", DYNMESH_VERSION, good ? "works" : "FAILS");
  return good ? 0 : 1;
}

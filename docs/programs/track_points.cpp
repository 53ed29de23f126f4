#include <cmath>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <vector>

struct Point {  // as a scanner may deliver them
  double position[3], normal[3];
};

Point water(double x, double y, double level) {
  return {{x, y, std::sin(x) * std::cos(y) + level},
          {-std::cos(x) * std::cos(y), std::sin(x) * std::sin(y), 1}};
}

int main() {
  std::vector<Point> body, scan;
  std::vector<dynmesh::Index> faces;
  for (int v = 0; v < 900; ++v) {  // the template: 30 by 30 vertices
    const int x = v % 30, y = v / 30;
    body.push_back(water(0.2 * x, 0.2 * y, 0));
    if (x < 29 && y < 29) faces.insert(faces.end(), {v, v + 1, v + 30, v + 30, v + 1, v + 31});
  }
  for (int p = 0; p < 3000; ++p) {  // other points; the water has risen by 0.1
    scan.push_back(water(std::fmod(0.618 * p, 5.8), 5.8 * p / 3000, 0.1));
  }
  const double camera[] = {3, 3, 20};
  const dynmesh::Points<double> tracked(body[0].position, body.size(), 6);  // in place
  dynmesh::Tracker<double> tracker({faces.data(), faces.size() / 3}, tracked);
  const dynmesh::TrackingReport report = tracker.push({.points = {scan[0].position, scan.size(), 6},
                                                       .normals = {scan[0].normal, scan.size(), 6},
                                                       .viewpoints = {camera, 1}},
                                                      tracked);
  std::printf("%zu vertices seen; vertex 0 rose to %.2f\n", report.known, body[0].position[2]);
}
